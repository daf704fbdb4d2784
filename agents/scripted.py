"""A reacher without learning: straight to the goal, slower near people with `Yielding`.

The tool's speed is min(v_max, gain e, sqrt(2 a e)) for a distance e to the goal, resolved to
joint velocities by damped least squares (`hrc_env.control`). With `Yielding`, the speed is
scaled by the *estimated* separation from the worker, as in the paper's motivation: a robot
that slows down for people it sees, and is slow while it does not see whether somebody is there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hrc_env.control import resolve_rate
from hrc_env.observations import split

from .env_info import EnvInfo, Observation

Array = NDArray[np.float64]
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
    unknown_m_s: float = 0.25
    """Fastest that the tool and what it holds are while somebody may be there whom nobody sees
    [m/s]; 0: stand still."""

    def share(self, gap_m: Array) -> Array:
        """Share of full speed in [0, 1] for gaps [m]."""
        return np.clip((gap_m - self.stop_m) / (self.full_speed_m - self.stop_m), 0.0, 1.0)

    def blind_share(self, terms: dict[str, Array], fastest_m_s: Array) -> Array:
        """(...,) share of an action in [0, 1], for observations by their terms and for how fast its
        fastest point would be [m/s]."""
        unknown = (terms["worker_unknown"] > 0.5).any(axis=-1)
        share = np.minimum(self.unknown_m_s / np.maximum(fastest_m_s, 1e-9), 1.0)
        return np.where(unknown, share, 1.0)


def fastest_m_s(velocity: Array, turn: Array, reach_m: float) -> Array:
    """(n,) of the points within a reach of a tool that moves and turns so, (n, 3) each."""
    return np.linalg.norm(velocity, axis=1) + reach_m * np.linalg.norm(turn, axis=1)


def speed_m_s(error_m: Array, most_m_s: float) -> Array:
    """Return the speed of a tool at a distance from its goal [m/s]."""
    return np.minimum(np.minimum(GAIN_HZ * error_m, np.sqrt(2 * BRAKE_MPS2 * error_m)), most_m_s)


class Reacher:
    """Resolved-rate reaching, with or without yielding."""

    def __init__(self, env_info: EnvInfo, yielding: Yielding | None = None) -> None:
        self.env_info, self.yielding = env_info, yielding

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Actions (..., A) that move the tool straight towards its goal."""
        return self.act_on(split(observation, self.env_info.layout))

    def act_on(self, terms: dict[str, Array]) -> NDArray[np.float32]:
        """The same for an observation by its terms."""
        velocity, blind = self._tool_velocity(terms["goal_from_tool"]), np.ones(1)
        if self.yielding is not None:
            nearest_m = terms["worker_separation"].min(axis=-1, initial=np.inf)
            velocity = velocity * self.yielding.share(nearest_m)[..., None]
            speed = np.linalg.norm(velocity, axis=-1)
            blind = self.yielding.blind_share(terms, speed)[..., None]
        if self.env_info.control == "tool":
            action = velocity / self.env_info.control_config.tool_speed_mps
        else:
            q = np.arctan2(terms["joint_angle_sin"], terms["joint_angle_cos"])
            action = self._joint_action(q, velocity)
        return (action * blind).astype(np.float32)

    def _tool_velocity(self, goal_from_tool: Array) -> Array:
        error_m = np.linalg.norm(goal_from_tool, axis=-1, keepdims=True)
        speed = speed_m_s(error_m, self.env_info.control_config.tool_speed_mps)
        return goal_from_tool / np.maximum(error_m, 1e-9) * speed

    def _joint_action(self, q: Array, velocity: Array) -> Array:
        info, config = self.env_info, self.env_info.control_config
        qd = resolve_rate(info.chain, q, velocity, info.home_q, config)
        action = qd / (config.joint_speed_share * info.chain.velocity_limit_rad_s)
        return action / np.maximum(np.abs(action).max(-1, keepdims=True), 1.0)
