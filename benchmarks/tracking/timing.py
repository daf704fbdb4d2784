"""How long one worker's update takes: prediction and update, everything included."""

import time
from typing import Any

import numpy as np

from benchmarks.tracking.couples import shuffles
from benchmarks.tracking.detections import Damage, detect
from benchmarks.tracking.rigs import DT_S, Rig
from benchmarks.tracking.sequences import Sequences
from benchmarks.tracking.walks import walk
from hrc_env.core.typing import Floats
from hrc_env.experiments.study.cache import PartProgress
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.people.association import associate

BATCH = 64
_N_FRAMES, _FIRST = 75, 25
_N_PEOPLE = 4


def time_estimator(
    name: str, rig: Rig, clean: Sequences, hard: Sequences, n_repeats: int, tick: PartProgress
) -> dict[str, list[float]]:
    """Microseconds per worker and update, one number per repeat: medians over frames of `clean` at
    batch 1 and 64 ("1", "64"), the mean of `hard` at batch 64 ("hard_64")."""
    times: dict[str, list[float]] = {"1": [], "64": [], "hard_64": []}
    _frame_times(name, rig, clean, 1, 2)  # compiles
    for _ in range(n_repeats):
        times["1"].append(float(np.median(_frame_times(name, rig, clean, 1))))
        times["64"].append(float(np.median(_frame_times(name, rig, clean, BATCH))))
        times["hard_64"].append(float(np.mean(_frame_times(name, rig, hard, BATCH))))
        tick(1 / n_repeats)
    return times


def _frame_times(
    name: str, rig: Rig, sequences: Sequences, batch: int, n_frames: int = _N_FRAMES
) -> Floats:
    """Microseconds per worker of each frame after the first second."""
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


def time_association(rig: Rig, n_repeats: int, tick: PartProgress) -> dict[str, list[float]]:
    """Microseconds to tell four people apart in one frame of four cameras, one per repeat."""
    sequences = _crowd(rig)
    estimator: Any = make_estimator("kalman", rig.P, DT_S, sequences.config)
    times: list[float] = []
    for _ in range(n_repeats + 1):  # the first compiles
        rngs = [np.random.default_rng(5)]
        state = estimator.init(1, _N_PEOPLE)
        estimator.reset(state, np.arange(1), rngs)
        seconds = np.empty(_N_FRAMES)
        for t in range(_N_FRAMES):
            keypoints = sequences.keypoints(t)
            estimator.predict(state, DT_S, rngs)
            predicted = estimator.estimate(state)
            started_s = time.perf_counter()
            found = associate(rig.P, keypoints, predicted)
            seconds[t] = time.perf_counter() - started_s
            estimator.update(state, found.keypoints, rngs)
        times.append(1e6 * float(np.median(seconds[_FIRST:])))
        tick(1 / (n_repeats + 1))
    return {"us": times[1:]}


def _crowd(rig: Rig) -> Sequences:
    """One sequence of four walkers, each on a way of their own."""
    seeds = list(range(_N_PEOPLE))
    joints = walk(rig.walk_m, seeds, _N_FRAMES)
    px = detect(rig.P, joints, Damage(occluded=True), seeds)  # (T, 4, C, J, 2)
    order = shuffles([0], _N_FRAMES, len(rig.P), _N_PEOPLE)
    return Sequences(joints[:, None], px.swapaxes(1, 2)[:, None], {}, rig.tracker, order=order)
