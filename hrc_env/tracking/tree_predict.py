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
    add_moved,
    add_moved_right,
    add_moved_transpose,
    invert,
    multiply,
    multiply_transposed,
)

_LEFT, _RIGHT, _LEFT_HIP, _RIGHT_HIP = 1, 2, 7, 8  # shoulders: _RIGHT, _LEFT_HIP hang on _LEFT
_JIT = {"cache": True, "nogil": True, "error_model": "numpy"}


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


@numba.njit(**_JIT)
def _move_covariances(cov, F, travel, Q, shared, w):
    """C' = F C F' + F Y D' + D Y' F' + D S D' + Q; edges likewise with the parent's F and D."""
    S, X, common = w.a, w.cross, w.with_root
    with_root, moved, out = w.b, w.c, w.d
    for m in range(len(ORDER) - 1, -1, -1):  # children first: an edge needs both ends as they were
        j = ORDER[m]
        q = PARENT[j]
        with_root[:] = 0.0
        add_moved(F[j], common[j], with_root)
        add_moved(travel[j], S, with_root)
        if q >= 0:
            moved[:] = 0.0
            add_moved(F[j], X[j], moved)
            add_moved_transpose(travel[j], common[q], moved)
            _start_with(shared, X[j])
            add_moved_right(moved, F[q], X[j])
            add_moved_right(with_root, travel[q], X[j])
        moved[:] = 0.0
        add_moved(F[j], cov[j], moved)
        add_moved_transpose(travel[j], common[j], moved)
        _start_with(Q[j], out)
        add_moved_right(moved, F[j], out)
        add_moved_right(with_root, travel[j], out)
        for i in range(6):
            for k in range(6):
                cov[j, i, k] = 0.5 * (out[i, k] + out[k, i])


@numba.njit(**_JIT)
def _start_with(noise, out):
    """out (6, 6) = noise (2, 2) x I3."""
    for i in range(6):
        for k in range(6):
            out[i, k] = 0.0
    for i in range(3):
        out[i, i], out[i, 3 + i] = noise[0, 0], noise[0, 1]
        out[3 + i, i], out[3 + i, 3 + i] = noise[1, 0], noise[1, 1]
