"""Prediction of the tree after a time step, with exact moments.

Each joint is a second-order Gauss-Markov process (a damped oscillator driven by white noise) about
an anchor. The anchor is the root r (mean of the four torso states) plus the joint's mean position
on the body, rotated with the body. The joint moves by x' = F x + D r + constant + noise, where D =
[[1, dt], [0, 1]] - F lets it travel with the torso. All joints share the root's error, which
damping towards the anchor must not reduce.

The motion is linear in the 90 numbers. Therefore the marginal covariances and those of joints with
their parents follow exactly from Cov(x_j, r), which a recursion over the tree computes. Keeping
these and discarding all other covariances is the nearest Gaussian on the tree (smallest
Kullback-Leibler divergence).

A trunk that leans little is assumed to be upright, which determines the depth if one view leaves
the lean uncertain. Head and arms move with a lying trunk. The legs are aligned with the trunk, or
vertical below it as in a bending person, whichever fits better.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats, Vector3
from hrc_env.tracking.tree.gaussian import ORDER, PARENT, invert, multiply, multiply_transposed
from hrc_env.tracking.tree.state import Tree, Work

_LEFT, _RIGHT, _LEFT_HIP, _RIGHT_HIP = 1, 2, 7, 8  # _LEFT is parent of _RIGHT, _LEFT_HIP
_REORDER = {"reassoc", "contract", "nsz"}
_UPRIGHT_COSINE = math.cos(math.radians(25.0))
"""Cosine of the largest angle from the vertical of an upright trunk. The angle is an estimate."""
_LYING_COSINE = math.cos(math.radians(50.0))
"""Cosine of the smallest angle from the vertical of a lying trunk. The angle is an estimate."""
_SHORT_M = 0.05
"""Minimum length of the right-to-left vector from which a heading is computed [m]."""
_KNEE, _FOOT = JOINT["left_knee"], JOINT["left_foot"]
SPREAD_M: Floats = np.array(
    [0.06, 0.04, 0.04, 0.12, 0.12, 0.20, 0.20, 0.04, 0.04, 0.12, 0.12, 0.20, 0.20, 0.22, 0.22]
)
"""(J,) standard deviation of a joint about its mean position on the body [m]. The values are
estimates."""
SPEED_M_S: Floats = np.array(
    [0.2, 0.2, 0.2, 0.5, 0.5, 0.95, 0.95, 0.2, 0.2, 0.5, 0.5, 0.9, 0.9, 0.95, 0.95]
)
"""(J,) standard deviation of a joint's speed relative to the body [m/s]. The values are estimates
for people at work. With doubled values, the predicted standard deviations would be twice the
errors."""
_OFFSET_TAU_S = 2.0
"""Time constant of the averages of joints' positions on the body [s]."""
_OFFSET_STD_M = 0.06
"""Standard deviation of a joint's position above which its offset is not learnt [m]."""


class JointMotion(NamedTuple):
    """The motion of every joint relative to its anchor over a time step."""

    F: Floats
    """(J, 2, 2) transition matrix of position and velocity, the same on each axis."""
    Q: Floats
    """(J, 2, 2) covariance of the process noise of position and velocity."""


class MotionModel(NamedTuple):
    """The motion of the whole tree over a time step."""

    F: Floats
    """(J, 2, 2) transition matrix of each joint's position and velocity relative to its anchor."""
    travel: Floats
    """(J, 2, 2) transition matrix from the anchor's position and velocity to the joint's."""
    Q: Floats
    """(J, 2, 2) covariance of each joint's process noise."""
    shared: Floats
    """(2, 2) covariance of the process noise that the whole body shares."""


class TorsoState(NamedTuple):
    """Mean position and velocity of the four torso joints in the world frame."""

    x: float
    """Coordinate x [m]."""
    y: float
    """Coordinate y [m]."""
    z: float
    """Coordinate z, the height [m]."""
    vx: float
    """Velocity along x [m/s]."""
    vy: float
    """Velocity along y [m/s]."""
    vz: float
    """Velocity along z, upwards [m/s]."""


