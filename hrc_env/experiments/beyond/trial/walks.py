"""Workers at work, walked once: every setting is given the same walks of the same seeds."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.records import WorkerMotion
from hrc_env.core.typing import JointAngles
from hrc_env.motion import generator
from hrc_env.scene.build import build
from hrc_env.worker.body import Body, pool, stack

BODIES = "any"
"""Every episode gives each worker one of the baked bodies."""


@dataclass(frozen=True, slots=True)
class Walks:
    """Episodes of the same length, side by side."""

    bodies: Body
    motions: tuple[WorkerMotion, ...]
    """(T) records of arrays (B, W, ...), a control step apart; the first is the beginning."""
    q: JointAngles
    """(B, N) the arm, which rests [rad]."""


@lru_cache(maxsize=1)
def walks_of(scene: str, n_workers: int, seeds: tuple[int, ...], n_steps: int) -> Walks:
    """Workers at their work beside an arm that rests; nobody has a reason to react to it.

    Args:
        scene: a key of `SCENES`.
        n_workers: in every episode.
        seeds: one an episode.
        n_steps: T.
    """
    config, bodies = HRCConfig(), stack(pool(BODIES))
    place = build(config.scene, scene, n_workers, bodies.names)
    everyone = np.arange(len(seeds))
    state = generator.make_state(len(seeds), n_workers, bodies, config.motion, place.grounds)
    rngs = [np.random.default_rng([seed, 0]) for seed in seeds]
    generator.reset(state, everyone, rngs)
    motions = [generator.current(state)]
    for _ in range(n_steps - 1):
        _, motion = generator.advance(state, rngs, config.scene.sim_dt, config.n_substeps)
        motions.append(motion)
    spread = np.array(config.start_spread_rad or place.robot.spread_rad)
    turned = [np.random.default_rng([seed, 1]).uniform(-spread, spread) for seed in seeds]
    return Walks(bodies, tuple(motions), place.home_q + np.stack(turned))
