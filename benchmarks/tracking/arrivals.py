"""Simulated transport of frames: constant and random latency, lower frame rate, and losses."""

from typing import NamedTuple

import numpy as np

from benchmarks.tracking.rigs import DT_S
from hrc_env.core.typing import Floats, Points2

LONGEST_DELAY_S = 0.5
"""Maximum delay of a frame in the configuration of the estimators [s]."""
_LATENCY_S = (0.04, 0.20)
_JITTER_S = 0.02
_DROPPED = 0.05


class Delivered(NamedTuple):
    """Frames, indexed by the step in which the cameras deliver them."""

    px: Points2
    """Pixels (T, S, C, J, 2); NaN without a frame."""
    time_s: Floats
    """Times (T, S, C) at which the frames were taken [s]; the first frame is taken at 0.04 s. NaN
    without a frame.
    """


def deliver(px: Points2, seeds: list[int]) -> Delivered:
    """Simulate the delivery of frames: return the frames that cameras deliver in each step.

    Each camera has a constant latency of 40 to 200 ms, plus a random latency of up to 20 ms for
    each frame. In each sequence, one camera takes only every second frame. Five percent of the
    frames are lost. If several frames of a camera arrive in the same step, only the newest is
    delivered.

    Args:
        px: pixels in the frames that the cameras take (T, S, C, J, 2).
        seeds: seeds of the sequences.
    """
    out = np.full(px.shape, np.nan)
    time_s = np.full(px.shape[:3], np.nan)
    for s, seed in enumerate(seeds):
        rng = np.random.default_rng([seed, 11])
        n_frames, n_cameras = px.shape[0], px.shape[2]
        delay_s = rng.uniform(*_LATENCY_S, n_cameras)
        delay_s = delay_s + rng.uniform(0, _JITTER_S, (n_frames, n_cameras))
        lost = rng.random((n_frames, n_cameras)) < _DROPPED
        lost[1::2, seed % n_cameras] = True
        step = np.arange(n_frames)[:, None] + np.ceil(delay_s / DT_S - 1e-9).astype(int)
        for taken, c in np.argwhere(~lost & (step < n_frames)):  # later frames replace earlier ones
            now = step[taken, c]
            out[now, s, c], time_s[now, s, c] = px[taken, s, c], (taken + 1) * DT_S
    return Delivered(out, time_s)


def restore_times(px: Points2, time_s: Floats) -> Points2:
    """Move delivered frames (T, S, C, ...) to the steps in which they were taken."""
    out = np.full(px.shape, np.nan)
    now, s, c = np.nonzero(np.isfinite(time_s))
    out[np.rint(time_s[now, s, c] / DT_S).astype(int) - 1, s, c] = px[now, s, c]
    return out
