"""Cameras that look at somebody."""

import numpy as np

from hrc_env.core.typing import Points3
from hrc_env.geometry.cameras import PinholeCamera, pinhole

EYE_M = 1.45
"""How high above the floor the cameras are [m]."""


def camera_at(
    target_world: Points3, turn_rad: float, away_m: float, hfov_deg: float, size_px: tuple[int, int]
) -> PinholeCamera:
    """A camera that looks at a point.

    Args:
        target_world: (3,) the point [m].
        turn_rad: direction from the point to the camera, from world +x.
        away_m: level distance between them.
        hfov_deg: horizontal field of view.
        size_px: width and height of its image.
    """
    x, y, _ = target_world
    eye = np.array([x + away_m * np.cos(turn_rad), y + away_m * np.sin(turn_rad), EYE_M])
    return pinhole("follower", eye, np.asarray(target_world, float), hfov_deg, *size_px)
