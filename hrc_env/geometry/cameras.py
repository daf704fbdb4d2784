"""Cameras: projection of points to pixels, and of pixels to rays.

A camera with a lens has two kinds of pixel coordinates: `pinhole` pixels, which result from a
linear projection and are used by trackers, and `image` pixels of the distorted image, which are
used by detectors. Without a lens, both are equal.

Pixel coordinates are continuous and measured from the image's top-left corner, so that pixel
centres have half-integer coordinates. Camera axes are OpenCV's: +X right, +Y down, +Z forward.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hrc_env.core.typing import Bools, Floats, Points2, Points3, Transforms
from hrc_env.geometry.lens import Lens, distort, magnification, rays_cam, undistort
from hrc_env.geometry.rotations import look_at


@dataclass(frozen=True, slots=True, eq=False)
class PinholeCamera:
    """A camera with a known pose: a pinhole camera, optionally with a distorting lens."""

    name: str
    """Name of the camera, unique in its rig."""
    K: Floats
    """(3, 3) intrinsics [px]."""
    T_world_from_cam: Transforms
    """(4, 4) pose of OpenCV's camera axes in the world [m]."""
    width_px: int
    """Width of the image [px]."""
    height_px: int
    """Height of the image [px]."""
    lens: Lens | None = None
    """Lens that distorts the image; None for a pinhole camera."""

    @property
    def eye_world(self) -> Points3:
        """Optical centre (3,) [m]."""
        return self.T_world_from_cam[:3, 3]

    @property
    def P(self) -> Floats:
        """Projection matrix (3, 4): homogeneous pinhole pixels are P @ (x, y, z, 1)."""
        R_cam_from_world = self.T_world_from_cam[:3, :3].T
        return self.K @ np.hstack([R_cam_from_world, -R_cam_from_world @ self.eye_world[:, None]])


class Projection(NamedTuple):
    """Points projected into the images of cameras."""

    px: Points2
    """(B, C, ..., 2) pinhole pixels, which are meaningless if the depth is not positive."""
    depth_m: Floats
    """(B, C, ...) distance along the camera's axis [m]; negative behind the camera."""


def pinhole(
    name: str,
    eye_world: Points3,
    target_world: Points3,
    hfov_deg: float,
    width_px: int,
    height_px: int,
) -> PinholeCamera:
    """Return a pinhole camera with square pixels.

    Args:
        name: name of the camera.
        eye_world: (3,) position of the camera [m].
        target_world: (3,) point in the centre of the image [m].
        hfov_deg: horizontal field of view [degrees].
        width_px: width of the image [px].
        height_px: height of the image [px].
    """
    focal_px = width_px / 2 / np.tan(np.radians(hfov_deg) / 2)
    K = np.array([[focal_px, 0, width_px / 2], [0, focal_px, height_px / 2], [0, 0, 1.0]])
    T_world_from_cam = np.eye(4)
    T_world_from_cam[:3, :3] = look_at(eye_world, target_world)
    T_world_from_cam[:3, 3] = eye_world
    return PinholeCamera(name, K, T_world_from_cam, width_px, height_px)


def resize(camera: PinholeCamera, width_px: int, height_px: int) -> PinholeCamera:
    """Return a camera with an image of another size.

    The image is scaled to the new width, and cropped or extended around its centre to the height.
    """
    K = camera.K * width_px / camera.width_px
    K[1, 2] += (height_px - camera.height_px * width_px / camera.width_px) / 2
    K[2, 2] = 1.0
    return replace(camera, K=K, width_px=width_px, height_px=height_px)


def projections(cameras: tuple[PinholeCamera, ...]) -> Floats:
    """Return the projection matrices (C, 3, 4) of a rig."""
    return np.stack([camera.P for camera in cameras])


def project(P: Floats, points_world: Points3) -> Projection:
    """Project points into every camera (Algorithm 1, line 11).

    Args:
        P: (C, 3, 4) projection matrices.
        points_world: (B, ..., 3) points [m].
    """
    rotated = np.einsum("cij,b...j->bc...i", P[:, :, :3], points_world)
    shape = (1, len(P)) + (1,) * (points_world.ndim - 2) + (3,)
    homogeneous = rotated + P[:, :, 3].reshape(shape)
    depth_m = homogeneous[..., 2]
    safe = np.where(np.abs(depth_m) < 1e-9, 1e-9, depth_m)
    return Projection(homogeneous[..., :2] / safe[..., None], depth_m)


def rays(camera: PinholeCamera, pixels: Points2) -> Points3:
    """Return the viewing directions of image pixels (..., 2) as unit vectors (..., 3) in the world.

    They are NaN for pixels outside the image circle of the lens.
    """
    if camera.lens is None:
        homogeneous = np.concatenate([pixels, np.ones((*pixels.shape[:-1], 1))], -1)
        direction_cam = homogeneous @ np.linalg.inv(camera.K).T
    else:
        direction_cam = rays_cam(camera.lens, _normalise(camera, pixels))
    direction = direction_cam @ camera.T_world_from_cam[:3, :3].T
    return direction / np.linalg.norm(direction, axis=-1, keepdims=True)


def image_from_pinhole(camera: PinholeCamera, pixels: Points2) -> Points2:
    """Convert pinhole pixels (..., 2) to image pixels."""
    if camera.lens is None:
        return pixels
    return _denormalise(camera, distort(camera.lens, _normalise(camera, pixels)))


def pinhole_from_image(camera: PinholeCamera, pixels: Points2) -> Points2:
    """Convert image pixels (..., 2) to pinhole pixels; the result is NaN if there are none."""
    if camera.lens is None:
        return pixels
    return _denormalise(camera, undistort(camera.lens, _normalise(camera, pixels)))


def pinhole_magnification(camera: PinholeCamera, pinhole_px: Points2) -> Floats | float:
    """Return the ratio of a length in pinhole pixels to that in image pixels at points (..., 2)."""
    if camera.lens is None:
        return 1.0
    return magnification(camera.lens, _normalise(camera, pinhole_px))


def _normalise(camera: PinholeCamera, pixels: Points2) -> Floats:
    """Convert pixels (..., 2) to offsets from the principal point in focal lengths."""
    return (pixels - camera.K[:2, 2]) / camera.K[[0, 1], [0, 1]]


def _denormalise(camera: PinholeCamera, normalised: Floats) -> Points2:
    """Convert offsets (..., 2) from the principal point in focal lengths to pixels."""
    return normalised * camera.K[[0, 1], [0, 1]] + camera.K[:2, 2]


def inside_image(camera: PinholeCamera, pixels: Points2) -> Bools:
    """Return a mask (...) of the pixels (..., 2) that lie in the image of a camera."""
    u, v = pixels[..., 0], pixels[..., 1]
    return (u >= 0) & (u < camera.width_px) & (v >= 0) & (v < camera.height_px)
