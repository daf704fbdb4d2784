"""Numbers over time: gaps, smoothing, another rate."""

import numpy as np

from hrc_env.core.typing import Bools, Floats


def smoothed(values: Floats, sigma_frames: float) -> Floats:
    """(T, ...) averaged over time with a bell-shaped weight; the ends are held."""
    reach = int(np.ceil(3.0 * sigma_frames))
    if reach < 1:
        return values.copy()
    at = np.arange(-reach, reach + 1)
    weight = np.exp(-0.5 * (at / sigma_frames) ** 2)
    weight /= weight.sum()
    padded = np.pad(values, [(reach, reach)] + [(0, 0)] * (values.ndim - 1), mode="edge")
    out = np.zeros_like(values)
    for k, w in enumerate(weight):
        out += w * padded[k : k + len(values)]
    return out


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


def bridged(values: Floats, known: Bools) -> Floats:
    """(T, n) with what is not known (T,) on straight lines between what is, the ends held."""
    at = np.flatnonzero(known)
    return np.stack([np.interp(np.arange(len(values)), at, column[at]) for column in values.T], 1)


def runs(flag: Bools) -> list[tuple[int, int]]:
    """(first, one past the last) of each unbroken run of True."""
    edge = np.diff(np.concatenate([[False], flag, [False]]).astype(np.int8))
    first, last = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1)
    return list(zip(first.tolist(), last.tolist(), strict=True))
