"""The interface of agents, and the information that they receive about an environment."""

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
"""An observation (..., n), or arrays by name if goals or images are separate."""


class Agent(Protocol):
    """Interface of a policy; `act` is its only required method."""

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., A) in [-1, 1] for observations (..., n).

        Observations come from one or several environments. `EnvInfo.split` splits them into terms.
        """
        ...


@dataclass(frozen=True, slots=True)
class EnvInfo:
    """Information that an agent receives in advance: robot, actions, observations and map."""

    layout: ObservationLayout
    """Layout of the observation: the entries of each term, and their scales."""
    chain: SerialChain
    """Kinematic chain of the robot, from its base to its tool."""
    home_q: NDArray[np.float64]
    """Rest configuration of the robot (N,) [rad; slides: m]."""
    control: str
    """Control mode, which defines the meaning of actions: "joint", "tool" or "twist"."""
    control_config: ControlConfig
    """Configuration of the control, with the velocities to which actions of 1 correspond."""
    n_actions: int
    """Number of entries of an action."""
    task: str
    """Id of the task."""
    map: Grounds
    """Map of the scene: obstacles, and areas where people walk and work."""
    goal_size: int = 0
    """Number of entries of a goal that is separate from the observation, or 0 if there is none."""
    images: Mapping[str, tuple[int, int, int]] = field(default_factory=dict)
    """Shapes (height, width, channels) of the images in an observation, by name."""
    forecast_s: tuple[float, ...] = ()
    """Horizons of the forecasts of the workers' joints in the observation [s]."""

    def split(self, observation: Observation) -> dict[str, NDArray[Any]]:
        """Return the terms of an observation by name, in metres, seconds and radians.

        The result includes separate goals and images.

        Args:
            observation: array (..., n), or arrays by name.
        """
        return split(observation, self.layout)


AgentFactory = Callable[[EnvInfo], Agent]
"""A function that makes an agent for an environment."""


def env_info(env: object) -> EnvInfo:
    """Return the information that an agent receives in advance about an environment.

    Args:
        env: a single or vector environment of this package, wrapped or not, or its simulation.

    Raises:
        ConfigError: `env` is none of these.
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
        forecast_s=simulation.config.forecast_s,
    )
