"""Conversion of actions to joint velocities, directly or by resolved-rate control of the tool.

Resolved-rate control is the damped least-squares solution of J qd = v (Wampler 1986, DOI
10.1109/TSMC.1986.289285; Nakamura and Hanafusa 1986, DOI 10.1115/1.3143764). The redundancy of the
arm is used to approach a rest posture. The damping keeps joint speeds finite near singularities,
where the tool lags behind the command.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.core.batching import flatten_axes
from hrc_env.core.errors import ConfigError, check_fields, check_shape, make_unknown_name_error
from hrc_env.core.kernels import kernel
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Floats, JointAngles, JointVelocities, Velocities3
from hrc_env.geometry.chains import SerialChain, angular_jacobian, jacobian

MEANINGS = {
    "joint": "velocities of its joints",
    "tool": "a velocity of its tool",
    "twist": "velocity and turn rate of its tool",
}
"""Quantities that an action commands, except its entry for a hand, by value of `control`."""
CONTROLS = tuple(MEANINGS)
"""Valid values of `control`."""
SINGULAR_M3 = 0.05
"""Manipulability below which the damping in `resolve_twist` increases from zero [m^3]."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ControlConfig:
    """Scaling of actions, for each value of `control`."""

    RENAMED: ClassVar[Mapping[str, str]] = {
        "tool_speed_mps": "tool_speed_m_s",
        "tool_turn_rad_s": "tool_rotation_rad_s",
    }
    """Current names of renamed fields, by former name."""

    joint_speed_share: float = 0.5
    """Velocity of a joint for an action of 1, as a fraction of its limit (`joint`)."""
    tool_speed_m_s: float = 0.6
    """Velocity of the tool point along a world axis for an action of 1 (`tool`, `twist`) [m/s]."""
    tool_rotation_rad_s: float = 1.2
    """Angular velocity of the tool about a world axis for an action of 1 (`twist`) [rad/s]."""
    damping: float = 0.07
    """Damping of the least-squares solution (`tool`, `twist`) [m]."""
    posture_gain_hz: float = 0.8
    """Gain of the return of the joints to the rest posture, in the null space of the tool's motion
    (`tool`) [1/s]."""

    def __post_init__(self) -> None:
        check_fields(self, "be in (0, 1]", "joint_speed_share")
        check_fields(self, "be positive", "tool_speed_m_s", "damping", "posture_gain_hz")
        check_fields(self, "be positive", "tool_rotation_rad_s")


def n_actions(control: str, chain: SerialChain, grips: bool = False) -> int:
    """Return the length of an action.

    Args:
        control: "joint" (an entry for each joint), "tool" (three) or "twist" (six).
        chain: kinematics of the robot.
        grips: whether the robot has a hand, which adds an entry to the action.

    Raises:
        ConfigError: `control` is unknown, or is not supported by a robot with slides.
    """
    if control not in CONTROLS:
        raise make_unknown_name_error("control", control, CONTROLS)
    if control != "joint" and chain.slides.any():
        raise ConfigError(
            f"control={control!r} moves the tool of an arm with revolute joints only; this robot "
            'has prismatic joints, such as those of a mobile base: valid is control="joint", a '
            "velocity for each joint."
        )
    return {"joint": chain.n_joints, "tool": 3, "twist": 6}[control] + grips


def max_command(control: str, chain: SerialChain, config: ControlConfig) -> JointVelocities:
    """Return the maximum velocity (N,) that an action can command for each joint [rad/s]."""
    share = config.joint_speed_share if control == "joint" else 1.0
    return share * chain.velocity_limit_rad_s


def check_action(action: ArrayLike, shape: tuple[int, ...], control: str) -> Floats:
    """Return actions as float64, clipped to [-1, 1].

    Args:
        action: actions of an agent.
        shape: expected shape.
        control: the environment's `control`, for error messages.

    Raises:
        ConfigError: the shape differs, or a value is not a finite number.
    """
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
    """Return the joint velocities that actions command.

    Args:
        control: "joint", "tool" or "twist".
        action: (B, A) actions in [-1, 1], without the entry for a hand.
        q: (B, N) joint angles [rad].
        chain: kinematics of the robot.
        q_rest: (N,) rest posture [rad].
        config: scaling of actions.

    Returns:
        (B, N) joint velocities [rad/s].
    """
    if control == "joint":
        return action * max_command(control, chain, config)
    if control == "tool":
        return resolve_rate(chain, q, action * config.tool_speed_m_s, q_rest, config)
    scale = np.repeat([config.tool_speed_m_s, config.tool_rotation_rad_s], 3)
    return resolve_twist(chain, q, action * scale, config)


