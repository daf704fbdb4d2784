"""Cameras: points to pixels and pixels to rays.

A camera with a lens has two kinds of pixels: `pinhole` ones, in which projection is linear and the
trackers think, and those of the `image`, which detectors find. Without a lens they are the same.
Pixels are continuous from the image's top-left corner: pixel centres lie at half-integers. Camera
axes are OpenCV's: +X right, +Y down, +Z forward.
"""

from dataclasses import dataclass, replace

import numpy as np

from hrc_env.core.typing import Floats, Points2, Points3, Transforms
from hrc_env.geometry.lens import Lens, distort, magnification, rays_cam, undistort
from hrc_env.geometry.rotations import look_at


@dataclass(frozen=True, slots=True, eq=False)
class PinholeCamera:
    """A camera at a known place; a pinhole unless it has a lens."""

    name: str
    K: Floats  # (3, 3) intrinsics [px]
    T_world_from_cam: Transforms  # (4, 4)
    width_px: int  # of its image
    height_px: int
    lens: Lens | None = None  # what distorts its image

    @property
    def eye_world(self) -> Points3:
        """(3,) the optical centre [m]."""
        return self.T_world_from_cam[:3, 3]

    @property
    def P(self) -> Floats:
        """(3, 4) projection: homogeneous pinhole pixels = P @ (x, y, z, 1)."""
        R_cam_from_world = self.T_world_from_cam[:3, :3].T
        return self.K @ np.hstack([R_cam_from_world, -R_cam_from_world @ self.eye_world[:, None]])


def pinhole(
    name: str,
    eye_world: Points3,
    target_world: Points3,
    hfov_deg: float,
    width_px: int,
    height_px: int,
) -> PinholeCamera:
    """A camera with square pixels at `eye_world` that looks at `target_world`."""
    focal_px = width_px / 2 / np.tan(np.radians(hfov_deg) / 2)
    K = np.array([[focal_px, 0, width_px / 2], [0, focal_px, height_px / 2], [0, 0, 1.0]])
    T_world_from_cam = np.eye(4)
    T_world_from_cam[:3, :3] = look_at(eye_world, target_world)
    T_world_from_cam[:3, 3] = eye_world
    return PinholeCamera(name, K, T_world_from_cam, width_px, height_px)


def resized(camera: PinholeCamera, width_px: int, height_px: int) -> PinholeCamera:
    """The camera with an image so wide; of its height as much as fits, round the middle."""
    K = camera.K * width_px / camera.width_px
    K[1, 2] += (height_px - camera.height_px * width_px / camera.width_px) / 2
    K[2, 2] = 1.0
    return replace(camera, K=K, width_px=width_px, height_px=height_px)


def projections(cameras: tuple[PinholeCamera, ...]) -> Floats:
    """(C, 3, 4) projection matrices of a rig."""
    return np.stack([camera.P for camera in cameras])


def project(P: Floats, points_world: Points3) -> tuple[Points2, Floats]:
    """Points (B, ..., 3) [m] into every camera (C, 3, 4) (Algorithm 1, line 11): pinhole pixels
    (B, C, ..., 2), without meaning where depth <= 0, and depths along the axes (B, C, ...) [m]."""
    rotated = np.einsum("cij,b...j->bc...i", P[:, :, :3], points_world)
    shape = (1, len(P)) + (1,) * (points_world.ndim - 2) + (3,)
    homogeneous = rotated + P[:, :, 3].reshape(shape)
    depth_m = homogeneous[..., 2]
    safe = np.where(np.abs(depth_m) < 1e-9, 1e-9, depth_m)
    return homogeneous[..., :2] / safe[..., None], depth_m


def rays(camera: PinholeCamera, pixels: Points2) -> Points3:
    """Unit directions in the world, (..., 3), of image pixels (..., 2); NaN where none is seen."""
    if camera.lens is None:
        homogeneous = np.concatenate([pixels, np.ones((*pixels.shape[:-1], 1))], -1)
        direction_cam = homogeneous @ np.linalg.inv(camera.K).T
    else:
        direction_cam = rays_cam(camera.lens, _normalised(camera, pixels))
    direction = direction_cam @ camera.T_world_from_cam[:3, :3].T
    return direction / np.linalg.norm(direction, axis=-1, keepdims=True)


def image_from_pinhole(camera: PinholeCamera, pixels: Points2) -> Points2:
    """Where the image shows what a pinhole would show at pixels (..., 2)."""
    if camera.lens is None:
        return pixels
    return _in_pixels(camera, distort(camera.lens, _normalised(camera, pixels)))


def pinhole_from_image(camera: PinholeCamera, pixels: Points2) -> Points2:
    """Where a pinhole would show what the image shows at pixels (..., 2); NaN where nowhere."""
    if camera.lens is None:
        return pixels
    return _in_pixels(camera, undistort(camera.lens, _normalised(camera, pixels)))


def pinhole_magnification(camera: PinholeCamera, pinhole_px: Points2) -> Floats | float:
    """How many times longer a pinhole shows things at pinhole pixels (..., 2) than the image."""
    if camera.lens is None:
        return 1.0
    return magnification(camera.lens, _normalised(camera, pinhole_px))


def _normalised(camera: PinholeCamera, pixels: Points2) -> Floats:
    return (pixels - camera.K[:2, 2]) / camera.K[[0, 1], [0, 1]]


def _in_pixels(camera: PinholeCamera, normalised: Floats) -> Points2:
    return normalised * camera.K[[0, 1], [0, 1]] + camera.K[:2, 2]


def inside_image(camera: PinholeCamera, pixels: Points2) -> np.ndarray:
    """(...,) whether pixels (..., 2) of the image lie in it."""
    u, v = pixels[..., 0], pixels[..., 1]
    return (u >= 0) & (u < camera.width_px) & (v >= 0) & (v < camera.height_px)
