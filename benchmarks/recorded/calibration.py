"""Conversion of a Qualisys calibration (XML) to pinhole cameras with lens distortion.

Frames: the world frame of the file is right-handed with +Z up, in millimetres; it becomes `world`
in metres. The rows of a camera's matrix in the file are its axes (+X right, +Y up, -Z forward). A
half turn about +X converts them to the axes of OpenCV (+X right, +Y down, +Z forward). Image
coordinates in the file are in 64ths of a pixel, measured from the centre of the first pixel; here
they are in pixels, measured from the corner of the image, which adds half a pixel. An image that is
narrower than in the calibration is assumed to be cropped at the right, since shifting or scaling
the image makes the views less consistent.
"""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

from hrc_env.core.typing import Points3
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.lens import Lens
from hrc_env.tracking.config import ParticleConfig

_PER_PX = 64.0
_HALF_TURN_ABOUT_X = np.diag([1.0, -1.0, -1.0])


def read_calibration(path: Path, sizes_px: list[tuple[int, int]]) -> list[PinholeCamera]:
    """Read the cameras of a Qualisys calibration file, for videos of given widths and heights."""
    found = ElementTree.parse(path).getroot().iter("camera")
    return [_camera(camera, size) for camera, size in zip(found, sizes_px, strict=True)]


def find_meeting_point(cameras: list[PinholeCamera]) -> Points3:
    """Return the point (3,) closest to all optical axes, which must not be parallel [m]."""
    normal, rhs = np.zeros((3, 3)), np.zeros(3)
    for camera in cameras:
        along = camera.T_world_from_cam[:3, 2]
        across = np.eye(3) - np.outer(along, along)
        normal += across
        rhs += across @ camera.eye_world
    return np.asarray(np.linalg.solve(normal, rhs), float)


def tracker_config(cameras: list[PinholeCamera]) -> ParticleConfig:
    """Return tracker settings for a rig, with a prior around the point at which its cameras aim.

    This point is the one closest to all optical axes. The standard deviation of the prior is half
    the mean distance of the cameras from the point. The settings have no floor, since the file does
    not contain its height.
    """
    point = find_meeting_point(cameras)
    distances_m = [float(np.linalg.norm(camera.eye_world - point)) for camera in cameras]
    x, y, z = (float(value) for value in point)
    return ParticleConfig(
        prior_mean_world=(x, y, z),
        prior_std_m=float(np.mean(distances_m)) / 2,
        image_area_px=float(np.mean([c.width_px * c.height_px for c in cameras])),
        floor_std_m=float("inf"),
    )


def _camera(node: ElementTree.Element, size_px: tuple[int, int]) -> PinholeCamera:
    place, lens = _numbers(node, "transform"), _numbers(node, "intrinsic")
    rows = np.array([[place[f"r{i}{k}"] for k in (1, 2, 3)] for i in (1, 2, 3)])
    T_world_from_cam = np.eye(4)
    T_world_from_cam[:3, :3] = rows.T @ _HALF_TURN_ABOUT_X
    T_world_from_cam[:3, 3] = [place[axis] / 1000 for axis in "xyz"]
    K = np.array(
        [
            [lens["focalLengthU"] / _PER_PX, 0, lens["centerPointU"] / _PER_PX + 0.5],
            [0, lens["focalLengthV"] / _PER_PX, lens["centerPointV"] / _PER_PX + 0.5],
            [0, 0, 1],
        ]
    )
    names = [f"{kind}Distortion{k}" for kind in ("radial", "tangental") for k in (1, 2)]
    brown = Lens("brown_conrady", tuple(lens[name] for name in names))
    return PinholeCamera(node.attrib["serial"], K, T_world_from_cam, *size_px, brown)


def _numbers(node: ElementTree.Element, tag: str) -> dict[str, float]:
    part = next(node.iter(tag))
    return {name: float(value) for name, value in part.attrib.items()}
