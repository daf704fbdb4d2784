"""Import of rigs from calibration files of anipose, FreeMoCap, Caliscope and Pose2Sim.

These are TOML files with a table for each camera:

[cam_0]
name = "left"
size = [1920, 1080]
matrix = [[905.0, 0.0, 948.0], [0.0, 912.0, 551.0], [0.0, 0.0, 1.0]]
distortions = [-0.21, 0.06, 0.0, 0.0, 0.0]
rotation = [1.2, -1.2, 1.1]
translation = [0.1, 1.4, 3.1]

`rotation` (a Rodrigues vector or a matrix) and `translation` transform points from the world to the
camera frame. `fisheye = true` selects OpenCV's fisheye model. Because these tools measure pixel
coordinates from the centre of the first pixel, and this package measures them from the image's
corner, half a pixel is added to the principal point.
"""

import math
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats
from hrc_env.geometry.camera_config import CameraConfig, axes_of, intrinsics, make_lens
from hrc_env.geometry.rotations import from_rotation_vector

ENTRIES = ("size", "matrix", "distortions", "rotation", "translation")
"""Names of the entries that the table of a camera must contain."""
HALF_PX = 0.5
"""Distance along each axis from the centre of the first pixel to the image's corner [px]."""
MAX_SPREAD_M = 30.0
"""Maximum plausible distance of cameras from their centroid, or of a single camera from the origin
[m]. Files with greater lengths are assumed to be in millimetres."""
MM = 1e-3
"""One millimetre in metres."""
MIN_UPRIGHT = 0.7
"""Minimum component of the images' mean upright direction along a world axis for that axis to be
regarded as the upward one."""


def is_calibration(content: Mapping[str, Any]) -> bool:
    """Return whether the content of a TOML file is a calibration written by another tool."""
    return any("matrix" in table for table in _tables(content).values())


def parse_calibration(content: Mapping[str, Any], path: Path | str) -> tuple[CameraConfig, ...]:
    """Return the cameras of a calibration that another tool has written.

    Lengths in millimetres are converted to metres. A `UserWarning` is issued for such a conversion,
    and if the z axis of the world frame does not point upwards.

    Args:
        content: content of the file.
        path: path of the file, for error messages.

    Raises:
        ConfigError: a camera has no extrinsics, lacks another entry, or has an unknown lens.
    """
    cameras: list[CameraConfig] = []
    for key, table in _tables(content).items():
        if any(word in table for word in ENTRIES[1:]) and not table.get("ignore", False):
            try:
                cameras.append(_parse_camera(str(table.get("name", key)), table))
            except ConfigError as error:
                raise ConfigError(f"{path}, table {key!r}: {error}") from error
    if not cameras:
        raise ConfigError(f"{path} contains no cameras except ignored ones.")
    return _convert_to_metres(cameras, path)


def _tables(content: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Return the tables of a file that may describe cameras, by key; Caliscope's are nested."""
    nested = content.get("cameras")
    inside = cast("Mapping[str, Any]", nested) if isinstance(nested, Mapping) else content
    return {key: each for key, each in inside.items() if isinstance(each, Mapping)}


def _parse_camera(name: str, table: Mapping[str, Any]) -> CameraConfig:
    """Return the camera that a table describes, with lengths in the file's unit."""
    missing = [word for word in ENTRIES if word not in table or table[word] in ("null", [], None)]
    if missing:
        has_no_pose = {"rotation", "translation"} & {*missing}
        hint = " It has no pose in the world yet: calibrate its extrinsics." if has_no_pose else ""
        raise ConfigError(f"it must have {', '.join(ENTRIES)}; missing {', '.join(missing)}.{hint}")
    size = _parse_numbers(table, "size", (2,))
    matrix = _parse_numbers(table, "matrix", (3, 3))
    translation = _parse_numbers(table, "translation", (3,))
    rotation = np.ravel(np.asarray(table["rotation"], object))
    R_cam_from_world = (
        _parse_numbers(table, "rotation", (3, 3))
        if len(rotation) == 9
        else from_rotation_vector(_parse_numbers(table, "rotation", (3,)))
    )
    K = matrix + np.array([[0.0, 0.0, HALF_PX], [0.0, 0.0, HALF_PX], [0.0, 0.0, 0.0]])
    T_world_from_cam = np.eye(4)
    T_world_from_cam[:3, :3] = R_cam_from_world.T
    T_world_from_cam[:3, 3] = -R_cam_from_world.T @ translation
    distortion = _parse_numbers(table, "distortions", (-1,))
    lens = make_lens(distortion, fisheye=bool(table.get("fisheye", False)))
    width, height = (round(float(each)) for each in size)
    return CameraConfig.from_matrices(name, K, T_world_from_cam, (width, height), lens)


def _parse_numbers(table: Mapping[str, Any], word: str, shape: tuple[int, ...]) -> Floats:
    """Return an entry of a table as an array of finite numbers; -1 in `shape` is any length."""
    try:
        values = np.asarray(table[word], float)
        values = values.reshape(-1 if shape == (-1,) else shape)
    except (TypeError, ValueError):
        values = np.full(1, np.nan)
    if not np.isfinite(values).all():
        many = "numbers" if shape == (-1,) else f"{' x '.join(map(str, shape))} numbers"
        raise ConfigError(f"{word} must be {many}, got {table[word]!r}.")
    return values


def _convert_to_metres(cameras: list[CameraConfig], path: Path | str) -> tuple[CameraConfig, ...]:
    """Return the cameras with lengths in metres; warn of another unit or upward axis."""
    eyes = np.array([camera.eye_world for camera in cameras])
    centred = eyes - eyes.mean(0) if len(eyes) > 1 else eyes
    unit_m = MM if np.linalg.norm(centred, axis=-1).max() > MAX_SPREAD_M else 1.0
    remarks: list[str] = []
    if unit_m != 1.0:
        far_m = unit_m * max(math.dist(a, b) for a in eyes for b in eyes)
        remarks.append(
            f"lengths were interpreted as millimetres; the cameras are up to {far_m:.2f} m from "
            "each other. Rescale the translations if this is wrong"
        )
    upright = -np.mean([axes_of(camera)[:, 1] for camera in cameras], axis=0)
    axis = int(np.argmax(np.abs(upright)))
    if abs(upright[axis]) > MIN_UPRIGHT and (axis != 2 or upright[2] < 0.0):
        name = ("+" if upright[axis] > 0.0 else "-") + "xyz"[axis]
        remarks.append(
            f"the {name} axis of its world seems to point up, as the images are upright along it; "
            "hrc_env expects +z to point up and the robot at the origin. Rotate the world frame of "
            "the calibration"
        )
    if remarks:
        warnings.warn(f"{path}: {'; '.join(remarks)}.", UserWarning, stacklevel=2)
    return tuple(_rescale(camera, unit_m) for camera in cameras)


def _rescale(camera: CameraConfig, unit_m: float) -> CameraConfig:
    """Convert the position of a camera from a unit to metres."""
    if unit_m == 1.0:
        return camera
    T_world_from_cam = np.eye(4)
    T_world_from_cam[:3, :3] = axes_of(camera)
    T_world_from_cam[:3, 3] = unit_m * np.array(camera.eye_world)
    size = camera.width_px, camera.height_px
    return CameraConfig.from_matrices(
        camera.name, intrinsics(camera), T_world_from_cam, size, camera.lens
    )
