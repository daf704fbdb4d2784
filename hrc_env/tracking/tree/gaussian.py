"""Gaussian on the kinematic tree: parents of the joints, and algebra of 6x6 and 3x3 blocks.

Each joint's state x_j consists of its position [m] and velocity [m/s] in the world frame, 6
numbers. The distribution of all 90 numbers is stored as marginal covariances C_j (6, 6) and, for
every joint except the root, the slope B_j (6, 6) on its parent q:

    x_j - E x_j = B_j (x_q - E x_q) + independent noise,   Cov(x_j, x_q) = B_j C_q.

This representation is exact if each joint depends on the joints above it only through its parent.
"""

from typing import NamedTuple

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import BONES, N_JOINTS
from hrc_env.core.typing import Floats, Vector3

PARENT = (1, -1, 1, 1, 2, 3, 4, 1, 2, 7, 8, 9, 10, 11, 12)
"""Parent of each joint; -1 for the root. The left shoulder is the parent of the nose, the right
shoulder, the left elbow and the left hip."""
ORDER = (1, 0, 2, 7, 8, 3, 4, 5, 6, 9, 10, 11, 12, 13, 14)
"""Indices of the joints in an order in which parents precede their children."""
LEAVES_FIRST = ORDER[::-1]
"""Indices of the joints in an order in which children precede their parents."""
ROOT = ORDER[0]
"""Index of the joint without a parent, the left shoulder."""
_ends = [tuple(sorted(int(end) for end in ends)) for ends in BONES]
EDGE_BONE = tuple(
    _ends.index((min(j, PARENT[j]), max(j, PARENT[j]))) if j != ROOT else -1
    for j in range(N_JOINTS)
)
"""Row of `skeleton.BONES` with the bone from each joint to its parent; -1 for the root."""
_LEAST_PIVOT = 1e-13
"""Pivot below which a matrix is considered singular."""
_REORDER = {"reassoc", "contract", "nsz"}  # for vectorised sums; NaN and infinity remain valid


class Row6(NamedTuple):
    """One row of a 6x6 matrix."""

    c0: float
    """Entry in column 0."""
    c1: float
    """Entry in column 1."""
    c2: float
    """Entry in column 2."""
    c3: float
    """Entry in column 3."""
    c4: float
    """Entry in column 4."""
    c5: float
    """Entry in column 5."""


class Inverse3(NamedTuple):
    """Lower triangle of the inverse of a symmetric 3x3 matrix, and whether the inverse is valid."""

    a00: float
    """Entry (0, 0)."""
    a10: float
    """Entry (1, 0)."""
    a11: float
    """Entry (1, 1)."""
    a20: float
    """Entry (2, 0)."""
    a21: float
    """Entry (2, 1)."""
    a22: float
    """Entry (2, 2)."""
    is_positive: bool
    """Whether the matrix is positive definite."""


class Blocks(NamedTuple):
    """Factors of a symmetric 6x6 matrix [[U, L'], [L, D]] of 3x3 blocks."""

    upper: Inverse3
    """Inverse of the upper block, U^-1."""
    x: Vector3
    """U^-1 times row 0 of L, which is the slope of coordinate 3 on the first three."""
    y: Vector3
    """U^-1 times row 1 of L, which is the slope of coordinate 4 on the first three."""
    z: Vector3
    """U^-1 times row 2 of L, which is the slope of coordinate 5 on the first three."""
    lower: Inverse3
    """Inverse of the Schur complement of the upper block, (D - L U^-1 L')^-1."""


@kernel(fastmath=_REORDER, forceinline=True)
def _combine_rows(
    a0: float, a1: float, a2: float, a3: float, a4: float, a5: float, b: Floats
) -> Row6:
    """Return the sum of the rows of `b` (6, 6), weighted by `a0` to `a5`."""
    return Row6(
        a0 * b[0, 0] + a1 * b[1, 0] + a2 * b[2, 0] + a3 * b[3, 0] + a4 * b[4, 0] + a5 * b[5, 0],
        a0 * b[0, 1] + a1 * b[1, 1] + a2 * b[2, 1] + a3 * b[3, 1] + a4 * b[4, 1] + a5 * b[5, 1],
        a0 * b[0, 2] + a1 * b[1, 2] + a2 * b[2, 2] + a3 * b[3, 2] + a4 * b[4, 2] + a5 * b[5, 2],
        a0 * b[0, 3] + a1 * b[1, 3] + a2 * b[2, 3] + a3 * b[3, 3] + a4 * b[4, 3] + a5 * b[5, 3],
        a0 * b[0, 4] + a1 * b[1, 4] + a2 * b[2, 4] + a3 * b[3, 4] + a4 * b[4, 4] + a5 * b[5, 4],
        a0 * b[0, 5] + a1 * b[1, 5] + a2 * b[2, 5] + a3 * b[3, 5] + a4 * b[4, 5] + a5 * b[5, 5],
    )


@kernel(fastmath=_REORDER, forceinline=True)
def multiply(a: Floats, b: Floats, out: Floats) -> None:
    """Compute the product a b of 6x6 matrices in `out`, which may be `a`."""
    for i in range(6):
        row = _combine_rows(a[i, 0], a[i, 1], a[i, 2], a[i, 3], a[i, 4], a[i, 5], b)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4], out[i, 5] = row


@kernel(fastmath=_REORDER, forceinline=True)
def transposed_multiply(a: Floats, b: Floats, out: Floats) -> None:
    """Compute the product a' b of 6x6 matrices in `out`."""
    for i in range(6):
        row = _combine_rows(a[0, i], a[1, i], a[2, i], a[3, i], a[4, i], a[5, i], b)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4], out[i, 5] = row


