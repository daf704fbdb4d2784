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
LEAVES_FIRST = ORDER[::-1]
ROOT = ORDER[0]
_ends = [tuple(sorted(int(end) for end in ends)) for ends in BONES]
EDGE_BONE = tuple(
    _ends.index((min(j, PARENT[j]), max(j, PARENT[j]))) if j != ROOT else -1
    for j in range(N_JOINTS)
)
"""Row of `skeleton.BONES` that joins a joint to its parent; -1 for the root."""
_LEAST_PIVOT = 1e-13
_REORDER = {"reassoc", "contract", "nsz"}  # lets sums vectorise; NaN and infinity keep meaning


@kernel(fastmath=_REORDER, forceinline=True)
def _combine(a0, a1, a2, a3, a4, a5, b):
    """Sum of the rows of a 6x6 matrix, each times a number."""
    return (
        a0 * b[0, 0] + a1 * b[1, 0] + a2 * b[2, 0] + a3 * b[3, 0] + a4 * b[4, 0] + a5 * b[5, 0],
        a0 * b[0, 1] + a1 * b[1, 1] + a2 * b[2, 1] + a3 * b[3, 1] + a4 * b[4, 1] + a5 * b[5, 1],
        a0 * b[0, 2] + a1 * b[1, 2] + a2 * b[2, 2] + a3 * b[3, 2] + a4 * b[4, 2] + a5 * b[5, 2],
        a0 * b[0, 3] + a1 * b[1, 3] + a2 * b[2, 3] + a3 * b[3, 3] + a4 * b[4, 3] + a5 * b[5, 3],
        a0 * b[0, 4] + a1 * b[1, 4] + a2 * b[2, 4] + a3 * b[3, 4] + a4 * b[4, 4] + a5 * b[5, 4],
        a0 * b[0, 5] + a1 * b[1, 5] + a2 * b[2, 5] + a3 * b[3, 5] + a4 * b[4, 5] + a5 * b[5, 5],
    )


@kernel(fastmath=_REORDER, forceinline=True)
def multiply(a, b, out):
    """out = a b for 6x6 matrices; nothing is written before a row is complete."""
    for i in range(6):
        row = _combine(a[i, 0], a[i, 1], a[i, 2], a[i, 3], a[i, 4], a[i, 5], b)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4], out[i, 5] = row


@kernel(fastmath=_REORDER, forceinline=True)
def transposed_multiply(a, b, out):
    """out = a' b for 6x6 matrices."""
    for i in range(6):
        row = _combine(a[0, i], a[1, i], a[2, i], a[3, i], a[4, i], a[5, i], b)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4], out[i, 5] = row


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

    Six numbers in, six and the answer out: 00, 10, 11, 20, 21, 22. Unlike cofactors it loses no
    digits where a matrix is nearly singular.
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


@kernel(fastmath=_REORDER, forceinline=True)
def invert3(a, out):
    """Inverse of a symmetric 3x3 matrix, of which only the lower half is looked at."""
    half = inverse_of(a[0, 0], a[1, 0], a[1, 1], a[2, 0], a[2, 1], a[2, 2])
    out[0, 0], out[1, 1], out[2, 2] = half[0], half[2], half[5]
    out[1, 0] = out[0, 1] = half[1]
    out[2, 0] = out[0, 2] = half[3]
    out[2, 1] = out[1, 2] = half[4]


@kernel(fastmath=_REORDER, forceinline=True)
def _times(half, x, y, z):
    """A symmetric 3x3 matrix, as `inverse_of` gives it, times (x, y, z)."""
    return (
        half[0] * x + half[1] * y + half[3] * z,
        half[1] * x + half[2] * y + half[4] * z,
        half[3] * x + half[4] * y + half[5] * z,
    )


@kernel(fastmath=_REORDER, forceinline=True)
def _blocks(a):
    """Inverses, as `inverse_of` gives them, of blocks of a symmetric 6x6 matrix.

    The first of its upper block, the last of what is left of the lower one when the upper is given;
    between them the slope of the lower half on the upper. Only the lower half of `a` is looked at.
    """
    p = inverse_of(a[0, 0], a[1, 0], a[1, 1], a[2, 0], a[2, 1], a[2, 2])
    x = _times(p, a[3, 0], a[3, 1], a[3, 2])
    y = _times(p, a[4, 0], a[4, 1], a[4, 2])
    z = _times(p, a[5, 0], a[5, 1], a[5, 2])
    v = inverse_of(
        a[3, 3] - (x[0] * a[3, 0] + x[1] * a[3, 1] + x[2] * a[3, 2]),
        a[4, 3] - (y[0] * a[3, 0] + y[1] * a[3, 1] + y[2] * a[3, 2]),
        a[4, 4] - (y[0] * a[4, 0] + y[1] * a[4, 1] + y[2] * a[4, 2]),
        a[5, 3] - (z[0] * a[3, 0] + z[1] * a[3, 1] + z[2] * a[3, 2]),
        a[5, 4] - (z[0] * a[4, 0] + z[1] * a[4, 1] + z[2] * a[4, 2]),
        a[5, 5] - (z[0] * a[5, 0] + z[1] * a[5, 1] + z[2] * a[5, 2]),
    )
    return p, x, y, z, v


@kernel(fastmath=_REORDER)
def is_positive_definite(a):
    """Whether a symmetric 6x6 matrix, of which the lower half is looked at, has an inverse."""
    p, _, _, _, v = _blocks(a)
    return p[6] and v[6]


@kernel(fastmath=_REORDER)
def invert(a, out):
    """Inverse of a symmetric 6x6 matrix by its blocks; whether it is positive definite."""
    p, x, y, z, v = _blocks(a)
    for k in range(3):
        f, g, h = _times(v, x[k], y[k], z[k])
        out[3, k], out[4, k], out[5, k] = -f, -g, -h
        out[k, 3], out[k, 4], out[k, 5] = -f, -g, -h
        for i in range(3):
            out[i, k] = x[i] * f + y[i] * g + z[i] * h
    out[0, 0] += p[0]
    out[1, 1] += p[2]
    out[2, 2] += p[5]
    out[1, 0] = out[0, 1] = out[1, 0] + p[1]
    out[2, 0] = out[0, 2] = out[2, 0] + p[3]
    out[2, 1] = out[1, 2] = out[2, 1] + p[4]
    out[3, 3], out[4, 4], out[5, 5] = v[0], v[2], v[5]
    out[4, 3] = out[3, 4] = v[1]
    out[5, 3] = out[3, 5] = v[3]
    out[5, 4] = out[4, 5] = v[4]
    return p[6] and v[6]
