"""The contenders of the speed benchmark, which use only public interfaces.

The contenders are single and vector environments, Gymnasium's Reacher, and resets.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

import hrc_env  # noqa: F401  registers the ids
from hrc_env.core.typing import Bools

OURS, PEER = "HRCReach-v0", "Reacher-v5"


@dataclass(frozen=True, slots=True)
class Pace:
    """Number of steps and duration of a run."""

    env_steps: int
    """Number of steps in which an action is executed; steps that only reset an environment are
    excluded.
    """
    seconds: float
    """Duration from the first action until the last info is read, including resets [s]."""


class Single:
    """An environment of `gymnasium.make` that is reset when its episode ends."""

    def __init__(self, id: str, **arguments: Any) -> None:
        self.env: Any = gymnasium.make(id, **arguments)
        self.episode_env_steps: int = self.env.spec.max_episode_steps
        self.env.reset(seed=0)

    def run(self, n_episodes: int) -> Pace:
        """Take random actions for a number of whole episodes, and read all infos."""
        actions = _actions(self.env, n_episodes * self.episode_env_steps)
        started_s = time.perf_counter()
        for action in actions:
            _, _, terminated, truncated, info = self.env.step(action)
            read(info)
            if terminated or truncated:
                read(self.env.reset()[1])
        return Pace(len(actions), time.perf_counter() - started_s)

    def close(self) -> None:
        """Close the environment."""
        self.env.close()


class Vector:
    """A vector environment of `gymnasium.make_vec`, which resets in the step after an episode."""

    def __init__(self, id: str, num_envs: int, **arguments: Any) -> None:
        self.env: Any = gymnasium.make_vec(id, num_envs, **arguments)
        self.num_envs, self.episode_steps = num_envs, self.env.spec.max_episode_steps
        self.episode_env_steps = num_envs * self.episode_steps
        self.env.reset(seed=0)
        self._ended: Bools = np.zeros(num_envs, bool)

    def run(self, n_episodes: int) -> Pace:
        """Take random actions for a number of whole episodes, and read all infos."""
        return self.run_steps(n_episodes * (self.episode_steps + 1))

    def run_steps(self, n_steps: int) -> Pace:
        """Take random actions for a number of vector steps, which continue the current episodes."""
        actions = _actions(self.env, n_steps)
        n_starts, ended = 0, self._ended
        started_s = time.perf_counter()
        for action in actions:
            n_starts += int(ended.sum())
            _, _, terminated, truncated, info = self.env.step(action)
            read(info)
            ended = terminated | truncated
        seconds, self._ended = time.perf_counter() - started_s, ended
        return Pace(len(actions) * self.num_envs - n_starts, seconds)

    def close(self) -> None:
        """Close the environment."""
        self.env.close()


SOME, MANY = 8, 64


class Starts:
    """Resets of a single environment, and of some of 64 batched environments in one thread."""

    def __init__(self, id: str = OURS) -> None:
        self.single = gymnasium.make(id, perception="keypoints")
        self.vector = gymnasium.make_vec(id, MANY, perception="keypoints", num_threads=1)
        self.single.reset(seed=0)
        self.vector.reset(seed=0)

    def run(self, n_resets: int) -> dict[str, float]:
        """Measure the mean time to reset one environment, and 8 of 64 batched ones [ms]."""
        started_s = time.perf_counter()
        for _ in range(n_resets):
            self.single.reset()
        between_s = time.perf_counter()
        for k in range(n_resets):
            mask = (np.arange(MANY) + k) % (MANY // SOME) == 0
            self.vector.reset(options={"reset_mask": mask})
        seconds = between_s - started_s, time.perf_counter() - between_s
        names = "1_of_1", f"{SOME}_of_{MANY}"
        return {name: 1e3 * each / n_resets for name, each in zip(names, seconds, strict=True)}

    def close(self) -> None:
        """Close the environments."""
        self.single.close()
        self.vector.close()


Contender = Single | Vector
"""A single or vector environment that runs a given number of episodes."""


def read(info: Mapping[str, Any]) -> None:
    """Read all values of an info dictionary, as logging would."""
    for name in info:
        _ = info[name]


def _actions(env: Any, n: int) -> Any:
    shape = (n, *env.action_space.shape)
    return np.random.default_rng(0).uniform(-1, 1, shape).astype(np.float32)
