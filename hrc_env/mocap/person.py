"""Measurement of a recorded person, to infer units and faults, and smoothing of motion."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, JOINT, JOINTS
from hrc_env.core.typing import Bools, Floats, Points3

MEASURED_SHARE = 0.755
"""Total length of shank, thigh and trunk in the worker models, as a fraction of stature."""
STRANGE = 2.0
"""Maximum ratio of a bone's length to that of an adult of equal stature.

The minimum ratio is half the inverse of this value.
"""


def midpoint(joints: Points3, part: str) -> Points3:
    """Return the midpoint (..., 3) between the left and the right joint of a pair."""
    return 0.5 * (joints[..., JOINT[f"left_{part}"], :] + joints[..., JOINT[f"right_{part}"], :])


def span(joints: Points3, part: str) -> Points3:
    """Return the vector (..., 3) from the right to the left joint of a pair."""
    return joints[..., JOINT[f"left_{part}"], :] - joints[..., JOINT[f"right_{part}"], :]


def measure_bone(joints: Points3, first: str, second: str) -> float:
    """Return the median distance between two joints over time, averaged over both sides."""
    distances = [
        np.linalg.norm(joints[:, JOINT[side + first]] - joints[:, JOINT[side + second]], axis=-1)
        for side in ("left_", "right_")
    ]
    return float(np.mean(np.nanmedian(distances, axis=1)))


def measure_legs(joints: Points3) -> float:
    """Return the total length of thigh and shank, averaged over both sides."""
    return measure_bone(joints, "hip", "knee") + measure_bone(joints, "knee", "ankle")


def measure_stature(joints: Points3) -> float:
    """Estimate the person's stature, in the unit of the joints (T, 15, 3)."""
    trunk = np.linalg.norm(midpoint(joints, "shoulder") - midpoint(joints, "hip"), axis=-1)
    return (measure_legs(joints) + float(np.nanmedian(trunk))) / MEASURED_SHARE


def check_person(joints: Points3, source: str) -> None:
    """Raise `ConfigError` if the length of a bone is implausible for the person's stature."""
    tall = measure_stature(joints) / 1.75
    for (first, second), usual_m in zip(BONES, BONE_LENGTH_M, strict=True):
        got_m = float(np.median(np.linalg.norm(joints[:, first] - joints[:, second], axis=-1)))
        usual_m = usual_m * tall
        if not usual_m / (2 * STRANGE) < got_m < usual_m * STRANGE:
            raise ConfigError(
                f"{source}: not a person: {JOINTS[first]} and {JOINTS[second]} are {got_m:.2f} m "
                f"apart, but about {usual_m:.2f} m expected. Are the joints in the order "
                f"{', '.join(JOINTS)}?"
            )


def smooth(values: Floats, sigma_frames: float) -> Floats:
    """Smooth values (T, ...) over time by a Gaussian filter, with the end values extended."""
    radius = int(np.ceil(3.0 * sigma_frames))
    if radius < 1:
        return values.copy()
    return gaussian_filter1d(values, sigma_frames, axis=0, mode="nearest", radius=radius)


def resample(values: Floats, fps: float, wanted_fps: float) -> Floats:
    """Resample values (T, ...) to another rate by Catmull-Rom splines.

    Args:
        values: values (T, ...); they are first smoothed if the rate is reduced.
        fps: rate of the values [Hz].
        wanted_fps: rate of the result [Hz].
    """
    if wanted_fps < fps:
        values = smooth(values, 0.4 * fps / wanted_fps)
    n = int(np.floor((len(values) - 1) * wanted_fps / fps + 1e-6)) + 1
    at = np.minimum(np.arange(n) * fps / wanted_fps, len(values) - 1.0)
    whole = np.minimum(at.astype(int), len(values) - 2)
    u = (at - whole).reshape(-1, *[1] * (values.ndim - 1))
    a, b, c, d = (values[np.clip(whole + k, 0, len(values) - 1)] for k in (-1, 0, 1, 2))
    return b + 0.5 * u * (c - a + u * (2 * a - 5 * b + 4 * c - d + u * (3 * (b - c) + d - a)))


class Run(NamedTuple):
    """A contiguous run of frames."""

    first: int
    """Index of the first frame."""
    end: int
    """Index of the frame after the last frame."""


def find_runs(flag: Bools) -> list[Run]:
    """Return the contiguous runs of frames in which a flag is True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flag, [False]])))
    return [Run(*pair) for pair in edges.reshape(-1, 2).tolist()]
