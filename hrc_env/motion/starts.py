"""Initial states of episodes in which the robots keep a distance from people."""

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
"""Minimum distance of a robot's initial pose from a worker's true surface [m]."""
ROBOT_TRIES, TRIES = 8, 40
"""Number of robot starts sampled before the workers are resampled, too; total number of samples."""


def begin_apart(
    ids: Ints,
    draw: Callable[[Ints], JointAngles],
    motion: generator.MotionState,
    rngs: Rngs,
    chain: SerialChain,
    bodies: Body,
    casts: Mapping[int, generator.Cast] = generator.NOBODY_CAST,
) -> JointAngles:
    """Begin episodes in which the robots start at a distance from the workers.

    A start of a robot that is too close to a worker is sampled again; after `ROBOT_TRIES` samples,
    the workers are sampled again, too.

    Args:
        ids: environments (N,).
        draw: function that returns initial joint angles for given environments [rad].
        motion: state of the workers, which is reset.
        rngs: random number generators of the workers, one for each environment of the batch.
        chain: kinematic chain of the robot.
        bodies: measurements of the workers' bodies.
        casts: prescribed workers and activities, by environment.

    Returns:
        Joint angles (N, n_joints) at which the robots start [rad].

    Raises:
        ConfigError: a robot was too close to a worker in all samples.
    """
    generator.reset(motion, ids, rngs, casts)
    q, near = draw(ids), np.arange(len(ids))
    for k in range(TRIES):
        near = near[measure_gap_m(ids[near], q[near], motion, chain, bodies) < APART_M]
        if not len(near):
            return q
        if k >= ROBOT_TRIES:
            generator.reset(motion, ids[near], rngs, casts)
        q[near] = draw(ids[near])
    raise ConfigError(
        f"No start with robot and workers {APART_M} m apart was found in {TRIES} draws: "
        "start_spread_rad, the task's start, the options of the reset and the workers' activities "
        "permit only closer ones."
    )


def draw_near(home_q: JointAngles, spread_rad: Floats, rngs: Rngs) -> JointAngles:
    """Sample joint angles (n_rngs, N) uniformly within `spread_rad` (N,) of `home_q` [rad]."""
    angles = [home_q + rng.uniform(-1, 1, len(spread_rad)) * spread_rad for rng in rngs]
    return np.array(angles).reshape(len(rngs), -1)


def measure_gap_m(
    ids: Ints, q: JointAngles, motion: generator.MotionState, chain: SerialChain, bodies: Body
) -> Floats:
    """Return the true distance (N,) of each robot from the nearest worker [m].

    It is infinite if there is no worker.

    Args:
        ids: environments (N,).
        q: joint angles (N, n_joints) of the robots [rad].
        motion: state of the workers.
        chain: kinematic chain of the robot.
        bodies: measurements of the workers' bodies.
    """
    truth = worker_truth(bodies, generator.current(motion, ids))
    arm, radius_m = chains.capsules(chain, q), chain.capsule_radius_m
    gap = least_separation(arm, radius_m, truth.capsules_world, truth.capsule_radius_m)
    return gap.distance_m.min(axis=-1, initial=np.inf)
