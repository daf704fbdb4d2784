"""Workers set going, for the tests to look at."""

from types import SimpleNamespace

import numpy as np

from hrc_env.motion import generator
from hrc_env.motion import state as st
from hrc_env.motion.blending import place_standing
from hrc_env.motion.paths import lay_path
from hrc_env.motion.points import Point
from hrc_env.motion.walk import plan_walk
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


def standing(state, x_m=0.0, yaw_rad=0.0):
    """The first worker at a point of the x axis, with nothing planned."""
    me = state.workers[0, 0]
    me["load_prop"] = me["step_count"] = me["undo_at"] = 0
    place_standing(x_m, 0.0, yaw_rad, me)
    return me


def begin(me, activity, lasts):
    """Let the worker do what was planned."""
    me["activity"], me["time_s"], me["duration_s"], me["blend"] = activity, 0.0, lasts, 0.0


def walk_straight(speed_m_s, length_m=6.0, dt_s=0.005):
    """A walk along +x, alone: its plan, footprints and motion."""
    state, rngs = started(1)
    me = standing(state)
    lay_path(Point(0.0, 0.0), np.zeros((0, 3)), Point(length_m, 0.0), me)
    begin(me, st.WALK, plan_walk(0.0, speed_m_s, me))
    motion = watched(state, rngs, dt_s, int(me["duration_s"] / dt_s) - 1)
    return SimpleNamespace(motion=motion, plan=me, prints=me["footprints"], dt_s=dt_s)
