"""Lens distortion of rendered pinhole images, and correction of detected keypoints for it.

A window of a distorted image is resampled from a pinhole image that is rotated to the window's
centre and just wide enough to cover the window. Trackers receive keypoints in pinhole pixels.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.records import Keypoints, Roi, WorkerMotion
from hrc_env.core.typing import Floats, Image, JointAngles
from hrc_env.geometry.cameras import (
    PinholeCamera,
    inside_image,
    pinhole_from_image,
    pinhole_magnification,
    rays,
)
from hrc_env.perception.blazepose import to_image

WIDEST = float(np.tan(np.radians(78.0)))
"""Maximum half width of a pinhole image [focal lengths]. Parts of windows beyond it are black."""
MAPS_KEPT = 64
"""Maximum number of windows with cached resampling maps."""


class PinholeRenderer(Protocol):
    """A renderer of pinhole images of a scene."""

    size_px: int
    """Side of the rendered images [px]."""

    def pose(self, q: JointAngles, motion: WorkerMotion) -> None:
        """Set the poses of the robot and the workers for subsequent views."""
        ...

    def view(self, camera: PinholeCamera, window: Roi) -> Image:
        """Render a window (size, size, 3) of a pinhole camera's RGB image, top row first."""
        ...


@dataclass(frozen=True, slots=True)
class _Resampling:
    """A pinhole image that covers a window of a distorted image, and the map between them."""

    camera: PinholeCamera
    """Camera that points at the window's centre, with K = 1."""
    window: Roi
    """Window of the pinhole image that is rendered."""
    x: NDArray[np.float32]
    """Column coordinates (size, size) in the rendered image from which each output pixel is sampled
    [px]; 0 is the centre of the first column."""
    y: NDArray[np.float32]
    """Row coordinates (size, size) in the rendered image from which each output pixel is sampled
    [px]; 0 is the centre of the first row."""


class LensRenderer:
    """An `ImageSource` of rendered images with the distortion of a rig's lenses.

    Args:
        renderer: renderer of the pinhole images.
        cameras: the rig.
    """

    def __init__(self, renderer: PinholeRenderer, cameras: Sequence[PinholeCamera]) -> None:
        self.renderer, self.cameras = renderer, tuple(cameras)

    def crop(self, camera_index: int, window: Roi) -> Image:
        """Render an upright window (size, size, 3) of a camera's present RGB image."""
        return self.view(self.cameras[camera_index], window)

    def view(self, camera: PinholeCamera, window: Roi) -> Image:
        """Render an upright window (size, size, 3) of the RGB image of any camera."""
        if camera.lens is None:
            return self.renderer.view(camera, window)
        maps = _resample(camera, window, self.renderer.size_px)
        if maps is None:
            return np.zeros((self.renderer.size_px, self.renderer.size_px, 3), np.uint8)
        drawn = self.renderer.view(maps.camera, maps.window)
        return np.asarray(cv2.remap(drawn, maps.x, maps.y, cv2.INTER_LINEAR), np.uint8)


def pinhole_keypoints(found: Keypoints, cameras: Sequence[PinholeCamera]) -> Keypoints:
    """Convert keypoints (B, C, ...) from image pixels to pinhole pixels.

    Standard deviations are multiplied by the magnification. Joints that have no position in a
    pinhole image are removed.
    """
    if all(camera.lens is None for camera in cameras):
        return found
    px, confidence = found.px.copy(), found.confidence.copy()
    sigma_px = found.sigma_px.copy()
    for c, camera in enumerate(cameras):
        if camera.lens is not None:
            px[:, c] = pinhole_from_image(camera, found.px[:, c])
            sigma_px[:, c] *= np.nan_to_num(pinhole_magnification(camera, px[:, c]), nan=1.0)
    missing = np.isnan(px).any(-1)
    px[missing], confidence[missing], sigma_px[missing] = np.nan, 0.0, np.inf
    return Keypoints(px, confidence, sigma_px, found.time_s)


@functools.lru_cache(maxsize=MAPS_KEPT)
def _resample(camera: PinholeCamera, window: Roi, size: int) -> _Resampling | None:
    """Return the resampling map of a window, or None if the lens images nothing in it."""
    middles = (np.arange(size) + 0.5) / size
    places = np.stack(np.meshgrid(middles, middles), -1)
    px = to_image(places, window)
    ray = rays(camera, px)
    ray[~inside_image(camera, px)] = np.nan
    if np.isnan(ray).all():
        return None
    R_world_from_view = _axes(ray, window, camera)
    T_world_from_view = camera.T_world_from_cam.copy()
    T_world_from_view[:3, :3] = R_world_from_view
    x, y, z = np.moveaxis(ray @ R_world_from_view, -1, 0)
    ahead = z > 1.0 / np.hypot(1.0, WIDEST)
    u, v = np.where(ahead, x / z, np.nan), np.where(ahead, y / z, np.nan)
    left, right, top, bottom = np.nanmin(u), np.nanmax(u), np.nanmin(v), np.nanmax(v)
    side = float(max(right - left, bottom - top)) * (1 + 2 / size)
    middle = float(left + right) / 2, float(top + bottom) / 2
    view = PinholeCamera(camera.name, np.eye(3), T_world_from_view, 1, 1)
    x, y = (
        _pixels(at + (side / 2 - mid), side, size) for at, mid in ((u, middle[0]), (v, middle[1]))
    )
    return _Resampling(view, Roi(middle, side, 0.0), x, y)


def _axes(ray: Floats, window: Roi, camera: PinholeCamera) -> Floats:
    """Return R_world_from_view: z along the mean of the rays, and y downwards in the window."""
    forward = np.asarray(np.nanmean(ray.reshape(-1, 3), 0), float)
    forward /= np.linalg.norm(forward)
    c, s = np.cos(window.rotation_rad), np.sin(window.rotation_rad)
    down = camera.T_world_from_cam[:3, :2] @ np.array([-s, c])
    right = np.cross(down, forward)
    right /= np.linalg.norm(right)
    return np.asarray(np.stack([right, np.cross(forward, right), forward], -1), float)


def _pixels(place: Floats, side: float, size: int) -> NDArray[np.float32]:
    """Convert positions in [0, side] to pixel coordinates from the first pixel's centre.

    NaN is converted to a position far outside the image.
    """
    return np.nan_to_num(place / side * size - 0.5, nan=-size).astype(np.float32)
