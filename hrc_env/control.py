"""From actions to arm commands: joint velocities directly, or velocities of the tool resolved.

Resolved-rate control: the damped least-squares solution of J qd = v (Wampler 1986,
DOI 10.1109/TSMC.1986.289285; Nakamura and Hanafusa 1986, DOI 10.1115/1.3143764), with what
is left of the joints' freedom pulled towards a rest posture. The damping keeps speeds finite
near singular postures, where the tool then lags behind the command.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.core.errors import ConfigError, check_fields, check_shape, unknown
from hrc_env.core.typing import Floats, JointAngles, JointVelocities, Velocities3
from hrc_env.geometry.chains import SerialChain, jacobian, turning

CONTROLS = ("joint", "tool", "twist")
SINGULAR_M3 = 0.05
"""Manipulability below which the damping of `twist` fades in."""


@dataclass(frozen=True, slots=True)
class ControlConfig:
    """What an action of magnitude one means."""

    joint_speed_share: float = 0.5
    """`joint`: the share of each joint's velocity limit."""
    tool_speed_mps: float = 0.6
    """`tool`, `twist`: the tool point's velocity along each world axis [m/s]."""
    tool_turn_rad_s: float = 1.2
    """`twist`: the tool's turn rate about each world axis [rad/s]."""
    damping: float = 0.07
    """`tool`, `twist`: damping of the least-squares solution [m]."""
    posture_gain_hz: float = 0.8
    """`tool`: how fast the joints return to the rest posture where the tool allows [1/s]."""

    def __post_init__(self) -> None:
        check_fields(self, "be in (0, 1]", "joint_speed_share")
        check_fields(self, "be positive", "tool_speed_mps", "damping", "posture_gain_hz")
        check_fields(self, "be positive", "tool_turn_rad_s")


def n_actions(control: str, chain: SerialChain, grips: bool = False) -> int:
    """Length of an action: one entry per joint, or three for a tool velocity, six for a twist; and
    one for the hand of an arm that has one."""
    if control not in CONTROLS:
        raise unknown("control", control, CONTROLS)
    if control != "joint" and chain.slides.any():
        raise ConfigError(
            f"control={control!r} moves the tool of an arm of hinges; this robot has slides, as "
            'a base that drives has: valid is control="joint", a velocity for each joint.'
        )
    return {"joint": chain.n_joints, "tool": 3, "twist": 6}[control] + grips


def fastest(control: str, chain: SerialChain, config: ControlConfig) -> JointVelocities:
    """(N,) the greatest velocity that an action can ask of each joint [rad/s]."""
    share = config.joint_speed_share if control == "joint" else 1.0
    return share * chain.velocity_limit_rad_s


def checked_action(action: ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Actions as float64, clipped to [-1, 1]; `ConfigError` for other shapes or no numbers."""
    try:
        values = np.asarray(action, np.float64)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"action must be numbers of shape {shape}, got {action!r}.") from error
    check_shape("action", values.shape, shape, "(environments,) joint or tool velocities")
    if not np.isfinite(values).all():
        raise ConfigError(f"action must be finite numbers in [-1, 1], got {values}.")
    return np.minimum(np.maximum(values, -1.0), 1.0)


def joint_command(
    control: str,
    action: Floats,
    q: JointAngles,
    chain: SerialChain,
    q_rest: JointAngles,
    config: ControlConfig,
) -> JointVelocities:
    """(B, N) joint velocities [rad/s] that an action (B, A) in [-1, 1] asks for, of which an entry
    for the hand is no part."""
    if control == "joint":
        return action * fastest(control, chain, config)
    if control == "tool":
        return resolved_rate(chain, q, action * config.tool_speed_mps, q_rest, config)
    scale = np.repeat([config.tool_speed_mps, config.tool_turn_rad_s], 3)
    return resolved_twist(chain, q, action * scale, config)


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
    return _within(qd, chain)


def resolved_twist(
    chain: SerialChain, q: JointAngles, twist_world: Floats, config: ControlConfig
) -> JointVelocities:
    """Joint velocities (..., N) for a velocity and a turn rate of the tool, (..., 6), scaled
    together to their limits; damped only near singular postures, where the tool lags behind."""
    J = np.concatenate([jacobian(chain, q), turning(chain, q)], axis=-2)
    gram = J @ J.swapaxes(-1, -2)
    near = 1.0 - np.sqrt(np.maximum(np.linalg.det(gram), 0.0)) / SINGULAR_M3
    damping = np.square(config.damping * np.clip(near, 0.0, 1.0)) + 1e-9
    solved = np.linalg.solve(gram + damping[..., None, None] * np.eye(6), twist_world[..., None])
    return _within((J.swapaxes(-1, -2) @ solved)[..., 0], chain)


def _within(qd: JointVelocities, chain: SerialChain) -> JointVelocities:
    """Scaled together to the joints' limits."""
    excess = np.max(np.abs(qd) / chain.velocity_limit_rad_s, axis=-1, keepdims=True)
    return qd / np.maximum(excess, 1.0)
