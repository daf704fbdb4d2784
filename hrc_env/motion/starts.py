"""How episodes begin: robots apart from people."""

from collections.abc import Callable, Mapping

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats, Ints, JointAngles, Rngs
from hrc_env.geometry import chains
from hrc_env.geometry.chains import SerialChain
from hrc_env.geometry.distances import least_separation
from hrc_env.motion import generator
from hrc_env.worker.body import Body, worker_truth

APART_M = 0.10
"""No robot begins nearer to a worker's true surface than this [m]."""
ROBOT_TRIES, TRIES = 8, 40
"""So often a robot's start is drawn again before workers' are, too; and all together."""


def apart(
    ids: Ints,
    draw: Callable[[Ints], JointAngles],
    motion: generator.MotionState,
    rngs: Rngs,
    chain: SerialChain,
    bodies: Body,
    casts: Mapping[int, generator.Cast] = generator.NOBODY_CAST,
) -> JointAngles:
    """(len(ids), N) where robots of environments `ids` begin, whose workers' motion begins, too.

    Robots are drawn again where that is too near, and after a while workers. `ConfigError` where
    all draws were too near.

    Args:
        draw: of these environments a start each.
        rngs: of the workers, one of each environment of the batch.
        casts: what of the workers is not drawn, by environment.
    """
    generator.reset(motion, ids, rngs, casts)
    q, near = draw(ids), np.arange(len(ids))
    for k in range(TRIES):
        near = near[gap_m(ids[near], q[near], motion, chain, bodies) < APART_M]
        if not len(near):
            return q
        if k >= ROBOT_TRIES:
            generator.reset(motion, ids[near], rngs, casts)
        q[near] = draw(ids[near])
    raise ConfigError(
        f"No start with robot and workers {APART_M} m apart was found in {TRIES} draws: whatever "
        "start_spread_rad, the task's start, the reset's options and what workers do leave open is "
        "nearer."
    )


def draw_near(home_q: JointAngles, spread_rad: Floats, rngs: Rngs) -> JointAngles:
    """Draw joints (len(rngs), N), each within `spread_rad` (N,) of home."""
    angles = [home_q + rng.uniform(-1, 1, len(spread_rad)) * spread_rad for rng in rngs]
    return np.array(angles).reshape(len(rngs), -1)


def gap_m(
    ids: Ints, q: JointAngles, motion: generator.MotionState, chain: SerialChain, bodies: Body
) -> Floats:
    """(len(ids),) true separation of robots at `q` from the nearest of their workers [m]; infinite
    without any."""
    truth = worker_truth(bodies, generator.current(motion, ids))
    arm, radius_m = chains.capsules(chain, q), chain.capsule_radius_m
    gap = least_separation(arm, radius_m, truth.capsules_world, truth.capsule_radius_m)
    return gap.distance_m.min(axis=-1, initial=np.inf)
