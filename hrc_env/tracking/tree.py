"""A Gaussian on the kinematic tree: which joint hangs on which, and algebra of its blocks.

Each joint's state x_j is its position [m] and velocity [m/s] in the world, 6 numbers. The
joint distribution of all 90 is kept as marginal covariances C_j (6, 6) and, for every joint but
the root, the slope B_j (6, 6) with which it follows its parent q:

    x_j - E x_j = B_j (x_q - E x_q) + independent noise,   Cov(x_j, x_q) = B_j C_q.

Everything that these say is exact; a joint depends on all others through its parent only.
"""

import math
from typing import NamedTuple

import numba
import numpy as np

from hrc_env.skeleton import BONES, N_JOINTS
from hrc_env.typing import Floats

PARENT = (1, -1, 1, 1, 2, 3, 4, 1, 2, 7, 8, 9, 10, 11, 12)
"""Parents: the nose, the right shoulder and the left half hang on the left shoulder."""
ORDER = (1, 0, 2, 7, 8, 3, 4, 5, 6, 9, 10, 11, 12, 13, 14)
"""Joints with every parent before its children."""
HAS_CHILD = tuple(j in PARENT for j in range(N_JOINTS))
ROOT = ORDER[0]
_ends = [tuple(sorted(int(end) for end in ends)) for ends in BONES]
EDGE_BONE = tuple(
    _ends.index((min(j, PARENT[j]), max(j, PARENT[j]))) if j != ROOT else -1
    for j in range(N_JOINTS)
)
"""Row of `skeleton.BONES` that joins a joint to its parent; -1 for the root."""
_JIT = {"cache": True, "nogil": True, "error_model": "numpy"}
_REORDER = {"reassoc", "contract", "nsz"}  # lets sums vectorise; NaN and infinity keep meaning


class Work(NamedTuple):
    """Scratch of one body's prediction and update."""

    a: Floats
    b: Floats
    c: Floats
    d: Floats
    """Four times (6, 6)."""
    cross: Floats
    """(J, 6, 6) Cov(x_j, x_parent)."""
    with_root: Floats
    """(J, 6, 6) Cov(x_j, r) with the mean r of the torso."""
    inverse: Floats
    """(J, 6, 6) inverse marginals of a prediction; inverse Hessians of an update's nodes."""
    information: Floats
    """(J, 6, 6) what a node's measurements and its subtree say of it."""
    gradient: Floats
    """(J, 6)."""
    step: Floats
    """(J, 6) change of the mean."""
    camera_information: Floats
    """(J, 3, 3) [1/m^2]."""
    camera_gradient: Floats
    """(J, 3) [1/m]."""
    point: Floats
    """(J, 3) where the cameras are linearised [m]."""
    shift: Floats
    """(J, 3) from the predicted mean to there [m]."""
    edge_information: Floats
    """(J, 3, 3) what bones say of x_j - x_parent [1/m^2]; 0 at the root."""
    edge_gradient: Floats
    """(J, 3) [1/m]."""
    across: Floats
    """(3, 3) covariance of the right shoulder's place seen from the left one [m^2]."""
    prior: Floats
    """(3, J, 3, 3) of a position given its parent's: precision; precision times slope; its
    slope's transpose times that."""
    node: Floats
    """(2, J, 3, 3) what position elimination keeps: inverse Hessian and slope."""
    node_gradient: Floats
    """(J, 3)."""
    small: Floats
    """(3, 3, 3)."""


@numba.njit(**_JIT)
def make_work():
    """Scratch with room for one body, made inside a kernel: once for all bodies."""
    block, pair, single = (N_JOINTS, 6, 6), (N_JOINTS, 3, 3), (N_JOINTS, 3)
    return Work(
        a=np.zeros((6, 6)),
        b=np.zeros((6, 6)),
        c=np.zeros((6, 6)),
        d=np.zeros((6, 6)),
        cross=np.zeros(block),
        with_root=np.zeros(block),
        inverse=np.zeros(block),
        information=np.zeros(block),
        gradient=np.zeros((N_JOINTS, 6)),
        step=np.zeros((N_JOINTS, 6)),
        camera_information=np.zeros(pair),
        camera_gradient=np.zeros(single),
        point=np.zeros(single),
        shift=np.zeros(single),
        edge_information=np.zeros(pair),
        edge_gradient=np.zeros(single),
        across=np.zeros((3, 3)),
        prior=np.zeros((3, N_JOINTS, 3, 3)),
        node=np.zeros((2, N_JOINTS, 3, 3)),
        node_gradient=np.zeros(single),
        small=np.zeros((3, 3, 3)),
    )


