"""The interaction loop of an agent and its environment."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hrc_env.agents.env_info import Agent, Observation
from hrc_env.core.typing import Bools


class Steppable(Protocol):
    """Interface of an environment, or a batch of environments, with Gymnasium's `step`."""

    def step(self, action: Any, /) -> tuple[Any, Any, Any, Any, Mapping[str, Any]]:
        """Take an action and return observation, reward, terminated, truncated and info."""
        ...


@dataclass(frozen=True, slots=True)
class Transition:
    """One control step of an environment, or of a batch of B environments."""

    action: Any
    """Action (..., A) of the agent."""
    observation: Observation
    """Observation (..., n) after the step."""
    reward: Any
    """Reward of the step, a number or (B,)."""
    terminated: Any
    """Whether the step ended the episode by termination, () or (B,)."""
    truncated: Any
    """Whether the step ended the episode by the time limit, () or (B,)."""
    info: Mapping[str, Any]
    """Infos of the step (docs/reference/infos.md)."""
    is_playing: Bools
    """Whether the step belongs to the first episode, () or (B,)."""

    @property
    def ends(self) -> Bools:
        """Whether the first episode ends with this step, () or (B,)."""
        return self.is_playing & np.asarray(np.logical_or(self.terminated, self.truncated))


def rollout(
    env: Steppable, agent: Agent, observation: Observation, n_steps: int | None = None
) -> Iterator[Transition]:
    """Step an environment with an agent until the first episode has ended.

    In a batch, environments whose episode has ended are stepped until all others have ended, too;
    `Transition.is_playing` marks the steps of first episodes.

    Args:
        env: a Gymnasium environment, a vector environment, or any object with their `step`.
        agent: the agent; its actions are passed to `env` unchanged.
        observation: the observation that `env.reset` returned.
        n_steps: maximum number of steps (default: limited only by the environment).

    Yields:
        The transition of each step, as soon as the step is taken.
    """
    is_playing, step = None, 0
    while (is_playing is None or is_playing.any()) and step != n_steps:
        action = agent.act(observation)
        observation, reward, terminated, truncated, info = env.step(action)
        if is_playing is None:
            is_playing = np.ones(np.shape(terminated), np.bool_)
        transition = Transition(
            action, observation, reward, terminated, truncated, info, is_playing.copy()
        )
        yield transition
        is_playing, step = np.asarray(is_playing & ~transition.ends), step + 1
