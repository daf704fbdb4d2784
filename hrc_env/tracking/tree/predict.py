"""Prediction: the tree a moment later, with exact moments.

Each joint is a second-order Gauss-Markov process (a damped oscillator driven by white noise) about
an anchor: the root r (mean of the four torso states) plus the joint's mean place on the body,
turned as the body is. It moves by x' = F x + D r + constant + noise, where D = [[1, dt], [0, 1]] -
F lets it travel with the torso. All joints share the root's error: damping towards the anchor must
not make it smaller.

That is linear in the 90 numbers, so that marginals and edges of the moved body follow exactly from
Cov(x_j, r), which the tree gives by a recursion. Keeping these and forgetting all other
covariances is the nearest Gaussian on the tree (least Kullback-Leibler divergence).

A trunk that leans little counts as upright, as people's are: where one view leaves open how far it
leans, that tells the depth. One that lies takes head and arms with it; the legs go with it, or
hang below it as those of a person who bends down, whichever they are nearer to.
"""

import functools
import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats
from hrc_env.tracking.tree.gaussian import ORDER, PARENT, invert, multiply, multiply_transposed

_LEFT, _RIGHT, _LEFT_HIP, _RIGHT_HIP = 1, 2, 7, 8  # shoulders: _RIGHT, _LEFT_HIP hang on _LEFT
_REORDER = {"reassoc", "contract", "nsz"}
_LEANS, _LIES = math.cos(math.radians(25.0)), math.cos(math.radians(50.0))
"""Up to the first angle a trunk is upright, from the second on it lies; judgement."""
_SHORT_M = 0.05
_KNEE, _FOOT = JOINT["left_knee"], JOINT["left_foot"]
SPREAD_M: Floats = np.array(
    [.06, .04, .04, .12, .12, .20, .20, .04, .04, .12, .12, .20, .20, .22, .22]
)  # fmt: skip
"""Standard deviation of a joint about its mean place on the body [m]; a judgement."""
SPEED_M_S: Floats = np.array(
    [.2, .2, .2, .5, .5, .95, .95, .2, .2, .5, .5, .9, .9, .95, .95]
)  # fmt: skip
"""Standard deviation of its speed relative to the body [m/s]; a judgement: those of people at
work are near it, and twice as much makes every prediction twice as uncertain as it is wrong."""
_OFFSET_TAU_S, _OFFSET_STD_M = 2.0, 0.06


@kernel
def predict_tree(tree, model, dt, w):
    """Move one worker by dt [s], in place, and learn their joints' places on the body.

    `model` is F (J, 2, 2), travel (J, 2, 2), Q (J, 2, 2) noise of a joint, shared (2, 2) part of it
    that is the whole body's; `w` is scratch.
    """
    F, travel, Q, shared = model
    cov, slope = tree.cov, tree.slope
    _move_means(tree, F, travel, dt, w)
    torso = w.a
    _relate_torso(cov, slope, w)
    for j in ORDER:
        q = PARENT[j]
        _move(cov[j], w.root[j], w.root[j], torso, F, travel, (j, j), w.moved[j])
        _add_noise(Q[j], w.moved[j])
        if q >= 0:
            _move(w.edge[j], w.root[j], w.root[q], torso, F, travel, (j, q), w.moved_edge[j])
            _add_noise(shared, w.moved_edge[j])
    for j in ORDER:
        for i in range(6):
            for k in range(i + 1):
                cov[j, i, k] = cov[j, k, i] = w.moved[j, i, k]
        if not invert(cov[j], w.inverse[j]):
            w.inverse[j] = 0.0
        if PARENT[j] >= 0:
            multiply(w.moved_edge[j], w.inverse[PARENT[j]], slope[j])


@kernel
def _torso_of(body, i):
    """Mean of the torso's four joints, component i."""
    return 0.25 * (body[_LEFT, i] + body[_RIGHT, i] + body[_LEFT_HIP, i] + body[_RIGHT_HIP, i])


@kernel
def _move_means(tree, F, travel, dt, w):
    body, offset, axes, place = tree.body, tree.offset, w.axes, w.place
    root = (
        _torso_of(body, 0), _torso_of(body, 1), _torso_of(body, 2),
        _torso_of(body, 3), _torso_of(body, 4), _torso_of(body, 5),
    )  # fmt: skip
    known = set_axes(body, root, offset, axes)
    if known:
        learn_offsets(tree, root, axes, dt)
    for j in range(len(body)):
        own = axes[part_of(j)]
        for i in range(3):
            place[i] = 0.0
            for k in range(3):
                place[i] += own[i, k] * offset[j, k] if known or i == k == 2 else 0.0
        _move_mean(body[j], root, F[j], travel[j], place)


