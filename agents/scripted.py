"""Scripted reaching in a straight line to the goal, optionally slower near people (`Yielding`).

The tool's speed is min(v_max, gain e, sqrt(2 a e)) for a distance e to the goal, converted to joint
velocities by damped least squares (`hrc_env.control`). With `Yielding`, the speed is scaled by the
*estimated* separation from the worker, as motivated in the paper, and the robot moves slowly while
unseen people may be present.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hrc_env.control import resolve_rate
from hrc_env.observations import split

from .env_info import EnvInfo, Observation

Array = NDArray[np.float64]
GAIN_HZ = 4.0
"""Proportional gain of the approach: speed per distance to the goal [1/s]."""
BRAKE_MPS2 = 2.5
"""Deceleration at which the tool can stop at its goal [m/s^2]."""


@dataclass(frozen=True, slots=True)
class Yielding:
    """Parameters of slowing down near people, linearly in the estimated distance."""

    stop_m: float = 0.10
    """Distance below which the robot stands still [m]."""
    full_speed_m: float = 0.60
    """Distance above which the robot moves at full speed [m]."""
    unknown_m_s: float = 0.25
    """Maximum speed of the tool and its load while an unseen worker may be present [m/s]; with 0
    the robot stops."""

    def share(self, gap_m: Array) -> Array:
        """Return the speed factors in [0, 1] for estimated distances [m]."""
        return np.clip((gap_m - self.stop_m) / (self.full_speed_m - self.stop_m), 0.0, 1.0)

    def blind_share(self, terms: dict[str, Array], fastest_m_s: Array) -> Array:
        """Return factors (n,) in [0, 1] on actions, which limit the speed if workers may be unseen.

        Args:
            terms: terms of observations, by name.
            fastest_m_s: maximum speed (n,) of a point of the tool and its load [m/s].
        """
        unknown = (terms["worker_unknown"] > 0.5).any(axis=-1)
        share = np.minimum(self.unknown_m_s / np.maximum(fastest_m_s, 1e-9), 1.0)
        return np.where(unknown, share, 1.0)


def fastest_m_s(velocity: Array, turn: Array, reach_m: float) -> Array:
    """Return the maximum speed (n,) of points within `reach_m` of a moving tool [m/s].

    Args:
        velocity: velocity of the tool (n, 3) [m/s].
        turn: angular velocity of the tool (n, 3) [rad/s].
        reach_m: distance of the farthest point from the tool [m].
    """
    return np.linalg.norm(velocity, axis=1) + reach_m * np.linalg.norm(turn, axis=1)


def speed_m_s(error_m: Array, most_m_s: float) -> Array:
    """Return the speed of a tool at a distance from its goal, limited to `most_m_s` [m/s]."""
    return np.minimum(np.minimum(GAIN_HZ * error_m, np.sqrt(2 * BRAKE_MPS2 * error_m)), most_m_s)


class Reacher:
    """An agent that reaches by resolved-rate control and can slow down near people."""

    def __init__(self, env_info: EnvInfo, yielding: Yielding | None = None) -> None:
        self.env_info, self.yielding = env_info, yielding

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., A) that move the tool straight towards its goal."""
        return self.act_on(split(observation, self.env_info.layout))

    def act_on(self, terms: dict[str, Array]) -> NDArray[np.float32]:
        """Return actions (..., A) for the terms of an observation (`EnvInfo.split`)."""
        velocity, blind = self._compute_tool_velocity(terms["goal_from_tool"]), np.ones(1)
        if self.yielding is not None:
            nearest_m = terms["worker_separation"].min(axis=-1, initial=np.inf)
            velocity = velocity * self.yielding.share(nearest_m)[..., None]
            speed = np.linalg.norm(velocity, axis=-1)
            blind = self.yielding.blind_share(terms, speed)[..., None]
        if self.env_info.control == "tool":
            action = velocity / self.env_info.control_config.tool_speed_m_s
        else:
            q = np.arctan2(terms["joint_angle_sin"], terms["joint_angle_cos"])
            action = self._make_joint_action(q, velocity)
        return (action * blind).astype(np.float32)

    def _compute_tool_velocity(self, goal_from_tool: Array) -> Array:
        error_m = np.linalg.norm(goal_from_tool, axis=-1, keepdims=True)
        speed = speed_m_s(error_m, self.env_info.control_config.tool_speed_m_s)
        return goal_from_tool / np.maximum(error_m, 1e-9) * speed

    def _make_joint_action(self, q: Array, velocity: Array) -> Array:
        info, config = self.env_info, self.env_info.control_config
        qd = resolve_rate(info.chain, q, velocity, info.home_q, config)
        action = qd / (config.joint_speed_share * info.chain.velocity_limit_rad_s)
        return action / np.maximum(np.abs(action).max(-1, keepdims=True), 1.0)
