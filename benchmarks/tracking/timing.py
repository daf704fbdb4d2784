"""Measurement of the time of an estimator's update, including the prediction."""

import time
from typing import Any

import numpy as np

from benchmarks.tracking.rigs import DT_S, Rig
from benchmarks.tracking.sequences import Sequences
from hrc_env.core.typing import Floats
from hrc_env.experiments.cache import PartProgress
from hrc_env.tracking.estimators import make_estimator

BATCH = 64
_N_FRAMES, _FIRST = 75, 25


def time_estimator(
    name: str, rig: Rig, clean: Sequences, hard: Sequences, n_repeats: int, tick: PartProgress
) -> dict[str, list[float]]:
    """Measure the time per worker and update [us], with one number per repetition.

    The results are medians over the frames of `clean` at batch sizes 1 and 64 ("1", "64"), and the
    mean over the frames of `hard` at batch size 64 ("hard_64").
    """
    times: dict[str, list[float]] = {"1": [], "64": [], "hard_64": []}
    _frame_times(name, rig, clean, 1, 2)  # the first run compiles functions
    for _ in range(n_repeats):
        times["1"].append(float(np.median(_frame_times(name, rig, clean, 1))))
        times["64"].append(float(np.median(_frame_times(name, rig, clean, BATCH))))
        times["hard_64"].append(float(np.mean(_frame_times(name, rig, hard, BATCH))))
        tick(1 / n_repeats)
    return times


def _frame_times(
    name: str, rig: Rig, sequences: Sequences, batch: int, n_frames: int = _N_FRAMES
) -> Floats:
    """Measure the time per worker in each frame after the first second [us]."""
    estimator: Any = make_estimator(name, rig.P, DT_S, sequences.config)
    rngs = [np.random.default_rng([b, 5]) for b in range(batch)]
    state = estimator.init(batch, 1)
    estimator.reset(state, np.arange(batch), rngs)
    seconds, sequences = np.empty(n_frames), sequences.first(batch)
    for t in range(n_frames):
        keypoints = sequences.keypoints(t)
        started_s = time.perf_counter()
        estimator.predict(state, DT_S, rngs)
        estimator.update(state, keypoints, rngs)
        seconds[t] = time.perf_counter() - started_s
    return 1e6 * seconds[min(_FIRST, n_frames - 1) :] / batch
