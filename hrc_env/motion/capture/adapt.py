"""A recorded person's joints as a worker of another build would have them.

Where the pelvis and the feet go scales with the legs; trunk, arms and head keep the person's
directions and take the worker's lengths.
"""

import numpy as np

from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.motion.capture.marks import Marks
from hrc_env.motion.capture.person import across, length, middle

STILL_M_S = 0.15
"""An ankle slower than this stands, if it is low [m/s]."""
LOW_SHARE = 40.0
"""Percentile of an ankle's heights below which it is low."""


def leg_ratio(joints: Points3, marks: Marks) -> float:
    """The worker's legs beside the person's."""
    rest = marks.rest[None]
    theirs = length(joints, "hip", "knee") + length(joints, "knee", "ankle")
    return (length(rest, "hip", "knee") + length(rest, "knee", "ankle")) / theirs


def adapted(joints: Points3, fps: float, marks: Marks) -> Points3:
    """(T, 15, 3) where the worker's joints should be [m]."""
    standing = [_standing(joints[:, JOINT[f"{side}_ankle"]], fps) for side in ("left", "right")]
    scaled = leg_ratio(joints, marks) * joints
    scaled[..., 2] += _ankle_rest(marks) - np.mean(
        [np.median(scaled[on, JOINT[f"{side}_ankle"], 2])
         for side, on in zip(("left", "right"), standing, strict=True)]
    )  # fmt: skip
    target, rest = scaled.copy(), marks.rest
    _pair(target, "hip", middle(scaled, "hip"), scaled, rest)
    trunk = middle(rest, "shoulder") - middle(rest, "hip")
    way = middle(scaled, "shoulder") - middle(scaled, "hip")
    stretched = way * (np.linalg.norm(trunk) / np.median(np.linalg.norm(way, axis=-1)))
    _pair(target, "shoulder", middle(scaled, "hip") + stretched, scaled, rest)
    nose = rest[0] - middle(rest, "shoulder")
    target[:, 0] = middle(target, "shoulder") + _along(
        scaled[:, 0] - middle(scaled, "shoulder"), float(np.linalg.norm(nose))
    )
    for side, on in zip(("left_", "right_"), standing, strict=True):
        for first, second in (("shoulder", "elbow"), ("elbow", "wrist")):
            a, b = JOINT[side + first], JOINT[side + second]
            reach = float(np.linalg.norm(rest[b] - rest[a]))
            target[:, b] = target[:, a] + _along(scaled[:, b] - scaled[:, a], reach)
        a, b = JOINT[side + "ankle"], JOINT[side + "foot"]
        target[:, b] = target[:, a] + _foot(scaled[:, b] - scaled[:, a], on, rest[b] - rest[a])
    return target


def _ankle_rest(marks: Marks) -> float:
    """Height of the worker's ankle above the floor [m]."""
    return float(marks.rest[JOINT["left_ankle"], 2])


def _pair(target: Points3, part: str, centre: Points3, source: Points3, rest: Points3) -> None:
    """Set a pair of joints round its middle, along the person's axis, as wide as the worker."""
    half = 0.5 * _along(across(source, part), float(np.linalg.norm(across(rest, part))))
    target[:, JOINT[f"left_{part}"]] = centre + half
    target[:, JOINT[f"right_{part}"]] = centre - half


def _along(way: Points3, metres: float) -> Points3:
    """Vectors of the same direction and another length."""
    return way * (metres / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9))


def _standing(ankle: Points3, fps: float) -> Bools:
    """(T,) frames in which an ankle stands on the floor; at least the lowest ones."""
    speed = np.linalg.norm(np.gradient(ankle, 1.0 / fps, axis=0), axis=-1)
    low = ankle[:, 2] <= np.percentile(ankle[:, 2], LOW_SHARE)
    still = low & (speed < STILL_M_S)
    return still if still.sum() >= 3 else ankle[:, 2] <= np.percentile(ankle[:, 2], 5.0)


def _foot(way: Points3, standing: Bools, rest: Floats) -> Points3:
    """(T, 3) ankle to foot tip: as the person's, but flat where they stand flat."""
    level = np.hypot(way[:, 0], way[:, 1])
    pitch = np.arctan2(way[:, 2], level)
    flat = np.arctan2(rest[2], np.hypot(rest[0], rest[1]))
    pitch += flat - np.median(pitch[standing])
    heading = way[:, :2] / np.maximum(level, 1e-9)[:, None]
    metres = float(np.linalg.norm(rest))
    return metres * np.concatenate(
        [np.cos(pitch)[:, None] * heading, np.sin(pitch)[:, None]], axis=1
    )
