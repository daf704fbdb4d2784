"""What an agent is, what it is told about its environment, and the list of agents."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hrc_env.control import ControlConfig
from hrc_env.core.errors import ConfigError, unknown
from hrc_env.geometry.chains import SerialChain
from hrc_env.observations import ObservationLayout
from hrc_env.simulation import Simulation


class Agent(Protocol):
    """A policy."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (..., A) in [-1, 1] for observations (..., n)."""
        ...


@dataclass(frozen=True, slots=True)
class Situation:
    """What an agent may know beforehand: the robot and how to read an observation."""

    layout: ObservationLayout
    chain: SerialChain
    home_q: NDArray[np.float64]
    control: str
    control_config: ControlConfig
    n_actions: int
    task: str
    """The task's id."""


def situation(simulation: Simulation) -> Situation:
    """The situation of an environment's `simulation`."""
    return Situation(
        layout=simulation.layout,
        chain=simulation.chain,
        home_q=simulation.scene.home_q,
        control=simulation.control,
        control_config=simulation.config.control,
        n_actions=simulation.n_actions,
        task=simulation.task.id,
    )


AGENTS = ("random", "scripted", "scripted_slowed")
"""Names of the agents that need no checkpoint."""


def make_agent(name: str, here: Situation, seed: int = 0) -> Agent:
    """An agent by name ("random", "scripted", "scripted_slowed") or from a checkpoint file.

    Raises:
        ConfigError: neither an agent nor a file.
        CheckpointError: a file that does not fit the environment.
        MissingExtraError: a checkpoint, where the learner that reads it is not installed.
    """
    from . import random, scripted  # here: they import this file

    makers: dict[str, Callable[[], Any]] = {
        "random": lambda: random.RandomAgent(here, seed),
        "scripted": lambda: scripted.expert(here),
        "scripted_slowed": lambda: scripted.expert(here, scripted.Yielding()),
    }
    if name in makers:
        return makers[name]()
    if Path(name).suffix == ".zip" or Path(name).exists():
        from . import ppo  # here: torch takes seconds to import, and need not be there

        return ppo.load(Path(name), here)
    error = unknown("agent", name, makers)
    raise ConfigError(
        f"{error} Or the path of a checkpoint that python -m hrc_env train wrote (.zip)."
    )