@numba.njit(fastmath=_REORDER, **_JIT)
def multiply(a, b, out):
    """out = a b for 6x6 matrices."""
    for i in range(6):
        a0, a1, a2, a3, a4, a5 = a[i, 0], a[i, 1], a[i, 2], a[i, 3], a[i, 4], a[i, 5]
        for k in range(6):
            near = a0 * b[0, k] + a1 * b[1, k] + a2 * b[2, k]
            out[i, k] = near + a3 * b[3, k] + a4 * b[4, k] + a5 * b[5, k]


@numba.njit(fastmath=_REORDER, **_JIT)
def multiply_transposed(a, b, out):
    """out = a b' for 6x6 matrices."""
    for k in range(6):
        b0, b1, b2, b3, b4, b5 = b[k, 0], b[k, 1], b[k, 2], b[k, 3], b[k, 4], b[k, 5]
        for i in range(6):
            near = a[i, 0] * b0 + a[i, 1] * b1 + a[i, 2] * b2
            out[i, k] = near + a[i, 3] * b3 + a[i, 4] * b4 + a[i, 5] * b5


@numba.njit(fastmath=_REORDER, **_JIT)
def transposed_multiply(a, b, out):
    """out = a' b for 6x6 matrices."""
    for i in range(6):
        a0, a1, a2, a3, a4, a5 = a[0, i], a[1, i], a[2, i], a[3, i], a[4, i], a[5, i]
        for k in range(6):
            near = a0 * b[0, k] + a1 * b[1, k] + a2 * b[2, k]
            out[i, k] = near + a3 * b[3, k] + a4 * b[4, k] + a5 * b[5, k]


@numba.njit(fastmath=_REORDER, **_JIT)
def add_moved(f, a, out):
    """out += (f x I3) a, for f (2, 2) on (position, velocity) and a (6, 6)."""
    f00, f01, f10, f11 = f[0, 0], f[0, 1], f[1, 0], f[1, 1]
    for i in range(3):
        for k in range(6):
            p, v = a[i, k], a[3 + i, k]
            out[i, k] += f00 * p + f01 * v
            out[3 + i, k] += f10 * p + f11 * v


@numba.njit(fastmath=_REORDER, **_JIT)
def add_moved_transpose(f, a, out):
    """out += (f x I3) a'."""
    f00, f01, f10, f11 = f[0, 0], f[0, 1], f[1, 0], f[1, 1]
    for i in range(3):
        for k in range(6):
            p, v = a[k, i], a[k, 3 + i]
            out[i, k] += f00 * p + f01 * v
            out[3 + i, k] += f10 * p + f11 * v


@numba.njit(fastmath=_REORDER, **_JIT)
def add_moved_right(a, f, out):
    """out += a (f x I3)'."""
    f00, f01, f10, f11 = f[0, 0], f[0, 1], f[1, 0], f[1, 1]
    for i in range(6):
        for k in range(3):
            p, v = a[i, k], a[i, 3 + k]
            out[i, k] += p * f00 + v * f01
            out[i, 3 + k] += p * f10 + v * f11


@numba.njit(fastmath=_REORDER, **_JIT)
def invert(a, out, factor):
    """Inverse of a symmetric positive definite 6x6 matrix; False if it is not one.

    By Cholesky: `factor` (6, 6) becomes the inverse of the lower factor.
    """
    for i in range(6):
        for k in range(i):
            rest = a[i, k]
            for m in range(k):
                rest -= factor[i, m] * factor[k, m]
            factor[i, k] = rest * factor[k, k]
        rest = a[i, i]
        for m in range(i):
            rest -= factor[i, m] * factor[i, m]
        if not rest > 1e-13:
            return False
        factor[i, i] = 1.0 / math.sqrt(rest)
    for i in range(1, 6):
        for k in range(i):
            rest = 0.0
            for m in range(k, i):
                rest -= factor[i, m] * factor[m, k]
            factor[i, k] = rest * factor[i, i]
    for i in range(6):
        for k in range(i + 1):
            total = 0.0
            for m in range(i, 6):
                total += factor[m, i] * factor[m, k]
            out[i, k] = out[k, i] = total
    return True