class Lean(NamedTuple):
    """Degree and direction of a trunk's lean."""

    share: float
    """Degree of the lean, from 0 for an upright trunk to 1 for a lying trunk."""
    direction: Vector3
    """Unit vector from the hips to the shoulders in the world frame."""


@kernel
def predict_tree(tree: Tree, model: MotionModel, dt: float, work: Work) -> None:
    """Move a hypothesis by one time step and learn the mean positions of joints on the body.

    Args:
        tree: the hypothesis, changed in place.
        model: motion over the time step.
        dt: the time step [s].
        work: work arrays.
    """
    cov, slope = tree.cov, tree.slope
    _move_means(tree, model, dt, work)
    torso = work.a
    _relate_torso(cov, slope, work)
    for j in ORDER:
        q: int = PARENT[j]
        _move_covariance(work.root[j], work.root[j], torso, model, j, j, cov[j], work.moved[j])
        _add_noise(model.Q[j], work.moved[j])
        if q >= 0:
            moved_edge = work.moved_edge[j]
            _move_covariance(
                work.root[j], work.root[q], torso, model, j, q, work.edge[j], moved_edge
            )
            _add_noise(model.shared, moved_edge)
    for j in ORDER:
        for i in range(6):
            for k in range(i + 1):
                cov[j, i, k] = cov[j, k, i] = work.moved[j, i, k]
        if not invert(cov[j], work.inverse[j]):
            work.inverse[j] = 0.0
        if PARENT[j] >= 0:
            multiply(work.moved_edge[j], work.inverse[PARENT[j]], slope[j])


@kernel
def measure_torso(body: Floats, i: int) -> float:
    """Return component `i` of the mean of the four torso joints of a body (J, 3+)."""
    return 0.25 * (body[_LEFT, i] + body[_RIGHT, i] + body[_LEFT_HIP, i] + body[_RIGHT_HIP, i])


@kernel
def measure_trunk(body: Floats, i: int) -> float:
    """Return component `i` of twice the vector from mid-hip to mid-shoulder of a body (J, 3+)."""
    return body[_LEFT, i] + body[_RIGHT, i] - body[_LEFT_HIP, i] - body[_RIGHT_HIP, i]


@kernel
def _move_means(tree: Tree, model: MotionModel, dt: float, work: Work) -> None:
    """Move the means of all joints with the torso and towards their mean positions on the body."""
    body, offset, axes, place = tree.body, tree.offset, work.axes, work.place
    root = TorsoState(
        measure_torso(body, 0),
        measure_torso(body, 1),
        measure_torso(body, 2),
        measure_torso(body, 3),
        measure_torso(body, 4),
        measure_torso(body, 5),
    )
    is_known = set_axes(body, root, offset, axes)
    if is_known:
        _learn_offsets(tree, root, axes, dt)
    for j in range(len(body)):
        joint, F, travel, joint_axes = body[j], model.F[j], model.travel[j], axes[choose_axes(j)]
        for i in range(3):
            place[i] = 0.0
            for k in range(3):
                place[i] += joint_axes[i, k] * offset[j, k] if is_known or i == k == 2 else 0.0
        for i in range(3):
            p, v = joint[i], joint[3 + i]
            at, speed = root[i], root[3 + i]
            p_new = F[0, 0] * p + F[0, 1] * v + travel[0, 0] * at + travel[0, 1] * speed
            v_new = F[1, 0] * p + F[1, 1] * v + travel[1, 0] * at + travel[1, 1] * speed
            joint[i] = p_new + travel[0, 0] * place[i]
            joint[3 + i] = v_new + travel[1, 0] * place[i]