@kernel
def _move_mean(joint, root, F, travel, place):
    for i in range(3):
        p, v = joint[i], joint[3 + i]
        at, speed = root[i], root[3 + i]
        p_new = F[0, 0] * p + F[0, 1] * v + travel[0, 0] * at + travel[0, 1] * speed
        v_new = F[1, 0] * p + F[1, 1] * v + travel[1, 0] * at + travel[1, 1] * speed
        joint[i] = p_new + travel[0, 0] * place[i]
        joint[3 + i] = v_new + travel[1, 0] * place[i]


@kernel
def _relate_torso(cov, slope, w):
    """Fill w.edge, w.root = Cov(x_j, r) and w.a = Cov(r, r)."""
    for j in ORDER:
        if PARENT[j] >= 0:
            multiply(slope[j], cov[PARENT[j]], w.edge[j])
    right, root = w.edge[_RIGHT], w.root  # right shoulder with left
    hip = w.edge[_LEFT_HIP]  # left hip with left shoulder
    multiply(slope[_RIGHT_HIP], right, w.b)  # right hip with left shoulder
    multiply_transposed(slope[_LEFT_HIP], right, w.c)  # left hip with right shoulder
    multiply_transposed(slope[_RIGHT_HIP], w.c, w.d)  # right hip with left hip
    other = w.edge[_RIGHT_HIP]  # right hip with right shoulder
    for i in range(6):
        for k in range(6):
            own = cov[_LEFT, i, k] + right[k, i] + w.b[k, i]
            root[_LEFT, i, k] = 0.25 * (own + hip[k, i])
            own = cov[_RIGHT, i, k] + right[i, k] + w.c[k, i]
            root[_RIGHT, i, k] = 0.25 * (own + other[k, i])
            own = cov[_LEFT_HIP, i, k] + w.c[i, k] + w.d[k, i]
            root[_LEFT_HIP, i, k] = 0.25 * (own + hip[i, k])
            own = cov[_RIGHT_HIP, i, k] + w.b[i, k] + w.d[i, k]
            root[_RIGHT_HIP, i, k] = 0.25 * (own + other[i, k])
    for i in range(6):
        for k in range(6):
            shoulders = root[_LEFT, i, k] + root[_RIGHT, i, k]
            w.a[i, k] = 0.25 * (shoulders + root[_LEFT_HIP, i, k] + root[_RIGHT_HIP, i, k])
    for j in ORDER:
        if j not in (_LEFT, _RIGHT, _LEFT_HIP, _RIGHT_HIP):
            multiply(slope[j], root[PARENT[j]], root[j])


@kernel(fastmath=_REORDER)
def _move(edge, own, other, torso, F, travel, joints, out):
    """f edge g' + f own e' + d other' g' + d S e' for 6x6 matrices, axes of space left alone.

    f, d are F and travel of the first of `joints`, g, e those of the second.
    """
    f, g, d, e = F[joints[0]], F[joints[1]], travel[joints[0]], travel[joints[1]]
    for i in range(3):
        for q in range(2):
            g0, g1, e0, e1 = g[q, 0], g[q, 1], e[q, 0], e[q, 1]
            for k in range(3):
                m, v = 3 + i, 3 + k
                near_p = edge[i, k] * g0 + edge[i, v] * g1 + own[i, k] * e0 + own[i, v] * e1
                near_v = edge[m, k] * g0 + edge[m, v] * g1 + own[m, k] * e0 + own[m, v] * e1
                far_p = other[k, i] * g0 + other[v, i] * g1 + torso[i, k] * e0 + torso[i, v] * e1
                far_v = other[k, m] * g0 + other[v, m] * g1 + torso[m, k] * e0 + torso[m, v] * e1
                to = 3 * q + k
                p = f[0, 0] * near_p + f[0, 1] * near_v + d[0, 0] * far_p + d[0, 1] * far_v
                out[i, to] = p
                out[m, to] = f[1, 0] * near_p + f[1, 1] * near_v + d[1, 0] * far_p + d[1, 1] * far_v


@kernel
def _add_noise(noise, out):
    """Add noise (2, 2) x I3."""
    for i in range(3):
        out[i, i] += noise[0, 0]
        out[i, 3 + i] += noise[0, 1]
        out[3 + i, i] += noise[1, 0]
        out[3 + i, 3 + i] += noise[1, 1]


