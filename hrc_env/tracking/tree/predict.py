"""The tree a moment later: damped joints about the middle of the torso, moments exact.

With r the mean of the four torso states, a joint moves by x' = F x + D r + constant + noise,
where F damps it towards its place on the body and D = [[1, dt], [0, 1]] - F lets it travel
with the torso. That is linear in the 90 numbers, so that marginals and edges of the moved body
follow exactly from Cov(x_j, r), which the tree gives by a recursion. Keeping these and
forgetting all other covariances is the nearest Gaussian on the tree (least Kullback-Leibler
divergence).
"""

from hrc_env.core.kernels import kernel
from hrc_env.tracking.models.acquisition import heading
from hrc_env.tracking.models.motion import learn_offsets
from hrc_env.tracking.tree.gaussian import multiply, multiply_transposed
from hrc_env.tracking.tree.lanes import JOINT_OF_LANE, LANE_OF_JOINT, LANES
from hrc_env.tracking.tree.quads import (
    ABOVE,
    COV,
    EDGE,
    HESSIAN,
    INVERSE,
    KNOWN,
    MESSAGE,
    OWN,
    POSITIONS,
    PROPER,
    PULL,
    QUAD,
    QUADS,
    SLOPE,
    fetch_above,
    invert_rows,
    load_tree,
    multiply_rows,
    store_tree,
)
from hrc_env.tracking.tree.vectors import moved

_LEFT, _RIGHT, _LEFT_HIP, _RIGHT_HIP = 1, 2, 7, 8  # shoulders: _RIGHT, _LEFT_HIP hang on _LEFT
_ROOT, _ROOT_ABOVE = OWN, PULL
"""Covariance with the mean of the torso; the parent's."""
_TORSO = MESSAGE
"""Covariance of that mean, four times over, in the first quad."""
_MOVED, _MOVED_EDGE = HESSIAN, KNOWN
"""Covariances of a joint and with its parent, a moment later."""
_HERE, _THERE = POSITIONS, POSITIONS + 32
"""F and travel of a joint, of its parent: four rows each."""
_REORDER = {"reassoc", "contract", "nsz"}


@kernel
def predict_tree(body, cov, slope, offset, offset_count, model, dt, w):
    """Move one worker by dt [s], in place.

    Args:
        body: (J, 6) means.
        cov: (J, 6, 6) marginals C_j.
        slope: (J, 6, 6) slopes B_j.
        offset, offset_count: (J, 3), (J,) places on the body, learnt here.
        model: F (J, 2, 2), travel (J, 2, 2), Q (J, 2, 2) noise of a joint, shared (2, 2) part of it
            that is the whole body's.
        dt: time step [s].
        w: scratch.
    """
    F, travel, Q, shared = model
    _move_means(body, cov, offset, offset_count, F, travel, dt)
    rows = w.rows
    load_tree(cov, slope, rows)
    _relate_torso(cov, slope, w)
    for quad in range(QUADS - 1, -1, -1):
        at = quad * QUAD
        fetch_above(rows, quad, _ROOT, _ROOT_ABOVE, 36)
        if quad < QUADS - 1:
            multiply_rows(rows, at + SLOPE, at + _ROOT_ABOVE, at + _ROOT)
    _load_model(F, travel, rows)
    for quad in range(QUADS):
        at = quad * QUAD
        _move(rows, at + COV, at + _ROOT, at + _ROOT, at + _HERE, at + _HERE, at + _MOVED)
        blocks = (at + EDGE, at + _ROOT, at + _ROOT_ABOVE)
        _move(rows, *blocks, at + _HERE, at + _THERE, at + _MOVED_EDGE)
    _add_noise(Q, shared, rows)
    for quad in range(QUADS):
        _invert(rows, quad * QUAD)
    for quad in range(QUADS):
        at = quad * QUAD
        fetch_above(rows, quad, INVERSE, ABOVE, 36)
        multiply_rows(rows, at + _MOVED_EDGE, at + ABOVE, at + SLOPE)
    store_tree(rows, _MOVED, cov, slope)


@kernel
def _torso_of(body, i):
    """Mean of the torso's four joints, component i."""
    return 0.25 * (body[_LEFT, i] + body[_RIGHT, i] + body[_LEFT_HIP, i] + body[_RIGHT_HIP, i])