@kernel
def _relate_torso(cov: Floats, slope: Floats, work: Work) -> None:
    """Compute `work.edge` = Cov(x_j, x_q), `work.root` = Cov(x_j, r) and `work.a` = Cov(r, r).

    Args:
        cov: (J, 6, 6) marginal covariances.
        slope: (J, 6, 6) slopes on the parents.
        work: work arrays, in which the results are stored.
    """
    for j in ORDER:
        if PARENT[j] >= 0:
            multiply(slope[j], cov[PARENT[j]], work.edge[j])
    right, root = work.edge[_RIGHT], work.root  # right shoulder with left
    hip = work.edge[_LEFT_HIP]  # left hip with left shoulder
    multiply(slope[_RIGHT_HIP], right, work.b)  # right hip with left shoulder
    multiply_transposed(slope[_LEFT_HIP], right, work.c)  # left hip with right shoulder
    multiply_transposed(slope[_RIGHT_HIP], work.c, work.d)  # right hip with left hip
    other = work.edge[_RIGHT_HIP]  # right hip with right shoulder
    for i in range(6):
        for k in range(6):
            own = cov[_LEFT, i, k] + right[k, i] + work.b[k, i]
            root[_LEFT, i, k] = 0.25 * (own + hip[k, i])
            own = cov[_RIGHT, i, k] + right[i, k] + work.c[k, i]
            root[_RIGHT, i, k] = 0.25 * (own + other[k, i])
            own = cov[_LEFT_HIP, i, k] + work.c[i, k] + work.d[k, i]
            root[_LEFT_HIP, i, k] = 0.25 * (own + hip[i, k])
            own = cov[_RIGHT_HIP, i, k] + work.b[i, k] + work.d[i, k]
            root[_RIGHT_HIP, i, k] = 0.25 * (own + other[i, k])
    for i in range(6):
        for k in range(6):
            shoulders = root[_LEFT, i, k] + root[_RIGHT, i, k]
            work.a[i, k] = 0.25 * (shoulders + root[_LEFT_HIP, i, k] + root[_RIGHT_HIP, i, k])
    for j in ORDER:
        if j not in (_LEFT, _RIGHT, _LEFT_HIP, _RIGHT_HIP):
            multiply(slope[j], root[PARENT[j]], root[j])


@kernel(fastmath=_REORDER)
def _move_covariance(
    own: Floats,
    other: Floats,
    torso: Floats,
    model: MotionModel,
    j: int,
    m: int,
    cov: Floats,
    out: Floats,
) -> None:
    """Compute the covariance of joints `j` and `m` after a time step, without noise.

    With the transitions f, d of joint j and of its anchor, and g, e of joint m and of its anchor,
    applied on each axis, the covariance is f cov g' + f own e' + d other' g' + d torso e'.

    Args:
        own: (6, 6) covariance of joint `j` with the torso's mean.
        other: (6, 6) covariance of joint `m` with the torso's mean.
        torso: (6, 6) covariance of the torso's mean.
        model: motion over the time step.
        j: index of the first joint.
        m: index of the second joint.
        cov: (6, 6) covariance of the two joints before the time step.
        out: (6, 6) covariance of the two joints after the time step, filled in.
    """
    f, g, d, e = model.F[j], model.F[m], model.travel[j], model.travel[m]
    for i in range(3):
        for column in range(2):
            g0, g1, e0, e1 = g[column, 0], g[column, 1], e[column, 0], e[column, 1]
            for k in range(3):
                a, b = 3 + i, 3 + k
                near_p = cov[i, k] * g0 + cov[i, b] * g1 + own[i, k] * e0 + own[i, b] * e1
                near_v = cov[a, k] * g0 + cov[a, b] * g1 + own[a, k] * e0 + own[a, b] * e1
                far_p = other[k, i] * g0 + other[b, i] * g1 + torso[i, k] * e0 + torso[i, b] * e1
                far_v = other[k, a] * g0 + other[b, a] * g1 + torso[a, k] * e0 + torso[a, b] * e1
                to = 3 * column + k
                p = f[0, 0] * near_p + f[0, 1] * near_v + d[0, 0] * far_p + d[0, 1] * far_v
                out[i, to] = p
                out[a, to] = f[1, 0] * near_p + f[1, 1] * near_v + d[1, 0] * far_p + d[1, 1] * far_v


