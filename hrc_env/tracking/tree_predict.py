"""The tree a moment later: damped joints about the middle of the torso, moments exact.

With r the mean of the four torso states, a joint moves by x' = F x + D r + constant + noise,
where F damps it towards its place on the body and D = [[1, dt], [0, 1]] - F lets it travel
with the torso. That is linear in the 90 numbers, so that marginals and edges of the moved body
follow exactly from Cov(x_j, r), which the tree gives by a recursion. Keeping these and
forgetting all other covariances is the nearest Gaussian on the tree (least Kullback-Leibler
divergence).
"""

import numba
import numpy as np

from hrc_env.tracking.acquisition import heading
from hrc_env.tracking.motion_model import learn_offsets
from hrc_env.tracking.tree import (
    HAS_CHILD,
    ORDER,
    PARENT,
    invert,
    multiply,
    multiply_transposed,
)

_LEFT, _RIGHT, _LEFT_HIP, _RIGHT_HIP = 1, 2, 7, 8  # shoulders: _RIGHT, _LEFT_HIP hang on _LEFT
_JIT = {"cache": True, "nogil": True, "error_model": "numpy"}
_REORDER = {"reassoc", "contract", "nsz"}


@numba.njit(**_JIT)
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
    for m in range(1, len(ORDER)):
        j = ORDER[m]
        multiply(slope[j], cov[PARENT[j]], w.cross[j])
    _relate_to_root(cov, slope, w)
    _move_covariances(cov, F, travel, Q, shared, w)
    for m in range(len(ORDER)):
        j = ORDER[m]
        known = not HAS_CHILD[j] or invert(cov[j], w.inverse[j], w.a)
        if not known:
            w.inverse[j] = 0.0
        if m > 0:
            multiply(w.cross[j], w.inverse[PARENT[j]], slope[j])


@numba.njit(**_JIT)
def _move_means(body, cov, offset, offset_count, F, travel, dt):
    root = np.zeros(6)
    for i in range(6):
        root[i] = 0.25 * (
            body[_LEFT, i] + body[_RIGHT, i] + body[_LEFT_HIP, i] + body[_RIGHT_HIP, i]
        )
    cos, sin, known = heading(body, np.ones(len(body), np.bool_))
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


@numba.njit(**_JIT)
def _relate_to_root(cov, slope, w):
    """Fill with_root (J, 6, 6) with Cov(x_j, r) and w.a with Cov(r, r); needs w.cross."""
    X, common = w.cross, w.with_root
    multiply(slope[_RIGHT_HIP], X[_RIGHT], w.b)  # right hip with left shoulder
    multiply_transposed(slope[_LEFT_HIP], X[_RIGHT], w.c)  # left hip with right shoulder
    multiply_transposed(slope[_RIGHT_HIP], w.c, w.d)  # right hip with left hip
    for i in range(6):
        for k in range(6):
            common[_LEFT, i, k] = (
                cov[_LEFT, i, k] + X[_RIGHT, k, i] + X[_LEFT_HIP, k, i] + w.b[k, i]
            )
            common[_RIGHT, i, k] = (
                X[_RIGHT, i, k] + cov[_RIGHT, i, k] + w.c[k, i] + X[_RIGHT_HIP, k, i]
            )
            common[_LEFT_HIP, i, k] = (
                X[_LEFT_HIP, i, k] + w.c[i, k] + cov[_LEFT_HIP, i, k] + w.d[k, i]
            )
            common[_RIGHT_HIP, i, k] = (
                w.b[i, k] + X[_RIGHT_HIP, i, k] + w.d[i, k] + cov[_RIGHT_HIP, i, k]
            )
    for i in range(6):
        for k in range(6):
            total = 0.0
            for j in (_LEFT, _RIGHT, _LEFT_HIP, _RIGHT_HIP):
                common[j, i, k] *= 0.25
                total += common[j, i, k]
            w.a[i, k] = 0.25 * total
    for m in range(len(ORDER)):
        j = ORDER[m]
        if j not in (_LEFT, _RIGHT, _LEFT_HIP, _RIGHT_HIP):
            multiply(slope[j], common[PARENT[j]], common[j])


