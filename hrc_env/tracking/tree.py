"""A Gaussian on the kinematic tree: which joint hangs on which, and algebra of its blocks.

Each joint's state x_j is its position [m] and velocity [m/s] in the world, 6 numbers. The
joint distribution of all 90 is kept as marginal covariances C_j (6, 6) and, for every joint but
the root, the slope B_j (6, 6) with which it follows its parent q:

    x_j - E x_j = B_j (x_q - E x_q) + independent noise,   Cov(x_j, x_q) = B_j C_q.

Everything that these say is exact; a joint depends on all others through its parent only.
"""

from typing import NamedTuple

import numba
import numpy as np

from hrc_env.skeleton import BONES, N_JOINTS
from hrc_env.tracking.lanes import LANES, N_SUM_ROWS, N_VIEW_ROWS
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
_LEAST_PIVOT = 1e-13
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
    seen: Floats
    """One camera's rows of `lanes`."""
    sums: Floats
    """All cameras' rows of `lanes`."""


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
        seen=np.zeros(N_VIEW_ROWS * LANES),
        sums=np.zeros(N_SUM_ROWS * LANES),
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
def multiply_symmetric(a, b, out):
    """The lower three blocks of out = a b' for 6x6 matrices whose product is symmetric."""
    for k in range(3):
        p0, p1, p2, p3, p4, p5 = b[k, 0], b[k, 1], b[k, 2], b[k, 3], b[k, 4], b[k, 5]
        n = 3 + k
        v0, v1, v2, v3, v4, v5 = b[n, 0], b[n, 1], b[n, 2], b[n, 3], b[n, 4], b[n, 5]
        for i in range(3):
            near = a[i, 0] * p0 + a[i, 1] * p1 + a[i, 2] * p2
            out[i, k] = near + a[i, 3] * p3 + a[i, 4] * p4 + a[i, 5] * p5
            m = 3 + i
            near = a[m, 0] * p0 + a[m, 1] * p1 + a[m, 2] * p2
            out[m, k] = near + a[m, 3] * p3 + a[m, 4] * p4 + a[m, 5] * p5
            near = a[m, 0] * v0 + a[m, 1] * v1 + a[m, 2] * v2
            out[m, n] = near + a[m, 3] * v3 + a[m, 4] * v4 + a[m, 5] * v5


@numba.njit(fastmath=_REORDER, **_JIT)
def transposed_multiply_symmetric(a, b, out):
    """The lower three blocks of out = a' b for 6x6 matrices whose product is symmetric."""
    for k in range(3):
        p0, p1, p2, p3, p4, p5 = b[0, k], b[1, k], b[2, k], b[3, k], b[4, k], b[5, k]
        n = 3 + k
        v0, v1, v2, v3, v4, v5 = b[0, n], b[1, n], b[2, n], b[3, n], b[4, n], b[5, n]
        for i in range(3):
            near = a[0, i] * p0 + a[1, i] * p1 + a[2, i] * p2
            out[i, k] = near + a[3, i] * p3 + a[4, i] * p4 + a[5, i] * p5
            m = 3 + i
            near = a[0, m] * p0 + a[1, m] * p1 + a[2, m] * p2
            out[m, k] = near + a[3, m] * p3 + a[4, m] * p4 + a[5, m] * p5
            near = a[0, m] * v0 + a[1, m] * v1 + a[2, m] * v2
            out[m, n] = near + a[3, m] * v3 + a[4, m] * v4 + a[5, m] * v5


@numba.njit(fastmath=_REORDER, **_JIT)
def inverse_of(a00, a10, a11, a20, a21, a22):
    """Inverse of a symmetric 3x3 matrix by its L D L' factors; whether it is positive definite.

    Six numbers in, six and the answer out: 00, 10, 11, 20, 21, 22. Unlike by cofactors, a
    matrix that is nearly singular (a depth known far worse than what is across it) costs no
    digits.
    """
    d0 = 1.0 / a00
    l10, l20 = a10 * d0, a20 * d0
    p1, rest = a11 - l10 * a10, a21 - l20 * a10
    d1 = 1.0 / p1
    l21 = rest * d1
    p2 = a22 - l20 * a20 - l21 * rest
    i22 = 1.0 / p2
    back = l10 * l21 - l20
    i20, i21 = back * i22, -l21 * i22
    i11, i10 = d1 - l21 * i21, -l10 * d1 - l21 * i20
    i00 = d0 + l10 * l10 * d1 + back * i20
    proper = a00 > _LEAST_PIVOT and p1 > _LEAST_PIVOT and p2 > _LEAST_PIVOT
    return i00, i10, i11, i20, i21, i22, proper


@numba.njit(fastmath=_REORDER, **_JIT)
def halves_of(a, work):
    """Two inverses, as `inverse_of` gives them, of blocks of a symmetric 6x6 matrix.

    The first of its upper block, the second of what is left of the lower one when the upper is
    given; `a` is positive definite if both are. Only its lower half is looked at. The first
    three rows of `work` (6, 6) get the slope of the lower half on the upper.
    """
    p = inverse_of(a[0, 0], a[1, 0], a[1, 1], a[2, 0], a[2, 1], a[2, 2])
    for i in range(3):
        x, y, z = a[3 + i, 0], a[3 + i, 1], a[3 + i, 2]
        work[i, 0] = x * p[0] + y * p[1] + z * p[3]
        work[i, 1] = x * p[1] + y * p[2] + z * p[4]
        work[i, 2] = x * p[3] + y * p[4] + z * p[5]
    for i in range(3):
        for k in range(3):
            known = work[i, 0] * a[3 + k, 0] + work[i, 1] * a[3 + k, 1] + work[i, 2] * a[3 + k, 2]
            work[3 + i, k] = a[3 + i, 3 + k] - known
    v = inverse_of(work[3, 0], work[4, 0], work[4, 1], work[5, 0], work[5, 1], work[5, 2])
    return p, v


@numba.njit(fastmath=_REORDER, **_JIT)
def invert(a, out, work):
    """Inverse of a symmetric positive definite 6x6 matrix; False if it is not one.

    Only the lower half of `a` is looked at; `work` (6, 6) is scratch.
    """
    p, v = halves_of(a, work)
    if not (p[6] and v[6]):
        return False
    _fill(out, 3, v)
    _fill(out, 0, p)
    for k in range(3):
        x, y, z = work[0, k], work[1, k], work[2, k]
        out[3, k] = out[k, 3] = -(v[0] * x + v[1] * y + v[3] * z)
        out[4, k] = out[k, 4] = -(v[1] * x + v[2] * y + v[4] * z)
        out[5, k] = out[k, 5] = -(v[3] * x + v[4] * y + v[5] * z)
    for i in range(3):
        x, y, z = work[0, i], work[1, i], work[2, i]
        for k in range(3):
            out[i, k] -= x * out[3, k] + y * out[4, k] + z * out[5, k]
    return True


@numba.njit(**_JIT)
def _fill(out, at, half):
    """Put a symmetric 3x3 block, given by its lower half, on the diagonal of `out`."""
    out[at, at], out[at + 1, at + 1], out[at + 2, at + 2] = half[0], half[2], half[5]
    out[at + 1, at] = out[at, at + 1] = half[1]
    out[at + 2, at] = out[at, at + 2] = half[3]
    out[at + 2, at + 1] = out[at + 1, at + 2] = half[4]