@kernel(fastmath=_REORDER)
def multiply_transposed(a: Floats, b: Floats, out: Floats) -> None:
    """Compute the product a b' of 6x6 matrices in `out`."""
    for k in range(6):
        b0, b1, b2, b3, b4, b5 = b[k, 0], b[k, 1], b[k, 2], b[k, 3], b[k, 4], b[k, 5]
        for i in range(6):
            near = a[i, 0] * b0 + a[i, 1] * b1 + a[i, 2] * b2
            out[i, k] = near + a[i, 3] * b3 + a[i, 4] * b4 + a[i, 5] * b5


@kernel(fastmath=_REORDER, forceinline=True)
def invert_half(a00: float, a10: float, a11: float, a20: float, a21: float, a22: float) -> Inverse3:
    """Return the inverse of a symmetric 3x3 matrix from its L D L' factors.

    Unlike the cofactor formula, this remains accurate if the matrix is nearly singular.

    Args:
        a00: element (0, 0) of the lower triangle.
        a10: element (1, 0) of the lower triangle.
        a11: element (1, 1) of the lower triangle.
        a20: element (2, 0) of the lower triangle.
        a21: element (2, 1) of the lower triangle.
        a22: element (2, 2) of the lower triangle.
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
    is_positive = a00 > _LEAST_PIVOT and p1 > _LEAST_PIVOT and p2 > _LEAST_PIVOT
    return Inverse3(i00, i10, i11, i20, i21, i22, is_positive)


@kernel(fastmath=_REORDER, forceinline=True)
def invert3(a: Floats, out: Floats) -> None:
    """Compute the inverse of a symmetric 3x3 matrix in `out`; only its lower triangle is read."""
    half = invert_half(a[0, 0], a[1, 0], a[1, 1], a[2, 0], a[2, 1], a[2, 2])
    out[0, 0], out[1, 1], out[2, 2] = half.a00, half.a11, half.a22
    out[1, 0] = out[0, 1] = half.a10
    out[2, 0] = out[0, 2] = half.a20
    out[2, 1] = out[1, 2] = half.a21


@kernel(fastmath=_REORDER, forceinline=True)
def _apply(half: Inverse3, x: float, y: float, z: float) -> Vector3:
    """Return the product of an inverse with the vector (x, y, z)."""
    return Vector3(
        half.a00 * x + half.a10 * y + half.a20 * z,
        half.a10 * x + half.a11 * y + half.a21 * z,
        half.a20 * x + half.a21 * y + half.a22 * z,
    )


@kernel(fastmath=_REORDER, forceinline=True)
def _factor(a: Floats) -> Blocks:
    """Return the factors of a symmetric 6x6 matrix; only its lower triangle is read."""
    upper = invert_half(a[0, 0], a[1, 0], a[1, 1], a[2, 0], a[2, 1], a[2, 2])
    x = _apply(upper, a[3, 0], a[3, 1], a[3, 2])
    y = _apply(upper, a[4, 0], a[4, 1], a[4, 2])
    z = _apply(upper, a[5, 0], a[5, 1], a[5, 2])
    lower = invert_half(
        a[3, 3] - (x.x * a[3, 0] + x.y * a[3, 1] + x.z * a[3, 2]),
        a[4, 3] - (y.x * a[3, 0] + y.y * a[3, 1] + y.z * a[3, 2]),
        a[4, 4] - (y.x * a[4, 0] + y.y * a[4, 1] + y.z * a[4, 2]),
        a[5, 3] - (z.x * a[3, 0] + z.y * a[3, 1] + z.z * a[3, 2]),
        a[5, 4] - (z.x * a[4, 0] + z.y * a[4, 1] + z.z * a[4, 2]),
        a[5, 5] - (z.x * a[5, 0] + z.y * a[5, 1] + z.z * a[5, 2]),
    )
    return Blocks(upper, x, y, z, lower)


@kernel(fastmath=_REORDER)
def is_positive_definite(a: Floats) -> bool:
    """Return whether a symmetric 6x6 matrix is positive definite; its lower triangle is read."""
    blocks = _factor(a)
    return blocks.upper.is_positive and blocks.lower.is_positive


@kernel(fastmath=_REORDER)
def invert(a: Floats, out: Floats) -> bool:
    """Compute the inverse of a symmetric 6x6 matrix in `out`; return whether it is valid.

    The inverse is valid if the matrix is positive definite.
    """
    blocks = _factor(a)
    p, x, y, z, v = blocks.upper, blocks.x, blocks.y, blocks.z, blocks.lower
    for k in range(3):
        f, g, h = _apply(v, x[k], y[k], z[k])
        out[3, k], out[4, k], out[5, k] = -f, -g, -h
        out[k, 3], out[k, 4], out[k, 5] = -f, -g, -h
        for i in range(3):
            out[i, k] = x[i] * f + y[i] * g + z[i] * h
    out[0, 0] += p.a00
    out[1, 1] += p.a11
    out[2, 2] += p.a22
    out[1, 0] = out[0, 1] = out[1, 0] + p.a10
    out[2, 0] = out[0, 2] = out[2, 0] + p.a20
    out[2, 1] = out[1, 2] = out[2, 1] + p.a21
    out[3, 3], out[4, 4], out[5, 5] = v.a00, v.a11, v.a22
    out[4, 3] = out[3, 4] = v.a10
    out[5, 3] = out[3, 5] = v.a20
    out[5, 4] = out[4, 5] = v.a21
    return p.is_positive and v.is_positive
