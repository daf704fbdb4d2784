"""Workers set going, for the tests to look at."""

from types import SimpleNamespace

import numpy as np

from hrc_env.motion import generator
from hrc_env.motion import plans as pl
from hrc_env.motion.posture import STANCE_HALF_WIDTH_M
from hrc_env.motion.walk import footprint, plan_walk
from hrc_env.worker.body import load_body

DT_S = 0.02


def joined(motions):
    """Motions one after another along time: arrays (B, T, W, ...)."""
    names = ("position_world", "quaternion_wxyz", "velocity_world", "angular_velocity_world")
    return SimpleNamespace(
        **{name: np.stack([getattr(m, name) for m in motions], 1) for name in names}
    )


def watched(state, rngs, dt_s, n_steps):
    """The motion, looked at after every step."""
    return joined([generator.advance(state, rngs, dt_s, 1)[1] for _ in range(n_steps)])


def started(batch, n_workers=1, seed=0, config=None):
    """A state after reset, and its generators."""
    config = config or generator.MotionConfig()
    state = generator.make_state(batch, n_workers, load_body(), config)
    rngs = [np.random.default_rng([seed, b]) for b in range(batch)]
    generator.reset(state, np.arange(batch), rngs)
    return state, rngs


def walk_straight(speed_m_s, length_m=6.0, dt_s=0.005):
    """A walk along +x, alone: its plan, footprints and motion."""
    state, rngs = started(1)
    plan, prints, stance = state.plan[0, 0], state.prints[0, 0], state.stance[0, 0]
    size = state.anatomy.size[0]
    plan[:] = 0.0
    for side in range(2):
        footprint(side, 0.0, 0.0, 0.0, STANCE_HALF_WIDTH_M, size, stance[side])
    start, via, end = (0.0, 0.0, 0.0), np.zeros((0, 3)), (length_m, 0.0, 0.0)
    lasts = plan_walk(start, via, end, speed_m_s, plan, prints, stance, size)
    state.activity[:], state.time_s[:], state.duration_s[:] = pl.WALK, 0.0, lasts
    state.offset[:] = 0.0
    motion = watched(state, rngs, dt_s, int(lasts / dt_s) - 1)
    return SimpleNamespace(motion=motion, plan=plan, prints=prints, dt_s=dt_s)
