"""Pinhole cameras and MuJoCo cameras of a rig, which are made from its settings.

Only this module converts between OpenCV's camera axes (+X right, +Y down, +Z forward) and OpenGL's
(+X right, +Y up, -Z forward).
"""

from collections.abc import Iterable, Sequence

import mujoco
import numpy as np

from hrc_env.core.errors import ConfigError, check_integer, make_unknown_name_error
from hrc_env.core.typing import Floats, Rotations
from hrc_env.geometry.camera_config import MOST_CAMERAS, CameraConfig, axes_of, intrinsics
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.scene.places import SCENES

OPENCV_FROM_OPENGL: Floats = np.diag([1.0, -1.0, -1.0])
"""Rotation from OpenGL's to OpenCV's camera axes, which is its own inverse."""
LAB_CAMERAS = SCENES["lab"].cameras
"""Four cameras below the ceiling, one in each corner, as in the laboratory of the paper."""
SITE_CAMERAS = SCENES["site"].cameras
"""Four cameras on masts in the corners of the site."""


def select(
    cameras: tuple[CameraConfig, ...], use: Sequence[int | str] | None = None
) -> tuple[CameraConfig, ...]:
    """Return the selected cameras of a scene.

    Args:
        cameras: all cameras of a scene.
        use: names or indices from 0, in the order of the result; None for all.

    Raises:
        ConfigError: a name is unknown, an index is out of range, a camera is selected twice, or no
            camera is selected.
    """
    names = [camera.name for camera in cameras]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"Camera names must be unique, got {name!r} more than once.")
    if isinstance(use, str) or not (use is None or isinstance(use, Iterable)):
        raise ConfigError(
            f"cameras must be a list of names or indices, got {use!r}; "
            f"valid names: {', '.join(names)}."
        )
    indices = [_index(choice, names) for choice in (range(len(names)) if use is None else use)]
    if not indices:
        raise ConfigError(
            f"A rig needs at least one camera, got none. Valid names: {', '.join(names)}. Without "
            'any perception, use perception="none".'
        )
    if len(indices) > MOST_CAMERAS:
        raise ConfigError(f"A rig has 1 to {MOST_CAMERAS} cameras, got {len(indices)}.")
    for index in indices:
        if indices.count(index) > 1:
            raise ConfigError(
                f"Camera {names[index]!r} is chosen more than once: name it only once."
            )
    return tuple(cameras[index] for index in indices)


def _index(choice: int | str, names: list[str]) -> int:
    """Return the index of a camera, given by index or name, or raise `ConfigError`."""
    if not isinstance(choice, str):
        return check_integer(f"Camera index (of {', '.join(names)})", choice, 0, len(names) - 1)
    if choice not in names:
        raise make_unknown_name_error("camera", choice, names)
    return names.index(choice)


def make_cameras(cameras: Iterable[CameraConfig]) -> tuple[PinholeCamera, ...]:
    """Return the pinhole cameras of a rig, with the matrices that trackers and renderers need.

    Each camera has `K` (3, 3) [px], `T_world_from_cam` (4, 4), `P` (3, 4), which projects world
    points [m] to pinhole pixels, and the lens, which maps pinhole pixels to those of its image.
    """
    return tuple(map(_make_camera, cameras))


def _make_camera(camera: CameraConfig) -> PinholeCamera:
    """Return a camera; its lens is None if its image is that of an ideal pinhole camera."""
    K, T_world_from_cam = intrinsics(camera), np.eye(4)
    T_world_from_cam[:3, :3], T_world_from_cam[:3, 3] = axes_of(camera), camera.eye_world
    plain = camera.lens.model == "none" and K[0, 0] == K[1, 1]
    size = camera.width_px, camera.height_px
    return PinholeCamera(camera.name, K, T_world_from_cam, *size, None if plain else camera.lens)


def glcam_axes(camera: PinholeCamera) -> Rotations:
    """Return R_world_from_glcam, with a pinhole camera's axes right, up and back as columns."""
    return camera.T_world_from_cam[:3, :3] @ OPENCV_FROM_OPENGL


def add_cameras(spec: mujoco.MjSpec, cameras: tuple[PinholeCamera, ...]) -> None:
    """Add cameras by name to a scene that is being built."""
    quaternion = np.zeros(4)
    for camera in cameras:
        mujoco.mju_mat2Quat(quaternion, glcam_axes(camera).ravel())
        spec.worldbody.add_camera(
            name=camera.name,
            pos=camera.eye_world,
            quat=quaternion,
            fovy=np.degrees(2 * np.arctan(camera.height_px / 2 / camera.K[1, 1])),
            resolution=[camera.width_px, camera.height_px],
        )
