"""Measures of a recorded person, by which a file's unit and its faults are known."""

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, JOINT, JOINTS
from hrc_env.core.typing import Floats, Points3

MEASURED_SHARE = 0.755
"""Shank, thigh and trunk together as a share of stature (the baked bodies)."""
STATURES_M = (1.3, 2.2)
"""Statures of people who are believed [m]."""
STRANGE = 2.0
"""A bone so many times longer or shorter than of an adult of the same stature is a mistake."""


def middle(joints: Points3, part: str) -> Points3:
    """(..., 3) between the left and the right joint of a pair."""
    return 0.5 * (joints[..., JOINT[f"left_{part}"], :] + joints[..., JOINT[f"right_{part}"], :])


def across(joints: Points3, part: str) -> Points3:
    """(..., 3) from the right to the left joint of a pair."""
    return joints[..., JOINT[f"left_{part}"], :] - joints[..., JOINT[f"right_{part}"], :]


def length(joints: Points3, first: str, second: str) -> float:
    """Median distance of two joints over time, the mean of both sides."""
    each = [
        np.linalg.norm(joints[:, JOINT[side + first]] - joints[:, JOINT[side + second]], axis=-1)
        for side in ("left_", "right_")
    ]
    return float(np.mean(np.nanmedian(each, axis=1)))


def stature(joints: Points3) -> float:
    """Estimate of the person's stature, in the unit of the joints (T, 15, 3)."""
    trunk = np.linalg.norm(middle(joints, "shoulder") - middle(joints, "hip"), axis=-1)
    legs = length(joints, "hip", "knee") + length(joints, "knee", "ankle")
    return (legs + float(np.nanmedian(trunk))) / MEASURED_SHARE


def upright(joints: Points3) -> Floats:
    """(3,) mean direction from the ankles to the shoulders; its length tells how steadily."""
    way = middle(joints, "shoulder") - middle(joints, "ankle")
    return np.nanmean(way / np.linalg.norm(way, axis=-1, keepdims=True), axis=0)


def forwards(joints: Points3, up: Floats) -> tuple[float, float]:
    """How far feet point, and knees bend, to where left-hand and up say that forward is.

    Both are medians in shares of the bones: positive for a person, negative for their mirror
    image.
    """
    ahead = np.cross(across(joints, "hip") + across(joints, "shoulder"), up)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    foot = middle(joints, "foot") - middle(joints, "ankle")
    feet = (foot * ahead).sum(-1) / np.linalg.norm(foot, axis=-1)
    bent = middle(joints, "knee") - 0.5 * (middle(joints, "hip") + middle(joints, "ankle"))
    knees = (bent * ahead).sum(-1) / length(joints, "knee", "ankle")
    return float(np.nanmedian(feet)), float(np.nanmean(knees))


def check_person(joints: Points3, source: str) -> None:
    """Refuse what has a person's stature but no person's bones.

    Raises:
        ConfigError: a bone is far too long or short; names it.
    """
    tall = stature(joints) / 1.75
    for (first, second), usual_m in zip(BONES, BONE_LENGTH_M, strict=True):
        got_m = float(np.median(np.linalg.norm(joints[:, first] - joints[:, second], axis=-1)))
        usual_m = usual_m * tall
        if not usual_m / (2 * STRANGE) < got_m < usual_m * STRANGE:
            raise ConfigError(
                f"{source}: no person: {JOINTS[first]} and {JOINTS[second]} are {got_m:.2f} m "
                f"apart, about {usual_m:.2f} m expected. Are the joints in the order "
                f"{', '.join(JOINTS)}?"
            )