@kernel
def leaning(body):
    """How far a trunk lies, 0 to 1, and the direction from its hips to its shoulders."""
    x, y, z = _trunk(body, 0), _trunk(body, 1), _trunk(body, 2)
    length = math.sqrt(x * x + y * y + z * z) + 1e-9
    lies = min(max((z / length - _LEANS) / (_LIES - _LEANS), 0.0), 1.0)
    return lies, (x / length, y / length, z / length)


@kernel
def _trunk(body, i):
    return body[1, i] + body[2, i] - body[7, i] - body[8, i]


@kernel
def part_of(j):
    """Which axes joint j goes by: 0 the trunk's, 1 the legs'."""
    return 1 if j >= _KNEE else 0


@kernel
def set_axes(body, root, offset, axes):
    """Fill axes (2, 3, 3), columns forward, left, up of trunk and legs; whether they are known.

    `body` is (J, 3+), `root` begins with the middle of its torso, `offset` are the joints' mean
    places (J, 3).
    """
    trunk, legs = axes[0], axes[1]
    lies, along = leaning(body)
    for i in range(3):
        legs[i, 2] = 1.0 if i == 2 else 0.0
        trunk[i, 2] = lies * along[i] + (1.0 - lies) * legs[i, 2]
    known = _turn(body, trunk)
    if not _turn(body, legs) or _legs_follow(body, root, offset, axes):
        for i in range(3):
            for k in range(3):
                legs[i, k] = trunk[i, k]
    return known


@kernel
def _turn(body, axes):
    """Make axes (3, 3) of a body that has up in the last column; whether its left is known."""
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
def _legs_follow(body, root, offset, axes):
    """Whether knees and ankles are nearer to where the trunk's axes put them than below it."""
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
def damped_joints(dt_s: float, damping: float, root_acceleration: float) -> tuple[Floats, Floats]:
    """Exact discretisation over `dt_s` [s] of damped joints, `damping` in (0, 1).

    F (J, 2, 2) moves (position, velocity) relative to the anchor; the process noise Q (J, 2, 2)
    keeps the stationary spreads and adds the whole body's acceleration [m^2/s^3].
    """
    frequency = SPEED_M_S / SPREAD_M
    damped = frequency * np.sqrt(1 - damping**2)
    decay, cos, sin = (
        np.exp(-damping * frequency * dt_s),
        np.cos(damped * dt_s),
        np.sin(damped * dt_s),
    )
    slope = damping * frequency / damped * sin
    F = np.empty((len(frequency), 2, 2))
    F[:, 0, 0], F[:, 0, 1] = decay * (cos + slope), decay * sin / damped
    F[:, 1, 0], F[:, 1, 1] = -decay * frequency**2 / damped * sin, decay * (cos - slope)
    stationary = np.zeros_like(F)
    stationary[:, 0, 0], stationary[:, 1, 1] = SPREAD_M**2, SPEED_M_S**2
    Q = stationary - F @ stationary @ F.swapaxes(1, 2)
    Q += whole_body_noise(dt_s, root_acceleration)
    return F, Q


def whole_body_noise(dt_s: float, root_acceleration: float) -> Floats:
    """(2, 2) noise of position and velocity that all joints share over `dt_s` [s]."""
    return root_acceleration * np.array([[dt_s**3 / 3, dt_s**2 / 2], [dt_s**2 / 2, dt_s]])


@kernel
def learn_offsets(tree, root, axes, dt):
    """Joints that are known well teach their mean places (J, 3) on the body, in place.

    `axes` are as `axes.set_axes` fills them, `root` begins with the middle of the torso.
    """
    body, cov, offset, offset_count = tree.body, tree.cov, tree.offset, tree.offset_count
    for j in range(len(body)):
        if cov[j, 0, 0] + cov[j, 1, 1] + cov[j, 2, 2] > 3.0 * _OFFSET_STD_M**2:
            continue
        offset_count[j] += 1.0
        trust = max(1.0 / offset_count[j], dt / _OFFSET_TAU_S)
        own = axes[part_of(j)]
        for k in range(3):
            there = 0.0
            for i in range(3):
                there += own[i, k] * (body[j, i] - root[i])
            offset[j, k] += trust * (there - offset[j, k])


@functools.lru_cache(maxsize=16)
def motion(dt_s: float, damping: float, acceleration: float) -> tuple[Floats, ...]:
    """F, travel, Q (J, 2, 2) and shared noise (2, 2), as `tree.predict.predict_tree` takes them."""
    F, Q = damped_joints(dt_s, damping, acceleration)
    travel = np.array([[1.0, dt_s], [0.0, 1.0]]) - F
    return F, travel, Q, whole_body_noise(dt_s, acceleration)
