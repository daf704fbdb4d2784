"""Environments of an RLlib runner, in different phases of episodes and with normalized rewards."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper
from gymnasium.wrappers.utils import RunningMeanStd
from numpy.typing import NDArray

from hrc_env.core.errors import HRCError
from hrc_env.core.typing import Floats
from hrc_env.evaluation.sums import EpisodeSums
from hrc_env.simulation import Simulation
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.vector.member import info_of

LARGEST_REWARD = 10.0
"""Absolute value to which normalized rewards are clipped, as in `VecNormalize`."""


def make_envs(num_envs: int, keywords: Mapping[str, Any]) -> VectorEnv[Any, Any, Any]:
    """Create environments that are stepped together in one thread.

    Args:
        num_envs: number of environments.
        keywords: keyword arguments of `gymnasium.make`, with the task under the key "task". At the
            perception level `pixels`, which cannot be batched, the environments are stepped one
            after the other.
    """
    known = {name: value for name, value in keywords.items() if name != "num_threads"}
    if known.get("perception") != "pixels":
        return HRCVectorEnv(num_envs, num_threads=1, **known)
    task = known.pop("task")
    id_ = task if isinstance(task, str) else task.id
    return gymnasium.make_vec(id_, num_envs, vectorization_mode="sync", **known)


def try_environment(keywords: Mapping[str, Any]) -> None:
    """Create an environment and step it once; raise `HRCError` if a requirement is missing."""
    with closing(make_envs(1, keywords)) as env:
        env.reset(seed=0)
        env.step(env.action_space.sample())


@contextmanager
def reported_errors(report: Callable[[str], object]) -> Iterator[None]:
    """Report the message of an exception within the context, and re-raise the exception.

    The exception may come from a user's custom task or estimator.
    """
    try:
        yield
    except Exception as error:
        text = str(error).rstrip(".")
        report(text if isinstance(error, HRCError) else f"{type(error).__name__}: {text}")
        raise


class RunnerEnv(VectorWrapper[Any, Any, Any, Any, Any]):
    """Environments with normalized rewards and statistics of finished episodes instead of infos.

    Rewards are divided by the running standard deviation of the discounted return, as in
    `VecNormalize` of Stable-Baselines3. If `env` is an `HRCVectorEnv`, its first episodes end early
    at random times, to cover all phases of an episode in a short rollout.

    Args:
        env: environments that are reset in the step after the end of an episode.
        gamma: discount factor per step.
        report: function that receives the message of an error in a reset or a step.
    """

    def __init__(
        self,
        env: VectorEnv[Any, Any, Any],
        gamma: float,
        report: Callable[[str], object] = lambda error: None,
    ) -> None:
        super().__init__(env)
        self.gamma, self._report = gamma, report
        self.scale = RunningMeanStd()
        """Running statistics of discounted returns."""
        self.proximity: float | None = None
        """Proximity weight that was last set, or None for the weight of the configuration."""
        self.finished: list[dict[str, float]] = []
        """Statistics of the episodes that ended since the last `take_finished`."""
        self._sums = EpisodeSums(self.num_envs)
        self._returns: Floats = np.zeros(self.num_envs)
        self._ended = np.zeros(self.num_envs, np.bool_)

    @property
    def simulation(self) -> Simulation:
        """Simulation of the environments; the first one if there are several."""
        if isinstance(self.env, HRCVectorEnv):
            return self.env.simulation
        return self.env.get_attr("simulation")[0]  # type: ignore[attr-defined]  # SyncVectorEnv

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        """Start all episodes.

        Args:
            seed: seed of the runner; the seed of environment k is seed * num_envs + k.
            options: ignored; except at level `pixels`, episodes start in random phases.
        """
        first_seed = None if seed is None else seed * self.num_envs
        if isinstance(self.env, HRCVectorEnv):
            limit, phases = self.env.max_episode_steps, np.random.default_rng(first_seed)
            options = {"elapsed_steps": phases.integers(limit, size=self.num_envs)}
        with reported_errors(self._report):
            observation, _ = self.env.reset(seed=first_seed, options=options)
        self._ended[:], self._returns[:] = False, 0.0
        self._sums.begin(np.arange(self.num_envs))
        return observation, {}

    def step(self, actions: NDArray[Any]) -> tuple[Any, Floats, Any, Any, dict[str, Any]]:
        """Step all environments; those with a finished episode are reset instead."""
        with reported_errors(self._report):
            observation, reward, terminated, truncated, infos = self.env.step(actions)
        self._sums.add(reward, infos)
        self._sums.begin(np.flatnonzero(self._ended))
        self._returns = np.where(self._ended, 0.0, self._returns * self.gamma + reward)
        if not self._ended.all():  # their step is a reset
            self.scale.update(self._returns[~self._ended])
        scaled = np.clip(reward / np.sqrt(self.scale.var + 1e-8), -LARGEST_REWARD, LARGEST_REWARD)
        self._ended = np.logical_or(terminated, truncated)
        for b in np.flatnonzero(self._ended).tolist():
            task, dt_s = self.simulation.task, self.simulation.config.ctrl_dt
            self.finished.append(self._sums.summarize(b, info_of(infos, b), task, dt_s))
        return observation, scaled, terminated, truncated, {}

    def take_finished(self) -> list[dict[str, float]]:
        """Return the statistics of episodes that ended since the last call."""
        taken, self.finished = self.finished, []
        return taken

    def weigh_proximity(self, weight: float) -> None:
        """Set the weight of the reward's proximity term, starting with the next step."""
        self.proximity = weight
        weights = replace(self.simulation.config.reward, proximity=weight)
        if isinstance(self.env, HRCVectorEnv):
            self.env.set_reward(weights)
        else:
            self.env.call("set_reward", weights)  # type: ignore[attr-defined]  # SyncVectorEnv

    def rewards_state(self) -> tuple[RunningMeanStd, float | None]:
        """Return the reward-normalization statistics and the last proximity weight that was set."""
        return self.scale, self.proximity

    def take_rewards_state(self, scale: RunningMeanStd, proximity: float | None = None) -> None:
        """Adopt the reward-normalization statistics and, if given, the weight of another runner."""
        self.scale = scale
        if proximity is not None:
            self.weigh_proximity(proximity)
