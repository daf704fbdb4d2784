"""Who is timed, by public doors: the environment in all sizes, Gymnasium's Reacher, resets."""

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
    """What a run came to."""

    env_steps: int
    """Steps in which an action was obeyed; a step that only starts an episode is none."""
    seconds: float
    """From the first action to the last info, resets inside."""


class Single:
    """`gymnasium.make`: one environment, reset where its episode ends."""

    def __init__(self, id: str, **arguments: Any) -> None:
        self.env: Any = gymnasium.make(id, **arguments)
        self.episode_env_steps: int = self.env.spec.max_episode_steps
        self.env.reset(seed=0)

    def run(self, n_episodes: int) -> Pace:
        """Random actions for whole episodes; every info is read."""
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
    """`gymnasium.make_vec`: episodes start anew in the step after their end, its default."""

    def __init__(self, id: str, num_envs: int, **arguments: Any) -> None:
        self.env: Any = gymnasium.make_vec(id, num_envs, **arguments)
        self.num_envs, self.episode_steps = num_envs, self.env.spec.max_episode_steps
        self.episode_env_steps = num_envs * self.episode_steps
        self.env.reset(seed=0)
        self._ended: Bools = np.zeros(num_envs, bool)

    def run(self, n_episodes: int) -> Pace:
        """Random actions for whole episodes; every info is read."""
        return self.run_steps(n_episodes * (self.episode_steps + 1))

    def run_steps(self, n_steps: int) -> Pace:
        """The same for so many steps of the vector, wherever its episodes are."""
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
    """A single environment and a vector of 64 on one thread, both at level `keypoints`."""

    def __init__(self, id: str = OURS) -> None:
        self.single = gymnasium.make(id, perception="keypoints")
        self.vector = gymnasium.make_vec(id, MANY, perception="keypoints", num_threads=1)
        self.single.reset(seed=0)
        self.vector.reset(seed=0)

    def run(self, n_resets: int) -> dict[str, float]:
        """Milliseconds of `reset()` of one, and of 8 of 64 (who they are goes round); means."""
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
"""What can be run for some episodes, again and again."""


def read(info: Mapping[str, Any]) -> None:
    """Ask for every value, as whoever logs infos does."""
    for name in info:
        _ = info[name]


def _actions(env: Any, n: int) -> Any:
    shape = (n, *env.action_space.shape)
    return np.random.default_rng(0).uniform(-1, 1, shape).astype(np.float32)
