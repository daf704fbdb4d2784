"""A reacher without learning: straight to the goal, slower near people if asked to be.

The tool's speed is min(v_max, gain e, sqrt(2 a e)) for a distance e to the goal, resolved to
joint velocities by damped least squares (`hrc_env.control`). With `Yielding`, the speed is
scaled by the *estimated* separation from the worker, as in the paper's motivation: a robot
that slows down for people it sees.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hrc_env.control import resolved_rate
from hrc_env.observations import split

from .env_info import EnvInfo, Observation

GAIN_HZ = 4.0
"""Approach speed per distance [1/s]."""
BRAKE_MPS2 = 2.5
"""Deceleration that the speed allows for [m/s^2]."""


@dataclass(frozen=True, slots=True)
class Yielding:
    """How a robot slows down with the estimated gap: linearly between two distances."""

    stop_m: float = 0.10
    """Stand still below this gap [m]."""
    full_speed_m: float = 0.60
    """Full speed above it [m]."""

    def share(self, gap_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Share of full speed in [0, 1] for gaps [m]."""
        return np.clip((gap_m - self.stop_m) / (self.full_speed_m - self.stop_m), 0.0, 1.0)


def speed_m_s(error_m: NDArray[np.float64], most_m_s: float) -> NDArray[np.float64]:
    """How fast a tool goes that has so far to go [m]."""
    return np.minimum(np.minimum(GAIN_HZ * error_m, np.sqrt(2 * BRAKE_MPS2 * error_m)), most_m_s)


class Reacher:
    """Resolved-rate reaching, with or without yielding."""

    def __init__(self, env_info: EnvInfo, yielding: Yielding | None = None) -> None:
        self.env_info, self.yielding = env_info, yielding

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Actions (..., A) that move the tool straight towards its goal."""
        return self.act_on(split(observation, self.env_info.layout))

    def act_on(self, terms: dict[str, NDArray[np.float64]]) -> NDArray[np.float32]:
        """The same for an observation by its terms."""
        velocity = self._tool_velocity(terms["goal_from_tool"])
        if self.yielding is not None:
            nearest_m = terms["worker_separation"].min(axis=-1, initial=np.inf)
            velocity = velocity * self.yielding.share(nearest_m)[..., None]
        if self.env_info.control == "tool":
            return (velocity / self.env_info.control_config.tool_speed_mps).astype(np.float32)
        q = np.arctan2(terms["joint_angle_sin"], terms["joint_angle_cos"])
        return self._joint_action(q, velocity).astype(np.float32)

    def _tool_velocity(self, goal_from_tool: NDArray[np.float64]) -> NDArray[np.float64]:
        error_m = np.linalg.norm(goal_from_tool, axis=-1, keepdims=True)
        speed = speed_m_s(error_m, self.env_info.control_config.tool_speed_mps)
        return goal_from_tool / np.maximum(error_m, 1e-9) * speed

    def _joint_action(
        self, q: NDArray[np.float64], velocity: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        info, config = self.env_info, self.env_info.control_config
        qd = resolved_rate(info.chain, q, velocity, info.home_q, config)
        action = qd / (config.joint_speed_share * info.chain.velocity_limit_rad_s)
        return action / np.maximum(np.abs(action).max(-1, keepdims=True), 1.0)
