"""Measures of a recorded person, by which a file's unit and its faults are known; smoothing."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, JOINT, JOINTS
from hrc_env.core.typing import Bools, Floats, Points3

MEASURED_SHARE, STRANGE = 0.755, 2.0
"""Shank, thigh and trunk together as a share of stature (the baked bodies); a bone so many times
longer or shorter than of an adult of the same stature is a mistake."""


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


def legs(joints: Points3) -> float:
    """Length of thigh and shank."""
    return length(joints, "hip", "knee") + length(joints, "knee", "ankle")


def stature(joints: Points3) -> float:
    """Estimate of the person's stature, in the unit of the joints (T, 15, 3)."""
    trunk = np.linalg.norm(middle(joints, "shoulder") - middle(joints, "hip"), axis=-1)
    return (legs(joints) + float(np.nanmedian(trunk))) / MEASURED_SHARE


def check_person(joints: Points3, source: str) -> None:
    """Refuse what has a person's stature but no person's bones; names the bone."""
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


def smoothed(values: Floats, sigma_frames: float) -> Floats:
    """(T, ...) averaged over time with a bell-shaped weight; the ends are held."""
    radius = int(np.ceil(3.0 * sigma_frames))
    if radius < 1:
        return values.copy()
    return gaussian_filter1d(values, sigma_frames, axis=0, mode="nearest", radius=radius)


def resampled(values: Floats, fps: float, wished_fps: float) -> Floats:
    """(T, ...) at another rate, by Catmull-Rom splines; smoothed first where frames are lost."""
    if wished_fps < fps:
        values = smoothed(values, 0.4 * fps / wished_fps)
    n = int(np.floor((len(values) - 1) * wished_fps / fps + 1e-6)) + 1
    at = np.minimum(np.arange(n) * fps / wished_fps, len(values) - 1.0)
    whole = np.minimum(at.astype(int), len(values) - 2)
    u = (at - whole).reshape(-1, *[1] * (values.ndim - 1))
    a, b, c, d = (values[np.clip(whole + k, 0, len(values) - 1)] for k in (-1, 0, 1, 2))
    return b + 0.5 * u * (c - a + u * (2 * a - 5 * b + 4 * c - d + u * (3 * (b - c) + d - a)))


def runs(flag: Bools) -> list[tuple[int, int]]:
    """(first, one past the last) of each unbroken run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flag, [False]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
