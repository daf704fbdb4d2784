"""The loop in which an agent acts."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hrc_env.agents.env_info import Agent, Observation
from hrc_env.core.typing import Bools


class Steppable(Protocol):
    """An environment, or a batch of them, as Gymnasium steps it."""

    def step(self, action: Any, /) -> tuple[Any, Any, Any, Any, Mapping[str, Any]]:
        """Return observation, reward, terminated, truncated and info after an action."""
        ...


@dataclass(frozen=True, slots=True)
class Transition:
    """One control step of an environment, or of a batch, whose arrays begin with (B,)."""

    action: Any
    """The agent's action (..., A)."""
    observation: Observation
    """The observation after the step (..., n)."""
    reward: Any
    """Of the step: a number, or (B,)."""
    terminated: Any
    """Whether the step ended the episode, or (B,)."""
    truncated: Any
    """Whether the time limit did, or (B,)."""
    info: Mapping[str, Any]
    """What the environment says of the step (docs/reference/infos.md)."""
    is_playing: Bools
    """(B,), or () of a single environment: the step belongs to the first episode."""

    @property
    def ends(self) -> Bools:
        """Whether the first episode ends with this step, (B,) or ()."""
        return self.is_playing & np.asarray(np.logical_or(self.terminated, self.truncated))


def rollout(
    env: Steppable, agent: Agent, observation: Observation, n_steps: int | None = None
) -> Iterator[Transition]:
    """Let an agent act until the first episode of every environment has ended.

    Of a batch, environments whose episode has ended are stepped on until all others have ended,
    too; `Transition.is_playing` tells their steps apart.

    Args:
        env: a Gymnasium environment, a vector environment, or anything with their `step`.
        agent: its actions go to `env` as they are.
        observation: the one that `env.reset` has returned.
        n_steps: the greatest number of steps; None: no limit but the environment's own.

    Yields:
        Every step as soon as it was made.
    """
    is_playing, step = None, 0
    while (is_playing is None or is_playing.any()) and step != n_steps:
        action = agent.act(observation)
        observation, reward, terminated, truncated, info = env.step(action)
        if is_playing is None:
            is_playing = np.ones(np.shape(terminated), np.bool_)
        made = Transition(
            action, observation, reward, terminated, truncated, info, is_playing.copy()
        )
        yield made
        is_playing, step = np.asarray(is_playing & ~made.ends), step + 1