def resolve_rate(
    chain: SerialChain,
    q: JointAngles,
    tool_velocity_world: Velocities3,
    q_rest: JointAngles,
    config: ControlConfig,
) -> JointVelocities:
    """Return joint velocities for a velocity of the tool point, scaled to the joints' limits.

    Args:
        chain: kinematics of the robot.
        q: (..., N) joint angles [rad].
        tool_velocity_world: (..., 3) velocity of the tool point [m/s].
        q_rest: (N,) rest posture [rad].
        config: damping and gain.

    Returns:
        (..., N) joint velocities [rad/s].
    """
    pull = np.asarray(config.posture_gain_hz * (q_rest - q), float)
    pull[..., 0] = 0.0  # the first joint points the arm at its goal: leave it free
    J, qd = flatten_axes(jacobian(chain, q), 2), flatten_axes(pull, 1)
    velocity = flatten_axes(np.asarray(tool_velocity_world, float), 1)
    _solve_damped(J, velocity, np.full(len(J), config.damping**2), qd)
    return _scale_to_limits(qd.reshape(pull.shape), chain)


def resolve_twist(
    chain: SerialChain, q: JointAngles, twist_world: Floats, config: ControlConfig
) -> JointVelocities:
    """Return joint velocities for a twist of the tool, scaled to the joints' limits.

    The solution is damped only near singularities, where the tool lags behind the command.

    Args:
        chain: kinematics of the robot.
        q: (..., N) joint angles [rad].
        twist_world: (..., 6) linear velocity [m/s] and angular velocity [rad/s].
        config: damping.

    Returns:
        (..., N) joint velocities [rad/s].
    """
    J = flatten_axes(np.concatenate([jacobian(chain, q), angular_jacobian(chain, q)], axis=-2), 2)
    manipulability, qd = np.empty(len(J)), np.zeros((len(J), chain.n_joints))
    _measure_manipulability(J, manipulability)
    near = np.clip(1.0 - manipulability / SINGULAR_M3, 0.0, 1.0)
    twist = flatten_axes(np.asarray(twist_world, float), 1)
    _solve_damped(J, twist, np.square(config.damping * near) + 1e-9, qd)
    return _scale_to_limits(qd.reshape(np.shape(q)), chain)


@kernel(makes_arrays=True)
def _solve_damped(J: Floats, wanted: Floats, squared_damping: Floats, qd: JointVelocities) -> None:
    """Correct joint velocities by damped least squares to achieve a desired velocity of the tool.

    Sums are computed in a fixed order, unlike those of a linear algebra library, because stiff
    contacts amplify differences in the last bit.

    Args:
        J: (B, M, N) Jacobians.
        wanted: (B, M) desired velocities of the tool.
        squared_damping: (B,) squared damping [m^2].
        qd: (B, N) joint velocities [rad/s], which are corrected in place.
    """
    n_rows, n_joints = J.shape[1:]
    gram, missing = np.empty((n_rows, n_rows)), np.empty(n_rows)
    for b in range(len(J)):
        _write_gram(J[b], squared_damping[b], gram)
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
def _measure_manipulability(J: Floats, out: Floats) -> None:
    """Compute the manipulability sqrt(det(J J^T)) of Jacobians (B, M, N) into `out` (B,)."""
    gram = np.empty((J.shape[1], J.shape[1]))
    for b in range(len(J)):
        _write_gram(J[b], 0.0, gram)
        _factorise(gram)
        determinant = 1.0
        for i in range(len(gram)):
            determinant *= max(gram[i, i], 0.0)
        out[b] = math.sqrt(determinant)


@kernel
def _write_gram(J: Floats, squared_damping: float, gram: Floats) -> None:
    """Compute J J^T + squared_damping I of a Jacobian (M, N) into `gram` (M, M)."""
    for i in range(len(gram)):
        for j in range(i + 1):
            total = squared_damping if i == j else 0.0
            for k in range(J.shape[1]):
                total += J[i, k] * J[j, k]
            gram[i, j] = gram[j, i] = total


@kernel
def _factorise(gram: Floats) -> None:
    """Replace a symmetric matrix (M, M) by the factors of its L D L^T decomposition.

    D is stored on the diagonal and the unit lower triangular L below it. If a pivot is not
    positive, the entries of its column below the diagonal are 0.
    """
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


def _scale_to_limits(qd: JointVelocities, chain: SerialChain) -> JointVelocities:
    """Return joint velocities (..., N), scaled by a common factor to be within their limits."""
    excess = np.max(np.abs(qd) / chain.velocity_limit_rad_s, axis=-1, keepdims=True)
    return qd / np.maximum(excess, 1.0)