@numba.njit(fastmath=_REORDER, **_JIT)
def _move_covariances(cov, F, travel, Q, shared, w):
    """C' = F C F' + F Y D' + D Y' F' + D S D' + Q; edges likewise with the parent's F and D."""
    S, X, common = w.a, w.cross, w.with_root
    for j in range(len(cov)):
        q, here = PARENT[j], (_entries(F[j], 0, 0, 1), _entries(travel[j], 0, 0, 1))
        for i in range(3):
            for k in range(i + 1):
                blocks = (cov[j], common[j], common[j], S)
                pp, pv, vp, vv = _moved(*blocks, i, k, *here, *here)
                cov[j, i, k] = cov[j, k, i] = pp
                cov[j, i, 3 + k] = cov[j, 3 + k, i] = pv
                cov[j, 3 + i, k] = cov[j, k, 3 + i] = vp
                cov[j, 3 + i, 3 + k] = cov[j, 3 + k, 3 + i] = vv
        _add_noise(Q[j], cov[j])
        if q < 0:
            continue
        there = (_entries(F[q], 0, 0, 1), _entries(travel[q], 0, 0, 1))
        for i in range(3):
            for k in range(3):
                moved = _moved(X[j], common[j], common[q], S, i, k, *here, *there)
                X[j, i, k], X[j, i, 3 + k], X[j, 3 + i, k], X[j, 3 + i, 3 + k] = moved
        _add_noise(shared, X[j])


@numba.njit(fastmath=_REORDER, forceinline=True, **_JIT)
def _moved(edge, own, other, S, i, k, f, d, g, e):
    """The (2, 2) entries of axes i, k of f edge g' + f own e' + d other' g' + d S e'."""
    c00, c01, c10, c11 = _entries(edge, i, k, 3)
    y00, y01, y10, y11 = _entries(own, i, k, 3)
    t00, t10, t01, t11 = _entries(other, k, i, 3)
    s00, s01, s10, s11 = _entries(S, i, k, 3)
    m00 = c00 * g[0] + c01 * g[1] + y00 * e[0] + y01 * e[1]
    m01 = c00 * g[2] + c01 * g[3] + y00 * e[2] + y01 * e[3]
    m10 = c10 * g[0] + c11 * g[1] + y10 * e[0] + y11 * e[1]
    m11 = c10 * g[2] + c11 * g[3] + y10 * e[2] + y11 * e[3]
    n00 = t00 * g[0] + t01 * g[1] + s00 * e[0] + s01 * e[1]
    n01 = t00 * g[2] + t01 * g[3] + s00 * e[2] + s01 * e[3]
    n10 = t10 * g[0] + t11 * g[1] + s10 * e[0] + s11 * e[1]
    n11 = t10 * g[2] + t11 * g[3] + s10 * e[2] + s11 * e[3]
    return (
        f[0] * m00 + f[1] * m10 + d[0] * n00 + d[1] * n10,
        f[0] * m01 + f[1] * m11 + d[0] * n01 + d[1] * n11,
        f[2] * m00 + f[3] * m10 + d[2] * n00 + d[3] * n10,
        f[2] * m01 + f[3] * m11 + d[2] * n01 + d[3] * n11,
    )


@numba.njit(forceinline=True, **_JIT)
def _entries(a, i, k, far):
    """Four entries of `a` that are `far` from each other, from (i, k) on: a 2x2 matrix."""
    return a[i, k], a[i, far + k], a[far + i, k], a[far + i, far + k]


@numba.njit(**_JIT)
def _add_noise(noise, out):
    """out (6, 6) += noise (2, 2) x I3."""
    for i in range(3):
        out[i, i] += noise[0, 0]
        out[i, 3 + i] += noise[0, 1]
        out[3 + i, i] += noise[1, 0]
        out[3 + i, 3 + i] += noise[1, 1]
