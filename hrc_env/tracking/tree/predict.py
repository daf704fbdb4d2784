"""The tree a moment later: damped joints about the middle of the torso, moments exact.

With r the mean of the four torso states, a joint moves by x' = F x + D r + constant + noise,
where F damps it towards its place on the body and D = [[1, dt], [0, 1]] - F lets it travel
with the torso. That is linear in the 90 numbers, so that marginals and edges of the moved body
follow exactly from Cov(x_j, r), which the tree gives by a recursion. Keeping these and
forgetting all other covariances is the nearest Gaussian on the tree (least Kullback-Leibler
divergence).
"""

from hrc_env.core.kernels import kernel
from hrc_env.tracking.models.axes import part_of, set_axes
from hrc_env.tracking.models.motion import learn_offsets
from hrc_env.tracking.tree.gaussian import ORDER, PARENT, invert, multiply, multiply_transposed

_LEFT, _RIGHT, _LEFT_HIP, _RIGHT_HIP = 1, 2, 7, 8  # shoulders: _RIGHT, _LEFT_HIP hang on _LEFT
_REORDER = {"reassoc", "contract", "nsz"}


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
