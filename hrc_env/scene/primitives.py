"""Groups and collision bits of geoms, and functions for capsules.

The groups are 0 solid (rendered, collides, occludes), 1 decoration (only rendered), 2 the robot's
visual geoms, 3 the robot's capsules (not rendered, occlude), 4 the workers' capsules (neither
rendered nor occluding), and 5 ceiling and lamps.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from hrc_env.core.typing import Floats, Points3, QuaternionsWxyz

SOLID, DECORATION, ROBOT_LOOKS, ROBOT_CAPSULES, WORKER_CAPSULES, OVERHEAD = range(6)
"""Group numbers of geoms."""
SCENE_BIT, ROBOT_BIT, WORKER_BIT, PAD_BIT, OBJECT_BIT = 1, 2, 4, 8, 16
"""Bits of `contype`; a geom collides with another one if its `conaffinity` contains the other's
bit."""
Vector = Sequence[float] | Floats
"""Type of a vector (3,)."""
LOOKS_ONLY = {"contype": 0, "conaffinity": 0, "density": 0, "group": DECORATION}
"""Fields of a geom that is rendered but never collides."""


class RodPose(NamedTuple):
    """Pose of a rod between two points."""

    centre: Points3
    """(3,) midpoint between the two points [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """(4,) rotation of the rod, with its axis along z."""
    half_length: float
    """Half of the distance between the two points [m]."""


def rod_pose(start: Vector, end: Vector) -> RodPose:
    """Return the pose of a rod between two points (3,) [m]."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    length, quaternion = float(np.linalg.norm(end - start)), np.zeros(4)
    mujoco.mju_quatZ2Vec(quaternion, (end - start) / max(length, 1e-9))
    return RodPose((start + end) / 2, quaternion, length / 2)


def add_capsule(
    body: mujoco.MjsBody, start: Vector, end: Vector, radius: float, **fields: Any
) -> mujoco.MjsGeom:
    """Add a capsule to a body of an MJCF specification, and return its geom.

    Args:
        body: the body.
        start: (3,) first end of the capsule's axis, in the body's frame [m].
        end: (3,) second end of the capsule's axis, in the body's frame [m].
        radius: radius of the capsule [m].
        fields: further fields of the geom.
    """
    pose, kind = rod_pose(start, end), mujoco.mjtGeom.mjGEOM_CAPSULE
    size = [radius, pose.half_length, 0]
    return body.add_geom(type=kind, size=size, pos=pose.centre, quat=pose.quaternion_wxyz, **fields)
