"""The protocol of agents, and what they know about their environment."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from hrc_env.control import ControlConfig
from hrc_env.geometry.chains import SerialChain
from hrc_env.observations import ObservationLayout
from hrc_env.world import Grounds

if TYPE_CHECKING:
    from hrc_env.simulation import Simulation


Observation = NDArray[np.float32] | Mapping[str, NDArray[np.float32]]
"""(..., n), or such arrays by name where goals stand apart."""


class Agent(Protocol):
    """A policy."""

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Actions (..., A) in [-1, 1] for observations (..., n)."""
        ...


@dataclass(frozen=True, slots=True)
class EnvInfo:
    """What an agent may know beforehand: the robot and how to read an observation."""

    layout: ObservationLayout
    chain: SerialChain
    home_q: NDArray[np.float64]
    control: str
    control_config: ControlConfig
    n_actions: int
    task: str
    """The task's id."""
    map: Grounds
    """Of the place: where things stand, and where people walk and work."""
    goal_size: int = 0
    """Entries of a goal that stands apart from the observation; 0: there is none."""


def env_info(simulation: "Simulation") -> EnvInfo:
    """That of an environment's `simulation`."""
    return EnvInfo(
        layout=simulation.layout,
        chain=simulation.chain,
        home_q=simulation.scene.home_q,
        control=simulation.control,
        control_config=simulation.config.control,
        n_actions=simulation.n_actions,
        task=simulation.task.id,
        map=simulation.scene.map,
        goal_size=0 if simulation.task.goal is None else simulation.task.goal.size,
    )
