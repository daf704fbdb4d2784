"""Workers of the environment that run or fall, as a second source of such motions.

Successive seeds use the eight bodies of the package in turn. The motion shares no code with
`athletes`.
"""

import numpy as np

from benchmarks.tracking.rigs import DT_S
from hrc_env.core.typing import Floats, Points3
from hrc_env.motion import state as st
from hrc_env.motion.activities.falling import plan_fall
from hrc_env.motion.activities.running import limit_run_speed, plan_run
from hrc_env.motion.paths import lay_path
from hrc_env.motion.points import Point
from hrc_env.motion.repertoire import OPEN, REPERTOIRE, Act, make_worker, perform
from hrc_env.motion.state import Worker
from hrc_env.worker.body import load_body, worker_names, worker_truth

_FASTEST_M_S, _WALK_M_S, _LIES_S, _WAY_M = 3.5, 1.3, (2.0, 4.0), 4.0
"""Speeds of running and walking [m/s], range of the time on the ground [s], and desired length of a
walk [m].
"""


def run_to_and_fro(walk_m: tuple[float, float], seeds: list[int], n_frames: int) -> Points3:
    """Return joints (T, S, J, 3) of workers that run from corner to corner at top speed [m]."""

    def run(draws: Floats, height_m: float, me: Worker) -> float:
        yaw = _plan_across(me)
        return plan_run(yaw, limit_run_speed(_FASTEST_M_S, me), me)

    return _play_act(Act(st.RUN, run, 0.0), walk_m, seeds, n_frames)


def fall_and_get_up(walk_m: tuple[float, float], seeds: list[int], n_frames: int) -> Points3:
    """Return joints (T, S, J, 3) of workers that walk, fall, and get up after 2 to 4 s [m]."""

    def fall(draws: Floats, height_m: float, me: Worker) -> float:
        yaw = _plan_across(me, _WAY_M)
        lies_s = _LIES_S[0] + draws.item(4) * (_LIES_S[1] - _LIES_S[0])
        return plan_fall(draws, yaw, _WALK_M_S, lies_s, OPEN, me)

    return _play_act(Act(st.FALL, fall, 0.0), walk_m, seeds, n_frames)


def _plan_across(me: Worker, most_m: float = np.inf) -> float:
    """Plan a straight path across the centre of the area; return its direction [rad]."""
    x, y = float(me.start_x), float(me.start_y)
    share = min(2.0, most_m / np.hypot(x, y))
    lay_path(Point(x, y), np.zeros((0, 3)), Point(x - share * x, y - share * y), me)
    return float(np.arctan2(-y, -x))


def _play_act(act: Act, walk_m: tuple[float, float], seeds: list[int], n_frames: int) -> Points3:
    """Return joints (T, S, J, 3) of workers that start in a corner and repeat an activity [m]."""
    sequences = []
    for seed in seeds:
        rng = np.random.default_rng([seed, 11])
        body = load_body(worker_names()[seed % len(worker_names())])
        corner = rng.choice([-1.0, 1.0], 2) * rng.uniform(0.9, 1.0, 2) * walk_m
        me = make_worker(body, (corner[0], corner[1]), float(rng.uniform(-np.pi, np.pi)))
        joints = []
        while sum(map(len, joints)) < n_frames:
            for film in perform((act, *REPERTOIRE["look round"]), me, rng, DT_S):
                joints.append(worker_truth(body, film.motion).joints_world[:, 0])
        sequences.append(np.concatenate(joints)[:n_frames])
    return np.stack(sequences, 1)
