"""Joints and segments of a body in any pose of the control vector."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Floats, Ints, Points3, QuaternionsWxyz, Rotations
from hrc_env.motion.anatomy import Anatomy, measure_body
from hrc_env.motion.kinematics import pose, write_quaternion
from hrc_env.motion.state import WORKER, Worker
from hrc_env.worker.body import N_SEGMENTS, SEGMENT, Body

STARTS = {
    "shoulder": "upper_arm", "elbow": "forearm", "wrist": "hand",
    "hip": "thigh", "knee": "shank", "ankle": "foot",
}  # fmt: skip
"""Segment that begins at a joint's centre."""


@dataclass(frozen=True, slots=True)
class Marks:
    """Where a body carries the 15 joints."""

    measure_body: Anatomy
    segment: Ints
    """(15,) that carries each."""
    offset: Floats
    """(15, 3) in that segment's frame [m]."""
    rest: Points3
    """(15, 3) [m]."""


def marks_of(body: Body, landmarks: bool) -> Marks:
    """A body's joints as BlazePose means them (landmarks) or where its bones turn; noses and foot
    tips are BlazePose's in both senses."""
    segment, offset = body.joint_segment.copy(), body.joint_offset.copy()
    if not landmarks:
        for j, joint in enumerate(JOINTS):
            side, _, part = joint.partition("_")
            if part in STARTS:
                segment[j], offset[j] = SEGMENT[f"{side}_{STARTS[part]}"], 0.0
    return Marks(measure_body(body), segment, offset, body.rest_position[segment] + offset)


def joints_in(q: Floats, marks: Marks) -> Points3:
    """(N, 15, 3) joints of poses (N, N_CONTROLS)."""
    position, _, turn = posed(q, marks.anatomy)
    arm = turn[:, marks.segment] @ marks.offset[..., None]
    return position[:, marks.segment] + arm[..., 0]


def posed(q: Floats, bones: Anatomy) -> tuple[Points3, QuaternionsWxyz, Rotations]:
    """Origins (T, 22, 3) [m] of control vectors (T, N_CONTROLS), and turns, (T, 22, 4) as
    quaternions and (T, 22, 3, 3)."""
    position, turn = np.empty((len(q), N_SEGMENTS, 3)), np.empty((len(q), N_SEGMENTS, 4))
    matrix = np.empty((len(q), N_SEGMENTS, 3, 3))
    me = np.zeros(1, WORKER)[0]
    me["bones"], me["frame"], me["lengths"] = bones.offset, bones.frame, bones.lengths
    _pose_each(np.ascontiguousarray(q), position, turn, matrix, me)
    return position, turn, matrix


@kernel(makes_arrays=True)
def _pose_each(q: Floats, position: Floats, turn: Floats, matrix: Floats, me: Worker) -> None:
    """One pose after the other."""
    for n in range(q.shape[0]):
        me.q[:] = q[n]
        pose(me)
        position[n, :], matrix[n, :] = me.p[:N_SEGMENTS], me.r[:N_SEGMENTS]
        for s in range(N_SEGMENTS):
            write_quaternion(me.r, s, turn[n])
