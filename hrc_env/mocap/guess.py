"""A first control vector from joints, by geometry alone; `retarget.fitted` improves it."""

import numpy as np

from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats, Points3
from hrc_env.mocap.person import across, middle, smoothed
from hrc_env.mocap.poses import Marks
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import GRIP_M

HEADING_S, PELVIS_SHARE = 0.25, 0.45
"""The heading is the pelvis's direction, smoothed over about this time [s]; the pelvis's share of
the trunk's pitch (as in `posture.lean`)."""
VERTICAL_SHARE = 0.2
"""A foot that is nearly vertical heads where the pelvis does: by this share of its length."""
NOSE_PITCH_RAD = 0.6
"""Nose from mid-shoulder, forward of the trunk's axis, in a head held straight."""


def first_guess(joints: Points3, fps: float, marks: Marks) -> Floats:
    """(T, N_CONTROLS) from the worker's wished joints (T, 15, 3)."""
    q = np.zeros((len(joints), c.N_CONTROLS))
    yaw = np.unwrap(_yaw(across(joints, "hip")))
    heading = smoothed(yaw, HEADING_S * fps)
    hips, rest = middle(joints, "hip"), marks.rest
    q[:, c.ROOT_X], q[:, c.ROOT_Y], q[:, c.HEADING] = hips[:, 0], hips[:, 1], heading
    above = marks.anatomy.offset[0, 2] - middle(rest, "hip")[2]
    q[:, c.PELVIS_Z], q[:, c.PELVIS_YAW] = hips[:, 2] + above, yaw - heading
    hip = across(joints, "hip")
    q[:, c.PELVIS_ROLL] = np.arctan2(hip[:, 2], np.hypot(hip[:, 0], hip[:, 1]))
    trunk = _turned(middle(joints, "shoulder") - hips, -yaw)
    pitch = np.arctan2(trunk[:, 0], trunk[:, 2])
    lateral = np.arctan2(trunk[:, 1], np.hypot(trunk[:, 0], trunk[:, 2]))
    q[:, c.PELVIS_PITCH] = PELVIS_SHARE * pitch
    q[:, c.SPINE_FLEX] = 2.0 * (1.0 - PELVIS_SHARE) * pitch
    q[:, c.SPINE_SIDE] = -1.5 * lateral - q[:, c.PELVIS_ROLL]
    twist = (_yaw(across(joints, "shoulder")) - yaw + np.pi) % (2 * np.pi) - np.pi
    q[:, c.SPINE_TWIST] = twist
    nose = _turned(joints[:, 0] - middle(joints, "shoulder"), -yaw - twist)
    q[:, c.HEAD_YAW] = np.arctan2(nose[:, 1], np.maximum(nose[:, 0], 0.05))
    q[:, c.HEAD_PITCH] = np.arctan2(nose[:, 0], nose[:, 2]) - NOSE_PITCH_RAD - 1.5 * pitch
    for side, name in enumerate(("left_", "right_")):
        _arm(q, side, name, joints, yaw + twist)
        _foot(q, side, name, joints, marks)
    return q


def _arm(q: Floats, side: int, name: str, joints: Points3, chest_yaw: Floats) -> None:
    """Where the grip is from the shoulder, and the elbow's swivel, in the chest's level frame."""
    shoulder, elbow, wrist = (joints[:, JOINT[name + p]] for p in ("shoulder", "elbow", "wrist"))
    fore = wrist - elbow
    grip = wrist + GRIP_M * fore / np.linalg.norm(fore, axis=-1, keepdims=True)
    reach = _turned(grip - shoulder, -chest_yaw)
    q[:, c.HAND_OFFSET + 3 * side : c.HAND_OFFSET + 3 * side + 3] = reach
    sign = 1.0 - 2.0 * side
    hanging, outward = np.array([-0.7, 0.45 * sign, -0.9]), np.array([0.0, sign, 0.0])
    q[:, c.SWIVEL + side] = _swivel(reach, _turned(elbow - shoulder, -chest_yaw), hanging, outward)


def _swivel(reach: Points3, elbow: Points3, hanging: Floats, outward: Floats) -> Floats:
    """Angle s for which cos(s) hanging + sin(s) outward points to the elbow's side of an arm."""
    axis = reach / np.linalg.norm(reach, axis=-1, keepdims=True)
    first, second, wished = (
        v - (v * axis).sum(-1, keepdims=True) * axis for v in (hanging, outward, elbow)
    )
    cross = (np.cross(first, second) * axis).sum(-1)
    cos = (np.cross(wished, second) * axis).sum(-1) * np.sign(cross)
    sin = (np.cross(first, wished) * axis).sum(-1) * np.sign(cross)
    return np.unwrap(np.arctan2(sin, cos))


def _foot(q: Floats, side: int, name: str, joints: Points3, marks: Marks) -> None:
    """Ankle, heading and pitch of a foot; beyond the vertical for who kneels on its back."""
    ankle, tip = JOINT[name + "ankle"], JOINT[name + "foot"]
    way, rest = joints[:, tip] - joints[:, ankle], marks.rest[tip] - marks.rest[ankle]
    pelvis = q[:, c.HEADING] + q[:, c.PELVIS_YAW]
    local = _turned(way, -pelvis)
    outward = local[:, 1] * np.sign(local[:, 0] + 1e-9)
    turn = np.arctan2(outward, np.abs(local[:, 0]) + VERTICAL_SHARE * np.linalg.norm(rest))
    level = np.cos(turn) * local[:, 0] + np.sin(turn) * local[:, 1]
    at, flat = c.ANKLE + 6 * side, np.arctan2(-rest[2], np.hypot(rest[0], rest[1]))
    q[:, at : at + 3] = joints[:, ankle]
    q[:, at + 3] = pelvis + turn - np.arctan2(rest[1], rest[0])
    q[:, at + 4] = np.arctan2(-way[:, 2], level) - flat


def _yaw(leftward: Points3) -> Floats:
    """Direction that a person faces whose left is there."""
    return np.arctan2(-leftward[:, 0], leftward[:, 1])


def _turned(points: Points3, yaw: Floats) -> Points3:
    """Points (T, 3) turned about +z by angles (T,)."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y, z = points.T
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], -1)
