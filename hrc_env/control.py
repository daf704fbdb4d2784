"""From actions to arm commands: joint velocities directly, or tool velocities resolved.

Resolved-rate control: the damped least-squares solution of J qd = v (Wampler 1986,
DOI 10.1109/TSMC.1986.289285; Nakamura and Hanafusa 1986, DOI 10.1115/1.3143764), with what
is left of the joints' freedom pulled towards a rest posture. The damping keeps speeds finite
near singular postures, where the tool then lags behind the command.
"""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import check_fields, unknown
from hrc_env.core.typing import Floats, JointAngles, JointVelocities, Velocities3
from hrc_env.geometry.chains import SerialChain, jacobian

CONTROLS = ("joint", "tool")


@dataclass(frozen=True, slots=True)
class ControlConfig:
    """What an action of magnitude one means."""

    joint_speed_share: float = 0.5
    """`joint`: the share of each joint's velocity limit."""
    tool_speed_mps: float = 0.6
    """`tool`: the tool point's velocity along each world axis [m/s]."""
    damping: float = 0.07
    """`tool`: damping of the least-squares solution [m]."""
    posture_gain_hz: float = 0.8
    """`tool`: how fast the joints return to the rest posture where the tool allows [1/s]."""

    def __post_init__(self) -> None:
        check_fields(self, "be in (0, 1]", "joint_speed_share")
        check_fields(self, "be positive", "tool_speed_mps", "damping", "posture_gain_hz")


def n_actions(control: str, chain: SerialChain) -> int:
    """Length of an action: one entry per joint, or three for a tool velocity."""
    if control not in CONTROLS:
        raise unknown("control", control, CONTROLS)
    return len(chain.velocity_limit_rad_s) if control == "joint" else 3


def joint_command(
    control: str,
    action: Floats,
    q: JointAngles,
    chain: SerialChain,
    q_rest: JointAngles,
    config: ControlConfig,
) -> JointVelocities:
    """(B, N) joint velocities [rad/s] that an action (B, A) in [-1, 1] asks for."""
    if control == "joint":
        return action * (config.joint_speed_share * chain.velocity_limit_rad_s)
    return resolved_rate(chain, q, action * config.tool_speed_mps, q_rest, config)


def resolved_rate(
    chain: SerialChain,
    q: JointAngles,
    tool_velocity_world: Velocities3,
    q_rest: JointAngles,
    config: ControlConfig,
) -> JointVelocities:
    """Joint velocities (..., N) for a tool velocity (..., 3), scaled together to their limits."""
    J = jacobian(chain, q)
    pull = config.posture_gain_hz * (q_rest - q)
    pull[..., 0] = 0.0  # the first joint points the arm at its goal: leave it free
    wanted = tool_velocity_world - (J @ pull[..., None])[..., 0]
    gram = J @ J.swapaxes(-1, -2) + config.damping**2 * np.eye(3)
    solved = np.linalg.solve(gram, wanted[..., None])
    qd = pull + (J.swapaxes(-1, -2) @ solved)[..., 0]
    excess = np.max(np.abs(qd) / chain.velocity_limit_rad_s, axis=-1, keepdims=True)
    return qd / np.maximum(excess, 1.0)