@kernel
def _add_noise(noise: Floats, out: Floats) -> None:
    """Add noise (2, 2) of position and velocity to every axis of a covariance (6, 6)."""
    for i in range(3):
        out[i, i] += noise[0, 0]
        out[i, 3 + i] += noise[0, 1]
        out[3 + i, i] += noise[1, 0]
        out[3 + i, 3 + i] += noise[1, 1]


@kernel
def measure_lean(body: Floats) -> Lean:
    """Return the lean of the trunk of a body (J, 3+)."""
    x, y, z = measure_trunk(body, 0), measure_trunk(body, 1), measure_trunk(body, 2)
    length = math.sqrt(x * x + y * y + z * z) + 1e-9
    cosine = z / length
    share = (cosine - _UPRIGHT_COSINE) / (_LYING_COSINE - _UPRIGHT_COSINE)
    return Lean(min(max(share, 0.0), 1.0), Vector3(x / length, y / length, cosine))


@kernel
def choose_axes(j: int) -> int:
    """Return the index of the axes for joint `j`: 0 for trunk, head and arms, 1 for the legs."""
    return 1 if j >= _KNEE else 0


@kernel
def set_axes(body: Floats, root: TorsoState, offset: Floats, axes: Floats) -> bool:
    """Compute the axes of trunk and legs; return whether those of the trunk are known.

    Args:
        body: (J, 3+) positions [m].
        root: mean of the torso's joints.
        offset: (J, 3) mean positions on the body [m].
        axes: (2, 3, 3) axes with columns forward, left and up, filled in.
    """
    trunk, legs = axes[0], axes[1]
    lean = measure_lean(body)
    for i in range(3):
        legs[i, 2] = 1.0 if i == 2 else 0.0
        trunk[i, 2] = lean.share * lean.direction[i] + (1.0 - lean.share) * legs[i, 2]
    is_known = _complete_axes(body, trunk)
    if not _complete_axes(body, legs) or _are_legs_along_trunk(body, root, offset, axes):
        for i in range(3):
            for k in range(3):
                legs[i, k] = trunk[i, k]
    return is_known


@kernel
def _complete_axes(body: Floats, axes: Floats) -> bool:
    """Complete axes (3, 3) given the last column, up; return whether the body's left is known."""
    length = along = across = 0.0
    for i in range(3):
        axes[i, 1] = body[1, i] - body[2, i] + body[7, i] - body[8, i]
        length += axes[i, 2] * axes[i, 2]
        along += axes[i, 1] * axes[i, 2]
    for i in range(3):
        axes[i, 1] -= along * axes[i, 2] / length
        axes[i, 2] /= math.sqrt(length)
        across += axes[i, 1] * axes[i, 1]
    if across < _SHORT_M * _SHORT_M:
        return False
    for i in range(3):
        axes[i, 1] /= math.sqrt(across)
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        axes[i, 0] = axes[a, 1] * axes[b, 2] - axes[b, 1] * axes[a, 2]
    return True


@kernel
def _are_legs_along_trunk(body: Floats, root: TorsoState, offset: Floats, axes: Floats) -> bool:
    """Return whether the trunk's axes fit knees and ankles better than upright axes do.

    Args:
        body: (J, 3+) positions [m].
        root: mean of the torso's joints.
        offset: (J, 3) mean positions on the body [m].
        axes: (2, 3, 3) the trunk's axes and upright axes.
    """
    difference = 0.0
    for j in range(_KNEE, _FOOT):
        for i in range(3):
            along = below = body[j, i] - root[i]
            for k in range(3):
                along -= axes[0, i, k] * offset[j, k]
                below -= axes[1, i, k] * offset[j, k]
            difference += along * along - below * below
    return difference < 0.0


