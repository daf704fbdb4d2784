"""The walk of the site study, from workplace to workplace, behind and past obstacles."""

import numpy as np

from hrc_env.core.batching import rows
from hrc_env.core.records import WorkerMotion
from hrc_env.experiments.recording import concatenate
from hrc_env.motion import generator
from hrc_env.motion.config import MotionConfig
from hrc_env.motion.schedule import Job
from hrc_env.scene.build import Scene
from hrc_env.worker.body import load_body
from hrc_env.world import WORKPLACE_KINDS

PASSING = MotionConfig(
    near_probability=0.0,
    dwell_s=(0.0, 0.4),
    near_pause_s=(0.1, 0.4),
    away_pause_s=(0.1, 0.4),
    jobs=tuple(Job(f"pass the {kind}", "stand", kind, (), 1.0) for kind in WORKPLACE_KINDS),
    people=generator.PEOPLE["unaware"],
)
"""Motion settings with which workers leave each workplace as soon as they reach it.

The values are assumptions, because the paper states only that the worker walked.
"""


def walk(scene: Scene, seed: int, n_frames: int, dt_s: float) -> WorkerMotion:
    """Return a worker's walk (T, 1, S, ...) at intervals of `dt_s`."""
    state = generator.make_state(1, 1, load_body(scene.bodies[0]), PASSING, scene.grounds)
    rngs = [np.random.default_rng(seed)]
    generator.reset(state, np.arange(1), rngs)
    frames = []
    for _ in range(n_frames):
        generator.advance(state, rngs, dt_s, 1)
        frames.append(rows(generator.current(state), np.arange(1)))
    return concatenate(frames)
