"""The two camera rigs of the tracking benchmark, each around the world's origin."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import make_unknown_name_error
from hrc_env.core.typing import Floats
from hrc_env.geometry.cameras import PinholeCamera, projections
from hrc_env.geometry.rotations import look_at
from hrc_env.tracking.config import ParticleConfig

DT_S = 0.04
"""Time between frames [s]."""
SIGMA_PX = 3.0
"""Standard deviation of the detections [px], which the estimators know."""
WIDTH_PX, HEIGHT_PX = 1920, 1080
_CORNERS = ((1, 1), (-1, 1), (-1, -1), (1, -1))


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """Four cameras, the area in which people walk, and settings of the estimators."""

    name: str
    P: Floats
    """Projection matrices of the cameras (4, 3, 4)."""
    walk_m: tuple[float, float]
    """Half the length and width of the area in which people walk [m]."""
    tracker: ParticleConfig
    """Settings of the estimators, including the prior position of a worker."""


def make_rig(name: str) -> Rig:
    """Return the rig "lab" or "site".

    "lab" is a room of 6.09 x 5.48 m; its cameras are 10 cm from the corners at a height of 2.4 m
    and have a field of view of 118.2 x 69.5 degrees. "site" is an area of 20 x 20 m; its cameras
    are above the corners at a height of 5 m and have a field of view of 90 degrees.

    Raises:
        ConfigError: the name is unknown.
    """
    if name == "lab":
        focal_px = (
            WIDTH_PX / 2 / np.tan(np.radians(118.2) / 2),
            HEIGHT_PX / 2 / np.tan(np.radians(69.5) / 2),
        )
        return _rig("lab", (2.945, 2.64, 2.4), 0.9, focal_px, (1.745, 1.44), 1.5)
    if name == "site":
        return _rig("site", (10.0, 10.0, 5.0), 1.0, (960.0, 960.0), (6.0, 6.0), 4.0)
    raise make_unknown_name_error("rig", name, RIGS)


RIGS = ("lab", "site")


def _rig(
    name: str,
    corner_m: tuple[float, float, float],
    target_height_m: float,
    focal_px: tuple[float, float],
    walk_m: tuple[float, float],
    prior_std_m: float,
) -> Rig:
    fx, fy = focal_px
    K = np.array([[fx, 0, WIDTH_PX / 2], [0, fy, HEIGHT_PX / 2], [0, 0, 1.0]])
    cameras = []
    for k, (x, y) in enumerate(_CORNERS):
        eye = np.array([x * corner_m[0], y * corner_m[1], corner_m[2]])
        pose = np.eye(4)
        pose[:3, :3] = look_at(eye, np.array([0.0, 0.0, target_height_m]))
        pose[:3, 3] = eye
        cameras.append(PinholeCamera(f"camera_{k + 1}", K, pose, WIDTH_PX, HEIGHT_PX))
    tracker = ParticleConfig(
        prior_mean_world=(0.0, 0.0, 1.0),
        prior_std_m=prior_std_m,
        image_area_px=float(WIDTH_PX * HEIGHT_PX),
        noise_share=0.0,
    )
    return Rig(name, projections(tuple(cameras)), walk_m, tracker)
