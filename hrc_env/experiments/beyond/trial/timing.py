"""How long one worker's update takes, prediction included, on the detections of a setting."""

import time
from dataclasses import replace
from typing import Any

import numpy as np

from hrc_env.core.batching import rows
from hrc_env.experiments.beyond.trial.handicaps import BONES, MOTION
from hrc_env.experiments.beyond.trial.play import DT_S, N_WARM_UP, eyes_of, watch
from hrc_env.experiments.beyond.trial.setting import Setting
from hrc_env.experiments.beyond.trial.walks import Walks

RECORDED_BY = "triangulation"
"""Detections do not depend on who follows them: the quickest does."""
N_REPEATS = 3
"""How often the time is taken."""


def update_us(setting: Setting, walks: Walks, seeds: tuple[int, ...], n_frames: int) -> list[float]:
    """Microseconds per worker and update after the warm-up, the median over frames, a number for
    each repetition; processor time of one thread, a few workers at once, so that a busy machine
    changes little.

    Args:
        setting: whose estimator; its first turn.
        walks: of its scene and workers.
        seeds: of the walks; the first few are used.
        n_frames: so many updates are timed.
    """
    turn, ids = setting.turns[0], np.arange(min(len(seeds), 4))
    until = N_WARM_UP + n_frames
    short = replace(walks, motions=walks.motions[:until])
    recorded_by = replace(setting, estimator=RECORDED_BY, bones=BONES[0], motion=MOTION[0])
    shown = watch(recorded_by, turn, short, seeds, ids, lambda *_: None)
    tracker: Any = eyes_of(setting, turn, len(ids)).tracker
    found = []
    for _ in range(N_REPEATS):
        rngs = [np.random.default_rng([seeds[b], 3]) for b in ids.tolist()]
        state = tracker.init(len(ids), setting.n_workers)
        tracker.reset(state, ids, rngs)
        spent_s = []
        for keypoints in shown:
            seen = rows(keypoints, ids)
            begun_s = time.thread_time()
            tracker.predict(state, DT_S, rngs)
            tracker.update(state, seen, rngs)
            spent_s.append(time.thread_time() - begun_s)
        median_s = float(np.median(spent_s[N_WARM_UP:]))
        found.append(1e6 * median_s / (len(ids) * setting.n_workers))
    return found
