"""Poses of the workers' true bodies: their joints and capsules, from episodes of several tasks."""

import warnings
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

import hrc_env  # noqa: F401  # registers the environments
from hrc_env.core.typing import Capsules, Floats, Points3
from hrc_env.motion import generator
from hrc_env.worker.body import load_body, worker_truth

TASKS = ("HRCReach-v0", "HRCHandover-v0", "HRCDrywall-v0", "HRCDelivery-v0")
N_EPISODES, N_STEPS, EVERY = 64, 240, 20
"""Number of episodes of each task, their steps, and the interval between poses that are used."""


@dataclass(frozen=True, slots=True)
class Poses:
    """N poses of one body."""

    joints_world: Points3
    """(N, 15, 3) positions of the joints [m]."""
    capsules_world: Capsules
    """(N, S, 2, 3) end points of the body's capsules [m]."""
    radius_m: Floats
    """(S,) radii of the capsules [m]."""


def play(worker: str, seed: int, n_episodes: int = N_EPISODES) -> Poses:
    """Return poses of a worker in all tasks, beside a robot that stands still."""
    joints, capsules = [], []
    for k, task in enumerate(TASKS):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            envs: Any = gymnasium.make_vec(
                task, num_envs=n_episodes, perception="none", config={"worker": worker},
                num_threads=1,
            )  # fmt: skip
        envs.reset(seed=seed + n_episodes * k)
        rest = np.zeros((n_episodes, *envs.single_action_space.shape), np.float32)
        for step in range(N_STEPS):
            envs.step(rest)
            if step % EVERY == 0:
                for part in envs.unwrapped.shards.parts:
                    truth = worker_truth(part.bodies, generator.current(part.motion))
                    joints.append(truth.joints_world[:, 0])
                    capsules.append(truth.capsules_world[:, 0])
        envs.close()
    radius_m = load_body(worker).capsule_radius_m
    return Poses(np.concatenate(joints), np.concatenate(capsules), radius_m)
