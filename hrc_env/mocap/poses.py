"""Forward kinematics from control vectors to joints and segments of a body."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Floats, Ints, Points3, QuaternionsWxyz, Rotations
from hrc_env.motion.anatomy import Anatomy, measure_body
from hrc_env.motion.kinematics import pose, write_quaternion
from hrc_env.motion.state import WORKER, Worker
from hrc_env.worker.body import N_SEGMENTS, SEGMENT, Body

STARTS = {
    "shoulder": "upper_arm",
    "elbow": "forearm",
    "wrist": "hand",
    "hip": "thigh",
    "knee": "shank",
    "ankle": "foot",
}
"""Segment that has its origin at the centre of a joint, by the joint's name without side."""


@dataclass(frozen=True, slots=True)
class Marks:
    """Positions of the 15 joints on the segments of a body."""

    anatomy: Anatomy
    """Measurements of the body."""
    segment: Ints
    """Index (15,) of the segment to which each joint is fixed."""
    offset: Floats
    """Position (15, 3) of each joint in the frame of its segment [m]."""
    rest: Points3
    """Positions (15, 3) of the joints at rest [m]."""


def make_marks(body: Body, landmarks: bool) -> Marks:
    """Return the positions of joints on a body.

    They are BlazePose landmarks, or centres of rotation of the bones if `landmarks` is False. Nose
    and foot tips are BlazePose landmarks in both cases.
    """
    segment, offset = body.joint_segment.copy(), body.joint_offset.copy()
    if not landmarks:
        for j, joint in enumerate(JOINTS):
            side, _, part = joint.partition("_")
            if part in STARTS:
                segment[j], offset[j] = SEGMENT[f"{side}_{STARTS[part]}"], 0.0
    return Marks(measure_body(body), segment, offset, body.rest_position[segment] + offset)


def locate_joints(q: Floats, marks: Marks) -> Points3:
    """Return the positions (N, 15, 3) of the joints for control vectors (N, N_CONTROLS) [m]."""
    poses = pose_segments(q, marks.anatomy)
    arm = poses.rotation[:, marks.segment] @ marks.offset[..., None]
    return poses.position[:, marks.segment] + arm[..., 0]


class SegmentPoses(NamedTuple):
    """Poses of the segments of a body."""

    position: Points3
    """Origins (T, 22, 3) [m]."""
    quaternion: QuaternionsWxyz
    """Orientations (T, 22, 4), scalar first."""
    rotation: Rotations
    """Orientations (T, 22, 3, 3) as rotation matrices."""


def pose_segments(q: Floats, bones: Anatomy) -> SegmentPoses:
    """Return the poses of the segments for control vectors (T, N_CONTROLS)."""
    position, turn = np.empty((len(q), N_SEGMENTS, 3)), np.empty((len(q), N_SEGMENTS, 4))
    matrix = np.empty((len(q), N_SEGMENTS, 3, 3))
    worker = np.zeros(1, WORKER)[0]
    worker.bones, worker.frame, worker.lengths = bones.offset, bones.frame, bones.lengths
    _pose_each(np.ascontiguousarray(q), position, turn, matrix, worker)
    return SegmentPoses(position, turn, matrix)


@kernel(makes_arrays=True)
def _pose_each(q: Floats, position: Floats, turn: Floats, matrix: Floats, worker: Worker) -> None:
    """Compute the poses of the segments for each control vector.

    Args:
        q: control vectors (T, N_CONTROLS).
        position: origins (T, 22, 3), which are written [m].
        turn: quaternions (T, 22, 4), which are written.
        matrix: rotations (T, 22, 3, 3), which are written.
        worker: record with the measurements of the body.
    """
    for n in range(q.shape[0]):
        worker.q[:] = q[n]
        pose(worker)
        position[n, :], matrix[n, :] = worker.p[:N_SEGMENTS], worker.r[:N_SEGMENTS]
        for s in range(N_SEGMENTS):
            write_quaternion(worker.r, s, turn[n])
