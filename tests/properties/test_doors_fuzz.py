"""Whatever users bring is taken or refused in words: no raw error, no signal that ends a process.

Each child process imports the package once and meets some hundred cases: estimates, shields'
results, robots, arguments and images of a `PoseTracker`, with everything in the wrong place.
"""

import multiprocessing
import os
import traceback
from dataclasses import fields, replace

import numpy as np
import pytest

from hrc_env.core.errors import HRCError

CASES = int(os.environ.get("HRC_ENV_FUZZ", "400"))
"""Number of cases of all doors together."""
A_CHILD = 200


def odd(rng):
    """Something that is rarely what was asked for."""
    shape = tuple(rng.integers(0, 5, rng.integers(0, 5)).tolist())
    right = ((1, 1, 15, 3), (1, 1, 15), (1, 1), (1, 6), (6,), (1,), (3, 4), (4, 2, 3))
    if rng.random() < 0.5:
        shape = right[rng.integers(len(right))]
    kinds = ("float64", "float32", "int64", "bool", "complex128", "object", "U3", "datetime64[s]")
    made = [
        lambda: rng.normal(size=shape),
        lambda: np.zeros(shape, kinds[rng.integers(len(kinds))]),
        lambda: np.full(shape, rng.choice([np.nan, np.inf, -np.inf, 1e308, -1.0])),
        lambda: rng.choice([0, 1, -1, 10**9, 1e-300]),
        lambda: [None, "", "x", b"x", True, (), [], {}, {"a": 1}, {1: 2}, [[1], [1, 2]]][
            rng.integers(11)
        ],
        lambda: rng.normal(size=shape).tolist(),
        lambda: np.asfortranarray(rng.normal(size=(4, 3)))[::2],
        lambda: [object(), int, len, (x for x in ()), range(3), 1j, float("nan")][rng.integers(7)],
    ]
    return made[rng.integers(len(made))]()


def meet_estimates(rng):
    """An estimator whose estimates are not what they should be."""
    from hrc_env.env import HRCEnv
    from hrc_env.tracking.estimators import make_estimator

    names = ["mean_world", "cov_world", "velocity_world", "age_s", "tracked", "unknown",
             "unobserved_s", "seen_world"]  # fmt: skip
    chosen = rng.choice(names, rng.integers(1, 4), replace=False)

    class Mine:
        def __init__(self, P, ctrl_dt, config):
            self.config, self.inner = config, make_estimator("triangulation", P, ctrl_dt, config)

        def __getattr__(self, name):
            return getattr(self.inner, name)

        def spoil(self, estimate):
            if rng.random() < 0.1:
                return odd(rng)
            return replace(estimate, **{name: odd(rng) for name in chosen})

        def estimate(self, state):
            return self.spoil(self.inner.estimate(state))

        def forecast(self, state, horizon_s):
            return self.spoil(self.inner.forecast(state, horizon_s))

    env = HRCEnv(perception="keypoints", estimator=Mine)
    env.reset(seed=0)
    env.step(np.zeros(6, np.float32))


def meet_shields(rng):
    """A shield that returns something, or takes something else."""
    from hrc_env.env import HRCEnv

    kinds = (
        lambda now, velocities, dt_s: odd(rng),
        lambda now, velocities, dt_s: (odd(rng), {}),
        lambda now, velocities, dt_s: (velocities, {"x": odd(rng)}),
        lambda now, velocities, dt_s: (velocities, odd(rng)),
        lambda now, velocities: (velocities, {}),
        odd(rng),
    )
    env = HRCEnv(perception="none", n_workers=0, shield=kinds[rng.integers(len(kinds))])
    env.reset(seed=0)
    env.step(np.zeros(6, np.float32))


def meet_robots(rng):
    """A robot given directly, with fields that are something else."""
    from hrc_env.scene.robot import ROBOTS, find_robot

    arm = ROBOTS["ur10e_like"]
    values = {each.name: getattr(arm, each.name) for each in fields(arm)} | {"name": "mine"}
    names = [name for name in values if name != "name"]
    for name in rng.choice(names, rng.integers(1, 3), replace=False):
        values[name] = odd(rng)
    find_robot(values if rng.random() < 0.7 else odd(rng))


def meet_trackers(rng):
    """Arguments and images of a tracker of poses."""
    from hrc_env.pipeline.pose_tracker import PoseTracker
    from hrc_env.scene.rig import LAB_CAMERAS, make_cameras

    given = {"cameras": make_cameras(LAB_CAMERAS)[:2], "estimator": "kalman"}
    names = ["cameras", "n_workers", "dt_s", "estimator", "tracker", "detector", "floor_world"]
    if rng.random() < 0.7:
        for name in rng.choice(names, rng.integers(1, 3), replace=False):
            given[name] = odd(rng)
    tracker = PoseTracker(**given)
    try:
        more = {}
        if rng.random() < 0.5:
            name = rng.choice(["dt_s", "rngs", "robot_world"])
            more = {name: odd(rng)}
        kinds = (np.zeros((1080, 1920, 3), np.uint8), np.zeros((540, 960, 3), np.uint8), odd(rng))
        images = [kinds[rng.integers(3)] for _ in range(rng.integers(1, 4))]
        tracker.update(images if rng.random() < 0.8 else odd(rng), **more)
    finally:
        tracker.close()


DOORS = (meet_estimates, meet_shields, meet_robots, meet_trackers)


def meet(first, n, out):
    """Meet some cases; report those that end in a raw error."""
    import warnings

    warnings.simplefilter("ignore")
    for seed in range(first, first + n):
        out.send(("begin", seed, ""))
        rng = np.random.default_rng([seed, 51])
        try:
            DOORS[seed % len(DOORS)](rng)
        except HRCError:
            pass
        except Exception:
            out.send(("raw", seed, traceback.format_exc()[-900:]))
    out.send(("end", -1, ""))


@pytest.mark.slow
def test_everything_that_users_bring_is_taken_or_refused_in_words(weights):
    context, wrong = multiprocessing.get_context("spawn"), []
    for first in range(0, CASES, A_CHILD):
        ours, theirs = context.Pipe(duplex=False)
        child = context.Process(target=meet, args=(first, min(A_CHILD, CASES - first), theirs))
        child.start()
        theirs.close()
        last = first
        try:
            while (message := ours.recv())[0] != "end":
                last = message[1]
                if message[0] == "raw":
                    wrong.append((DOORS[last % len(DOORS)].__name__, last, message[2]))
        except EOFError:
            child.join()
            wrong.append((DOORS[last % len(DOORS)].__name__, last, f"signal {child.exitcode}"))
        child.join()
        assert child.exitcode == 0, (last, child.exitcode)
    assert wrong == []
