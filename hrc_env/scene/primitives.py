"""Groups and collision bits of geoms, and capsules.

Groups: 0 solid (drawn, collides, hides), 1 decoration (drawn only), 2 the robot's looks, 3 the
robot's capsules (not drawn, hide), 4 the workers' (not drawn, do not hide), 5 ceiling and lamps.
"""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

SOLID, DECORATION, ROBOT_LOOKS, ROBOT_CAPSULES, WORKER_CAPSULES, OVERHEAD = range(6)

SCENE_BIT, ROBOT_BIT, WORKER_BIT, PAD_BIT, OBJECT_BIT = 1, 2, 4, 8, 16
"""contype bits; what can touch what is written in the conaffinity of the second."""

Vector = Sequence[float] | np.ndarray

LOOKS_ONLY = {"contype": 0, "conaffinity": 0, "density": 0, "group": DECORATION}


def rod_pose(start: Vector, end: Vector) -> tuple[np.ndarray, np.ndarray, float]:
    """Centre, quaternion (z along the rod) and half length of a rod between two points."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    length, quaternion = float(np.linalg.norm(end - start)), np.zeros(4)
    mujoco.mju_quatZ2Vec(quaternion, (end - start) / max(length, 1e-9))
    return (start + end) / 2, quaternion, length / 2


def capsule(body: Any, start: Vector, end: Vector, radius: float, **more: Any):
    """A capsule whose axis runs between two points."""
    pos, quat, half = rod_pose(start, end)
    kind, size = mujoco.mjtGeom.mjGEOM_CAPSULE, [radius, half, 0]
    return body.add_geom(type=kind, size=size, pos=pos, quat=quat, **more)
