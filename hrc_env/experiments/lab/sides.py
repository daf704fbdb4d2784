"""Which joints a camera missed, and which of them are on the side turned away from it."""

import numpy as np

from hrc_env.core.records import Keypoints
from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.geometry.cameras import PinholeCamera, project

MISSED_CONFIDENCE = 0.5
"""The network always returns its points: below this visibility a joint counts as missed (ours)."""
MISSED_SHARE = 0.05
"""So does one that is off by more than this share of the stature, in the image or in the room."""
TURNED_M = 0.08
"""A side is turned away when its shoulder and hip are on average so much further from the camera
than the other's; judgement: a body is 0.36 m wide at the shoulders."""

LEFT: Bools = np.array([name.startswith("left_") for name in JOINTS])
RIGHT: Bools = np.array([name.startswith("right_") for name in JOINTS])
_TRUNK = [name.endswith(("shoulder", "hip")) for name in JOINTS]


def missed_by_camera(
    found: Keypoints, c: int, camera: PinholeCamera, joints_world: Points3, stature_m: float
) -> Bools:
    """(J,) what camera c missed in a frame.

    Args:
        found: (1, C, 1, J, ...) in pinhole pixels.
        c: which camera.
        camera: that one.
        joints_world: (J, 3) truth [m].
        stature_m: the worker's.
    """
    px, depth_m = (each[0, 0] for each in project(camera.P[None], joints_world[None]))
    stature_px = camera.K[0, 0] * stature_m / depth_m
    off = np.linalg.norm(found.px[0, c, 0] - px, axis=-1) / stature_px
    return ~(off <= MISSED_SHARE) | (found.confidence[0, c, 0] < MISSED_CONFIDENCE)


def turned_away(joints_world: Points3, eye_world: Floats) -> Bools:
    """(J,) the joints of the side that is turned away from an eye (3,); none if none is."""
    away_m = np.linalg.norm(joints_world - eye_world, axis=-1)
    left_m, right_m = away_m[LEFT & _TRUNK].mean(), away_m[RIGHT & _TRUNK].mean()
    if left_m - right_m > TURNED_M:
        return LEFT
    if right_m - left_m > TURNED_M:
        return RIGHT
    return np.zeros_like(LEFT)
