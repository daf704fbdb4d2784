"""Which postures are hard to see: bodies that are folded up.

Bent forward, squatting or kneeling, a worker's joints hide each other. Of 70 moments of work on
and near the lab's floor those that are folded gave, triangulated from four views, a median error
of 68 mm with the network `full` and 52 mm with `heavy`; the others 19 and 17 mm.
"""

import math

import numpy as np

from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Points3

LEAN_RAD = math.radians(30.0)
"""A torso that leans further is bent: from there on the error of `full` in the image is half as
large again as of upright bodies, and one camera in ten misses the worker; nobody walks so."""
LOW_HIPS = 0.75
"""Hips that are less than this share of the leg's length above the lower ankle squat or kneel; in
a walk they stay above .9 (judgement, between that and a seat's .6)."""

_LEFT_RIGHT = ("left", "right")
_HIPS, _KNEES, _ANKLES, _SHOULDERS = (
    [JOINT[f"{side}_{name}"] for side in _LEFT_RIGHT]
    for name in ("hip", "knee", "ankle", "shoulder")
)


def is_folded(joints_world: Points3) -> bool:
    """Whether a body (J, 3) is bent, squatting or kneeling; z is up, NaN is not folded."""
    hips = joints_world[_HIPS].mean(0)
    torso = joints_world[_SHOULDERS].mean(0) - hips
    leg_m = _length(joints_world, _HIPS, _KNEES) + _length(joints_world, _KNEES, _ANKLES)
    rise_m = hips[2] - joints_world[_ANKLES, 2].min()
    lean_rad = math.atan2(math.hypot(torso[0], torso[1]), torso[2])
    return bool(lean_rad > LEAN_RAD or rise_m < LOW_HIPS * leg_m)


def _length(joints_world: Points3, start: list[int], end: list[int]) -> float:
    """Mean length of two limbs [m]."""
    return float(np.linalg.norm(joints_world[end] - joints_world[start], axis=-1).mean())
