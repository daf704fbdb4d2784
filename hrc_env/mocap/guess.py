"""Geometric computation of initial control vectors, which `retarget.fit_controls` refines."""

import numpy as np

from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats, Points3
from hrc_env.mocap.person import midpoint, smooth, span
from hrc_env.mocap.poses import Marks
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import GRIP_M

HEADING_S = 0.25
"""Standard deviation of the smoothing of the pelvis's direction, which defines the heading [s]."""
PELVIS_SHARE = 0.45
"""Fraction of the trunk's pitch that is due to the pelvis, as in `posture.lean`."""
VERTICAL_SHARE = 0.2
"""Horizontal extent of a foot, relative to its length, below which it has the pelvis's heading."""
NOSE_PITCH_RAD = 0.6
"""Angle at mid-shoulder between the nose and the trunk's axis for a level head [rad]."""


def guess_controls(joints: Points3, fps: float, marks: Marks) -> Floats:
    """Estimate control vectors (T, N_CONTROLS) from joints.

    Args:
        joints: desired positions (T, 15, 3) of the worker's joints [m].
        fps: frame rate [Hz].
        marks: joints of the worker's body.
    """
    q = np.zeros((len(joints), c.N_CONTROLS))
    yaw = np.unwrap(_find_yaw(span(joints, "hip")))
    heading = smooth(yaw, HEADING_S * fps)
    hips, rest = midpoint(joints, "hip"), marks.rest
    q[:, c.ROOT_X], q[:, c.ROOT_Y], q[:, c.HEADING] = hips[:, 0], hips[:, 1], heading
    above = marks.anatomy.offset[0, 2] - midpoint(rest, "hip")[2]
    q[:, c.PELVIS_Z], q[:, c.PELVIS_YAW] = hips[:, 2] + above, yaw - heading
    hip = span(joints, "hip")
    q[:, c.PELVIS_ROLL] = np.arctan2(hip[:, 2], np.hypot(hip[:, 0], hip[:, 1]))
    trunk = _turn_about_z(midpoint(joints, "shoulder") - hips, -yaw)
    pitch = np.arctan2(trunk[:, 0], trunk[:, 2])
    lateral = np.arctan2(trunk[:, 1], np.hypot(trunk[:, 0], trunk[:, 2]))
    q[:, c.PELVIS_PITCH] = PELVIS_SHARE * pitch
    q[:, c.SPINE_FLEX] = 2.0 * (1.0 - PELVIS_SHARE) * pitch
    q[:, c.SPINE_SIDE] = -1.5 * lateral - q[:, c.PELVIS_ROLL]
    twist = (_find_yaw(span(joints, "shoulder")) - yaw + np.pi) % (2 * np.pi) - np.pi
    q[:, c.SPINE_TWIST] = twist
    nose = _turn_about_z(joints[:, 0] - midpoint(joints, "shoulder"), -yaw - twist)
    q[:, c.HEAD_YAW] = np.arctan2(nose[:, 1], np.maximum(nose[:, 0], 0.05))
    q[:, c.HEAD_PITCH] = np.arctan2(nose[:, 0], nose[:, 2]) - NOSE_PITCH_RAD - 1.5 * pitch
    for side, name in enumerate(("left_", "right_")):
        _guess_arm(q, side, name, joints, yaw + twist)
        _guess_foot(q, side, name, joints, marks)
    return q


def _guess_arm(q: Floats, side: int, name: str, joints: Points3, chest_yaw: Floats) -> None:
    """Estimate the grip relative to the shoulder, and the swivel of the elbow.

    Args:
        q: control vectors (T, N_CONTROLS), which are changed.
        side: 0 left, 1 right.
        name: prefix of the side's joints.
        joints: joints (T, 15, 3) [m].
        chest_yaw: heading (T,) of the chest [rad].
    """
    shoulder, elbow, wrist = (joints[:, JOINT[name + p]] for p in ("shoulder", "elbow", "wrist"))
    fore = wrist - elbow
    grip = wrist + GRIP_M * fore / np.linalg.norm(fore, axis=-1, keepdims=True)
    reach = _turn_about_z(grip - shoulder, -chest_yaw)
    q[:, c.HAND_OFFSET + 3 * side : c.HAND_OFFSET + 3 * side + 3] = reach
    sign = 1.0 - 2.0 * side
    hanging, outward = np.array([-0.7, 0.45 * sign, -0.9]), np.array([0.0, sign, 0.0])
    q[:, c.SWIVEL + side] = _find_swivel(
        reach, _turn_about_z(elbow - shoulder, -chest_yaw), hanging, outward
    )


def _find_swivel(reach: Points3, elbow: Points3, hanging: Floats, outward: Floats) -> Floats:
    """Return the angles s (T,) at which cos(s) hanging + sin(s) outward points to the elbow.

    Args:
        reach: grip (T, 3) relative to the shoulder.
        elbow: elbow (T, 3) relative to the shoulder.
        hanging: direction (3,) of a hanging elbow.
        outward: direction (3,) of an elbow that points outwards.
    """
    axis = reach / np.linalg.norm(reach, axis=-1, keepdims=True)
    first, second, wished = (
        v - (v * axis).sum(-1, keepdims=True) * axis for v in (hanging, outward, elbow)
    )
    cross = (np.cross(first, second) * axis).sum(-1)
    cos = (np.cross(wished, second) * axis).sum(-1) * np.sign(cross)
    sin = (np.cross(first, wished) * axis).sum(-1) * np.sign(cross)
    return np.unwrap(np.arctan2(sin, cos))


def _guess_foot(q: Floats, side: int, name: str, joints: Points3, marks: Marks) -> None:
    """Estimate the ankle position, heading and pitch of a foot.

    A kneeling foot may pitch beyond the vertical.

    Args:
        q: control vectors (T, N_CONTROLS), which are changed.
        side: 0 left, 1 right.
        name: prefix of the side's joints.
        joints: joints (T, 15, 3) [m].
        marks: joints of the worker's body.
    """
    ankle, tip = JOINT[name + "ankle"], JOINT[name + "foot"]
    way, rest = joints[:, tip] - joints[:, ankle], marks.rest[tip] - marks.rest[ankle]
    pelvis = q[:, c.HEADING] + q[:, c.PELVIS_YAW]
    local = _turn_about_z(way, -pelvis)
    outward = local[:, 1] * np.sign(local[:, 0] + 1e-9)
    turn = np.arctan2(outward, np.abs(local[:, 0]) + VERTICAL_SHARE * np.linalg.norm(rest))
    level = np.cos(turn) * local[:, 0] + np.sin(turn) * local[:, 1]
    at, flat = c.ANKLE + 6 * side, np.arctan2(-rest[2], np.hypot(rest[0], rest[1]))
    q[:, at : at + 3] = joints[:, ankle]
    q[:, at + 3] = pelvis + turn - np.arctan2(rest[1], rest[0])
    q[:, at + 4] = np.arctan2(-way[:, 2], level) - flat


def _find_yaw(leftward: Points3) -> Floats:
    """Return the heading (T,) of a person, given vectors to the person's left [rad]."""
    return np.arctan2(-leftward[:, 0], leftward[:, 1])


def _turn_about_z(points: Points3, yaw: Floats) -> Points3:
    """Rotate points (T, 3) about +z by angles (T,) [rad]."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y, z = points.T
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], -1)
