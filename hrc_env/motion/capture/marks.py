"""The 15 joints of a body in any pose of the control vector."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Floats, Ints, Points3
from hrc_env.motion.anatomy import Anatomy, anatomy
from hrc_env.motion.kinematics import N_FRAMES, N_POINTS, pose
from hrc_env.worker.body import SEGMENT, Body

STARTS = {
    "shoulder": "upper_arm", "elbow": "forearm", "wrist": "hand",
    "hip": "thigh", "knee": "shank", "ankle": "foot",
}  # fmt: skip
"""Segment that begins at a joint's centre."""


@dataclass(frozen=True, slots=True)
class Marks:
    """Where a body carries the 15 joints."""

    anatomy: Anatomy
    segment: Ints
    """(15,) segment that carries each."""
    offset: Floats
    """(15, 3) in that segment's frame [m]."""
    rest: Points3
    """(15, 3) at rest [m]."""


def marks_of(body: Body, landmarks: bool) -> Marks:
    """A body's joints as BlazePose means them (landmarks) or where its bones turn (centres).

    Noses and foot tips, which are no centres, are BlazePose's in both senses.
    """
    segment, offset = body.joint_segment.copy(), body.joint_offset.copy()
    if not landmarks:
        for j, joint in enumerate(JOINTS):
            side, _, part = joint.partition("_")
            if part in STARTS:
                segment[j], offset[j] = SEGMENT[f"{side}_{STARTS[part]}"], 0.0
    rest = body.rest_position[segment] + offset
    return Marks(anatomy(body), segment, offset, rest)


def joints_in(q: Floats, marks: Marks) -> Points3:
    """(N, 15, 3) joints of poses (N, N_CONTROLS)."""
    out = np.empty((len(q), len(marks.segment), 3))
    bones = marks.anatomy
    _joints(
        np.ascontiguousarray(q), bones.offset, bones.frame, bones.size,
        marks.segment, marks.offset, out,
    )  # fmt: skip
    return out


@kernel(makes_arrays=True)
def _joints(
    q: Floats, bones: Floats, frame: Floats, size: Floats, segment: Ints, offset: Floats,
    out: Floats,
) -> None:  # fmt: skip
    """Joints of one pose after the other."""
    p, r = np.zeros((N_POINTS, 3)), np.zeros((N_FRAMES, 3, 3))
    for n in range(q.shape[0]):
        pose(q[n], bones, frame, size, p, r)
        for j in range(segment.shape[0]):
            s = segment[j]
            for i in range(3):
                out[n, j, i] = p[s, i]
                for k in range(3):
                    out[n, j, i] += r[s, i, k] * offset[j, k]