@functools.lru_cache(maxsize=16)
def discretise_joints(dt_s: float, damping: float, root_acceleration: float) -> JointMotion:
    """Return the exact motion of underdamped joints over a time step.

    On each axis, the displacement of a joint from its anchor is a damped oscillator driven by white
    noise. Its stationary standard deviations are `SPREAD_M` for the displacement and `SPEED_M_S`
    for its rate of change, which determine the natural frequency.

    Args:
        dt_s: the time step [s].
        damping: damping ratio of the oscillators, in (0, 1).
        root_acceleration: spectral density of the acceleration of the whole body [m^2/s^3].

    Returns:
        (J, 2, 2) transition matrices of displacement and velocity, and (J, 2, 2) covariances of the
        process noise. The noise is the sum of two parts: the noise of the oscillators, which keeps
        their variances stationary, and the noise from `make_shared_noise`.
    """
    natural_rad_s = SPEED_M_S / SPREAD_M  # (J,) undamped angular frequencies
    damped_rad_s = natural_rad_s * np.sqrt(1 - damping**2)  # (J,)
    decay = np.exp(-damping * natural_rad_s * dt_s)  # (J,) decrease of the amplitudes
    cos = np.cos(damped_rad_s * dt_s)
    sin = np.sin(damped_rad_s * dt_s)
    damped_sin = damping * natural_rad_s / damped_rad_s * sin

    F = np.empty((len(natural_rad_s), 2, 2))  # both axes are ordered displacement, velocity
    F[:, 0, 0] = decay * (cos + damped_sin)
    F[:, 0, 1] = decay * sin / damped_rad_s
    F[:, 1, 0] = -decay * natural_rad_s**2 / damped_rad_s * sin
    F[:, 1, 1] = decay * (cos - damped_sin)

    stationary = np.zeros_like(F)  # (J, 2, 2) stationary covariances, F S F' + Q = S
    stationary[:, 0, 0] = SPREAD_M**2
    stationary[:, 1, 1] = SPEED_M_S**2
    shared_noise = make_shared_noise(dt_s, root_acceleration)
    Q = stationary - F @ stationary @ F.swapaxes(1, 2) + shared_noise
    return JointMotion(F, Q)


def make_shared_noise(dt_s: float, root_acceleration: float) -> Floats:
    """Return the covariance (2, 2) of the process noise that all joints share over `dt_s` [s].

    It is the covariance of position and velocity on one axis if the acceleration of the whole body
    is white noise with the spectral density `root_acceleration` [m^2/s^3].
    """
    return root_acceleration * np.array([[dt_s**3 / 3, dt_s**2 / 2], [dt_s**2 / 2, dt_s]])


@kernel
def _learn_offsets(tree: Tree, root: TorsoState, axes: Floats, dt: float) -> None:
    """Learn the mean positions on the body of joints with small uncertainty.

    Args:
        tree: the hypothesis; its offsets are changed in place.
        root: mean of the torso's joints.
        axes: (2, 3, 3) axes of trunk and legs, from `set_axes`.
        dt: time since the last prediction [s].
    """
    body, cov, offset, offset_count = tree.body, tree.cov, tree.offset, tree.offset_count
    for j in range(len(body)):
        if cov[j, 0, 0] + cov[j, 1, 1] + cov[j, 2, 2] > 3.0 * _OFFSET_STD_M**2:
            continue
        offset_count[j] += 1.0
        trust = max(1.0 / offset_count[j], dt / _OFFSET_TAU_S)
        joint_axes = axes[choose_axes(j)]
        for k in range(3):
            there = 0.0
            for i in range(3):
                there += joint_axes[i, k] * (body[j, i] - root[i])
            offset[j, k] += trust * (there - offset[j, k])


@functools.lru_cache(maxsize=16)
def make_motion_model(dt_s: float, damping: float, acceleration: float) -> MotionModel:
    """Return the motion model of the tree over a time step.

    Args:
        dt_s: the time step [s].
        damping: damping ratio of the joints, in (0, 1).
        acceleration: spectral density of the whole body's acceleration [m^2/s^3].
    """
    F, Q = discretise_joints(dt_s, damping, acceleration)
    travel = np.array([[1.0, dt_s], [0.0, 1.0]]) - F
    return MotionModel(F, travel, Q, make_shared_noise(dt_s, acceleration))
