"""The protocol of agents, and what they know about their environment."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from hrc_env.control import ControlConfig
from hrc_env.core.errors import ConfigError
from hrc_env.geometry.chains import SerialChain
from hrc_env.observations import ObservationLayout, split
from hrc_env.world import Grounds

if TYPE_CHECKING:
    from hrc_env.simulation import Simulation


Observation = NDArray[np.float32] | Mapping[str, NDArray[np.float32]]
"""(..., n), or such arrays by name where goals stand apart."""


class Agent(Protocol):
    """A policy: all that an evaluation asks of it is `act`."""

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., A) in [-1, 1] for observations (..., n).

        They are of one environment or of many; `EnvInfo.split` gives an observation's terms.
        """
        ...


@dataclass(frozen=True, slots=True)
class EnvInfo:
    """What an agent may know beforehand: the robot and how to read an observation."""

    layout: ObservationLayout
    """Which entries of an observation belong to which term, and their scales."""
    chain: SerialChain
    """The robot's kinematics, from its foot to its tool."""
    home_q: NDArray[np.float64]
    """(N,) the robot's pose at rest [rad], of slides [m]."""
    control: str
    """What an action means: "joint", "tool" or "twist"."""
    control_config: ControlConfig
    """The velocities that actions of 1 stand for."""
    n_actions: int
    """Entries of an action."""
    task: str
    """The task's id."""
    map: Grounds
    """Of the place: where things stand, and where people walk and work."""
    goal_size: int = 0
    """Entries of a goal that stands apart from the observation; 0: there is none."""
    images: Mapping[str, tuple[int, int, int]] = field(default_factory=dict)
    """Height, width and channels of the images that stand beside the observation, by name."""

    def split(self, observation: Observation) -> dict[str, NDArray[Any]]:
        """Return an observation's terms by name, in metres, seconds and radians.

        Goals and images are among them.

        Args:
            observation: (..., n), or such arrays by name.
        """
        return split(observation, self.layout)


AgentFactory = Callable[[EnvInfo], Agent]
"""A function that makes an agent for an environment."""


def env_info(env: object) -> EnvInfo:
    """Return what an agent may know of an environment beforehand.

    Args:
        env: a single or vector environment of this package, wrapped or not, or its simulation.

    Raises:
        ConfigError: it is none.
    """
    inner = getattr(env, "unwrapped", env)
    simulation = cast("Simulation", getattr(inner, "simulation", inner))
    if not hasattr(simulation, "chain"):
        raise ConfigError(
            f"env must be an environment of hrc_env or its simulation, got {type(env).__name__}."
        )
    images = simulation.images
    return EnvInfo(
        images={} if images is None else dict.fromkeys(images.names, images.shape),
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
