"""A Gaussian on the kinematic tree: which joint hangs on which, and algebra of its blocks.

Each joint's state x_j is its position [m] and velocity [m/s] in the world, 6 numbers. The
joint distribution of all 90 is kept as marginal covariances C_j (6, 6) and, for every joint but
the root, the slope B_j (6, 6) with which it follows its parent q:

    x_j - E x_j = B_j (x_q - E x_q) + independent noise,   Cov(x_j, x_q) = B_j C_q.

Everything that these say is exact; a joint depends on all others through its parent only.
"""

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import BONES, N_JOINTS

PARENT = (1, -1, 1, 1, 2, 3, 4, 1, 2, 7, 8, 9, 10, 11, 12)
"""Parents: the nose, the right shoulder and the left half hang on the left shoulder."""
ORDER = (1, 0, 2, 7, 8, 3, 4, 5, 6, 9, 10, 11, 12, 13, 14)
"""Joints with every parent before its children."""
ROOT = ORDER[0]
_ends = [tuple(sorted(int(end) for end in ends)) for ends in BONES]
EDGE_BONE = tuple(
    _ends.index((min(j, PARENT[j]), max(j, PARENT[j]))) if j != ROOT else -1
    for j in range(N_JOINTS)
)
"""Row of `skeleton.BONES` that joins a joint to its parent; -1 for the root."""
_LEAST_PIVOT = 1e-13
_REORDER = {"reassoc", "contract", "nsz"}  # lets sums vectorise; NaN and infinity keep meaning


@kernel(fastmath=_REORDER)
def multiply(a, b, out):
    """out = a b for 6x6 matrices."""
    for i in range(6):
        a0, a1, a2, a3, a4, a5 = a[i, 0], a[i, 1], a[i, 2], a[i, 3], a[i, 4], a[i, 5]
        for k in range(6):
            near = a0 * b[0, k] + a1 * b[1, k] + a2 * b[2, k]
            out[i, k] = near + a3 * b[3, k] + a4 * b[4, k] + a5 * b[5, k]


@kernel(fastmath=_REORDER)
def multiply_transposed(a, b, out):
    """out = a b' for 6x6 matrices."""
    for k in range(6):
        b0, b1, b2, b3, b4, b5 = b[k, 0], b[k, 1], b[k, 2], b[k, 3], b[k, 4], b[k, 5]
        for i in range(6):
            near = a[i, 0] * b0 + a[i, 1] * b1 + a[i, 2] * b2
            out[i, k] = near + a[i, 3] * b3 + a[i, 4] * b4 + a[i, 5] * b5


@kernel(fastmath=_REORDER, forceinline=True)
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


@kernel(fastmath=_REORDER)
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