@kernel
def _move_means(body, cov, offset, offset_count, F, travel, dt):
    root = (
        _torso_of(body, 0), _torso_of(body, 1), _torso_of(body, 2),
        _torso_of(body, 3), _torso_of(body, 4), _torso_of(body, 5),
    )  # fmt: skip
    cos, sin, known = heading(body)
    if known:
        learn_offsets(body, cov, root, cos, sin, dt, offset, offset_count)
    for j in range(len(body)):
        forward, left = offset[j, 0], offset[j, 1]
        place = (cos * forward - sin * left, sin * forward + cos * left, offset[j, 2])
        for i in range(3):
            p, v = body[j, i], body[j, 3 + i]
            at, speed = root[i], root[3 + i]
            p_new = F[j, 0, 0] * p + F[j, 0, 1] * v + travel[j, 0, 0] * at + travel[j, 0, 1] * speed
            v_new = F[j, 1, 0] * p + F[j, 1, 1] * v + travel[j, 1, 0] * at + travel[j, 1, 1] * speed
            body[j, i] = p_new + travel[j, 0, 0] * place[i]
            body[j, 3 + i] = v_new + travel[j, 1, 0] * place[i]


@kernel
def _relate_torso(cov, slope, w):
    """Cov(x_j, r) of the torso's four joints into their rows, and Cov(r, r)."""
    X, rows = w.d, w.rows
    multiply(slope[_RIGHT], cov[_LEFT], X)  # right shoulder with left
    multiply(slope[_RIGHT_HIP], X, w.b)  # right hip with left shoulder
    multiply_transposed(slope[_LEFT_HIP], X, w.c)  # left hip with right shoulder
    multiply_transposed(slope[_RIGHT_HIP], w.c, w.a)  # right hip with left hip
    left, right = _place(_LEFT), _place(_RIGHT)
    left_hip, right_hip = _place(_LEFT_HIP), _place(_RIGHT_HIP)
    for i in range(6):
        for k in range(6):
            n, m = 24 * i + 4 * k, 24 * k + 4 * i
            own = cov[_LEFT, i, k] + X[k, i] + w.b[k, i]
            rows[left + _ROOT + n] = 0.25 * (own + rows[left_hip + EDGE + m])
            own = cov[_RIGHT, i, k] + X[i, k] + w.c[k, i]
            rows[right + _ROOT + n] = 0.25 * (own + rows[right_hip + EDGE + m])
            own = cov[_LEFT_HIP, i, k] + w.c[i, k] + w.a[k, i]
            rows[left_hip + _ROOT + n] = 0.25 * (own + rows[left_hip + EDGE + n])
            own = cov[_RIGHT_HIP, i, k] + w.b[i, k] + w.a[i, k]
            rows[right_hip + _ROOT + n] = 0.25 * (own + rows[right_hip + EDGE + n])
    for i in range(6):
        for k in range(6):
            n = _ROOT + 24 * i + 4 * k
            shoulders = rows[left + n] + rows[right + n]
            mean = 0.25 * (shoulders + rows[left_hip + n] + rows[right_hip + n])
            for lane in range(4):
                rows[_TORSO + 24 * i + 4 * k + lane] = mean


@kernel(forceinline=True)
def _place(j):
    return LANE_OF_JOINT[j] // 4 * QUAD + LANE_OF_JOINT[j] % 4


@kernel
def _load_model(F, travel, rows):
    """F and travel of every joint and its parent in lanes."""
    for lane in range(LANES):
        j = max(JOINT_OF_LANE[lane], 0)
        at = lane // 4 * QUAD + lane % 4 + _HERE
        for i in range(2):
            for k in range(2):
                rows[at + 8 * i + 4 * k] = F[j, i, k]
                rows[at + 16 + 8 * i + 4 * k] = travel[j, i, k]
    for quad in range(QUADS):
        fetch_above(rows, quad, _HERE, _THERE, 8)


@kernel
def _move(rows, edge, own, other, here, there, out):
    """f edge g' + f own e' + d other' g' + d S e' for a quad, axes of space left alone.

    f, d are a joint's F and travel, which begin at `here`; g, e those at `there`.
    """
    for i in range(3):
        for k in range(3):
            n = 24 * i + 4 * k
            t = 24 * k + 4 * i
            moved(rows, edge + n, own + n, other + t, _TORSO + n, here, there, out + n)


@kernel
def _add_noise(Q, shared, rows):
    """Noise (2, 2) x I3: a joint's Q, and what it shares with its parent."""
    for j in range(len(Q)):
        at = _place(j)
        for i in range(3):
            m = at + 28 * i
            for a in range(2):
                for b in range(2):
                    rows[m + 72 * a + 12 * b + _MOVED] += Q[j, a, b]
                    rows[m + 72 * a + 12 * b + _MOVED_EDGE] += shared[a, b]


@kernel
def _invert(rows, at):
    """Inverse marginals of a quad; 0 where there is none."""
    invert_rows(rows, at)
    for lane in range(4):
        if rows[at + PROPER + lane] == 0.0:
            for n in range(36):
                rows[at + INVERSE + lane + 4 * n] = 0.0
