"""From actions to arm commands: joint velocities directly, or velocities of the tool resolved.

Resolved-rate control: the damped least-squares solution of J qd = v (Wampler 1986,
DOI 10.1109/TSMC.1986.289285; Nakamura and Hanafusa 1986, DOI 10.1115/1.3143764), with what
is left of the joints' freedom pulled towards a rest posture. The damping keeps speeds finite
near singular postures, where the tool then lags behind the command.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.core.batching import flat
from hrc_env.core.errors import ConfigError, check_fields, check_shape, unknown
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, JointAngles, JointVelocities, Velocities3
from hrc_env.geometry.chains import SerialChain, angular_jacobian, jacobian

MEANINGS = {
    "joint": "velocities of its joints",
    "tool": "a velocity of its tool",
    "twist": "velocity and turn rate of its tool",
}
"""Meaning of an action, without the entry of a hand, by `control`."""
CONTROLS = tuple(MEANINGS)
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


def checked_action(action: ArrayLike, shape: tuple[int, ...], control: str) -> Floats:
    """Actions as float64, clipped to [-1, 1]; `ConfigError` for other shapes or no numbers."""
    try:
        values = np.asarray(action, np.float64)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"action must be numbers of shape {shape}, got {action!r}.") from error
    meaning = (
        f"(environments,) {MEANINGS[control]}, as control={control!r} has it; other agents may be "
        f"for {' or '.join(repr(each) for each in CONTROLS if each != control)}, which control= "
        "and --control choose"
    )
    if values.shape != shape:
        check_shape("action", values.shape, shape, meaning)
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
    pull = np.asarray(config.posture_gain_hz * (q_rest - q), float)
    pull[..., 0] = 0.0  # the first joint points the arm at its goal: leave it free
    J, qd = flat(jacobian(chain, q), 2), flat(pull, 1)
    _resolve(
        J, flat(np.asarray(tool_velocity_world, float), 1), np.full(len(J), config.damping**2), qd
    )
    return _within(qd.reshape(pull.shape), chain)


def resolved_twist(
    chain: SerialChain, q: JointAngles, twist_world: Floats, config: ControlConfig
) -> JointVelocities:
    """Joint velocities (..., N) for a velocity and a turn rate of the tool, (..., 6), scaled
    together to their limits; damped only near singular postures, where the tool lags behind."""
    J = flat(np.concatenate([jacobian(chain, q), angular_jacobian(chain, q)], axis=-2), 2)
    manipulability, qd = np.empty(len(J)), np.zeros((len(J), chain.n_joints))
    _measure_manipulability(J, manipulability)
    near = np.clip(1.0 - manipulability / SINGULAR_M3, 0.0, 1.0)
    _resolve(
        J, flat(np.asarray(twist_world, float), 1), np.square(config.damping * near) + 1e-9, qd
    )
    return _within(qd.reshape(np.shape(q)), chain)


@kernel(makes_arrays=True)
def _resolve(J, wanted, squared_damping, qd):
    """Add to `qd` (B, N) the change that brings J qd (B, M) to `wanted`, by damped least squares.

    Sums are of a fixed order, as those of a linear algebra library are not: stiff contacts enlarge
    the last bit.
    """
    n_rows, n_joints = J.shape[1:]
    gram, missing = np.empty((n_rows, n_rows)), np.empty(n_rows)
    for b in range(len(J)):
        _square(J[b], squared_damping[b], gram)
        for i in range(n_rows):
            missing[i] = wanted[b, i]
            for k in range(n_joints):
                missing[i] -= J[b, i, k] * qd[b, k]
        _factorise(gram)
        for i in range(n_rows):
            for j in range(i):
                missing[i] -= gram[i, j] * missing[j]
        for i in range(n_rows - 1, -1, -1):
            missing[i] /= gram[i, i]
            for j in range(i + 1, n_rows):
                missing[i] -= gram[j, i] * missing[j]
        for k in range(n_joints):
            for i in range(n_rows):
                qd[b, k] += J[b, i, k] * missing[i]


@kernel(makes_arrays=True)
def _measure_manipulability(J, out):
    """Write the square root of the determinant of J J^T (B,), 0 of singular postures."""
    gram = np.empty((J.shape[1], J.shape[1]))
    for b in range(len(J)):
        _square(J[b], 0.0, gram)
        _factorise(gram)
        determinant = 1.0
        for i in range(len(gram)):
            determinant *= max(gram[i, i], 0.0)
        out[b] = math.sqrt(determinant)


@kernel
def _square(J, squared_damping, gram):
    """Write J J^T + squared_damping I."""
    for i in range(len(gram)):
        for j in range(i + 1):
            total = squared_damping if i == j else 0.0
            for k in range(J.shape[1]):
                total += J[i, k] * J[j, k]
            gram[i, j] = gram[j, i] = total


@kernel
def _factorise(gram):
    """Write L (below the diagonal, of ones) and D (on it) of gram = L D L^T; a pivot that is not
    positive ends its column."""
    for j in range(len(gram)):
        pivot = gram[j, j]
        for k in range(j):
            pivot -= gram[j, k] ** 2 * gram[k, k]
        gram[j, j] = pivot
        for i in range(j + 1, len(gram)):
            total = gram[i, j]
            for k in range(j):
                total -= gram[i, k] * gram[j, k] * gram[k, k]
            gram[i, j] = total / pivot if pivot > 0.0 else 0.0


def _within(qd: JointVelocities, chain: SerialChain) -> JointVelocities:
    """Scaled together to the joints' limits."""
    excess = np.max(np.abs(qd) / chain.velocity_limit_rad_s, axis=-1, keepdims=True)
    return qd / np.maximum(excess, 1.0)
