"""Four joints at a time: the blocks of the tree laid out so that vector instructions take them.

The joints stand in sixteen lanes (`lanes.JOINT_OF_LANE`), four to a quad. A quad is a sequence
of rows of four numbers, one number for each of its joints, so that one loop over a row does the
same arithmetic for four joints. Quads are ordered from the leaves to the root, and no joint of
the first three hangs on another of its own quad: an elimination takes quads 0, 1 and 2 once, and
quad 3 three times, first for the hips, then for the right shoulder, then for the root.
A matrix of 6x6 is 36 rows, row by row; `rows` is one flat array, and matrices are named by where
they begin in it.
"""

from hrc_env.core.kernels import kernel
from hrc_env.tracking.tree.gaussian import PARENT, inverse_of
from hrc_env.tracking.tree.lanes import JOINT_OF_LANE, LANE_OF_JOINT, LANES
from hrc_env.tracking.tree.vectors import (
    applied,
    product,
    product_transposed,
    transposed_applied,
    transposed_product,
)

QUADS = LANES // 4
PARENT_LANE = tuple(
    LANE_OF_JOINT[PARENT[j]] if j >= 0 and PARENT[j] >= 0 else -1 for j in JOINT_OF_LANE
)
"""Lane of a lane's parent; -1: it has none."""
PASSES = ((0, 0, 4), (1, 0, 4), (2, 0, 3), (3, 0, 2), (3, 2, 3))
"""Which quads tell which of their lanes' parents what they know, from the leaves to the root."""
DESCENT = (3, 3, 3, 2, 1, 0)
"""Quads from the root to the leaves; the first twice again, until all its lanes have parents."""

_BLOCK = 4 * 36
COV = 0
"""Marginal covariance; after it `SLOPE`, `ABOVE` (the parent's covariance), `EDGE` (covariance
with the parent)."""
SLOPE, ABOVE, EDGE = _BLOCK, 2 * _BLOCK, 3 * _BLOCK
OWN = 4 * _BLOCK
"""Precision given the parent; then that times slope; then the slope's transpose times that."""
PULL, BACK = 5 * _BLOCK, 6 * _BLOCK
KNOWN, HESSIAN = 7 * _BLOCK, 8 * _BLOCK
"""What measurements and subtree say; with the prior's."""
INVERSE, MESSAGE = 9 * _BLOCK, 10 * _BLOCK
GRADIENT = 11 * _BLOCK
STEP, ABOVE_STEP, PULLED = GRADIENT + 24, GRADIENT + 48, GRADIENT + 72
PROPER = GRADIENT + 96
"""1 where a matrix was positive definite."""
POSITIONS = PROPER + 4
"""Here begins what `tree.search` keeps."""
QUAD = POSITIONS + 4 * 92
"""Numbers of a quad."""
_REORDER = {"reassoc", "contract", "nsz"}  # lets sums vectorise; NaN and infinity keep meaning


@kernel(forceinline=True)
def offset(at):
    """The same number, of which the compiler then knows that it is not negative.

    Without that an index might count from the end, and no loop would become vector instructions.
    """
    return max(at, 0)


@kernel
def load_tree(cov, slope, rows):
    """Put marginals and slopes (J, 6, 6) into their rows; beside them each parent's marginal.

    `EDGE` gets the covariance with the parent.
    """
    for lane in range(LANES):
        j = JOINT_OF_LANE[lane]
        at = lane // 4 * QUAD + lane % 4
        if j < 0 or PARENT[j] < 0:
            for n in range(36):
                unit = 1.0 if n % 7 == 0 else 0.0
                rows[at + COV + 4 * n] = rows[at + ABOVE + 4 * n] = unit
                rows[at + SLOPE + 4 * n] = 0.0
        if j < 0:
            continue
        for i in range(6):
            for k in range(6):
                rows[at + COV + 24 * i + 4 * k] = cov[j, i, k]
        if PARENT[j] >= 0:
            for i in range(6):
                for k in range(6):
                    rows[at + SLOPE + 24 * i + 4 * k] = slope[j, i, k]
    for quad in range(QUADS):
        at = quad * QUAD
        fetch_above(rows, quad, COV, ABOVE, 36)
        multiply_rows(rows, at + SLOPE, at + ABOVE, at + EDGE)


@kernel
def store_tree(rows, marginals, cov, slope):
    """Marginals, of which only the lower halves are looked at, and slopes out of their rows.

    `marginals` is where the former begin.
    """
    for lane in range(LANES):
        j = JOINT_OF_LANE[lane]
        if j < 0:
            continue
        at = lane // 4 * QUAD + lane % 4
        for i in range(6):
            for k in range(i + 1):
                cov[j, i, k] = cov[j, k, i] = rows[at + marginals + 24 * i + 4 * k]
        if PARENT[j] >= 0:
            for i in range(6):
                for k in range(6):
                    slope[j, i, k] = rows[at + SLOPE + 24 * i + 4 * k]


@kernel
def fetch_above(rows, quad, source, target, n_rows):
    """Copy rows of the parents beside a quad's own; where there is no parent, they stay."""
    source, target = offset(source), offset(target)
    base = quad * QUAD
    if quad == 0:
        for n in range(4 * n_rows):
            rows[target + n] = rows[QUAD + source + n]
        return
    for lane in range(4):
        parent = PARENT_LANE[4 * quad + lane]
        to = offset(base + lane) + target
        if parent < 0:
            continue
        where = offset(parent // 4 * QUAD + parent % 4) + source
        for n in range(n_rows):
            rows[to + 4 * n] = rows[where + 4 * n]


@kernel
def pass_on(rows, step, source, target, n_rows):
    """Add rows of the lanes of a step of `PASSES` to those of their parents."""
    source, target = offset(source), offset(target)
    quad, first, last = PASSES[step]
    if quad == 0:
        for n in range(4 * n_rows):
            rows[QUAD + target + n] += rows[source + n]
        return
    for lane in range(first, last):
        parent = PARENT_LANE[4 * quad + lane]
        here = offset(quad * QUAD + lane) + source
        to = offset(parent // 4 * QUAD + parent % 4) + target
        for n in range(n_rows):
            rows[to + 4 * n] += rows[here + 4 * n]


@kernel
def multiply_rows(rows, a, b, out):
    """out = a b for 6x6 matrices."""
    product(rows, a, b, out)


@kernel
def multiply_transposed_rows(rows, a, b, out):
    """out = a b' for 6x6 matrices."""
    product_transposed(rows, a, b, out)


@kernel
def transposed_multiply_rows(rows, a, b, out):
    """out = a' b for 6x6 matrices."""
    transposed_product(rows, a, b, out)


@kernel
def apply_rows(rows, a, x, out):
    """out = a x for a 6x6 matrix and 6 numbers."""
    applied(rows, a, x, out)


@kernel
def apply_transposed_rows(rows, a, x, out):
    """out = a' x for a 6x6 matrix and 6 numbers."""
    transposed_applied(rows, a, x, out)


@kernel
def subtract_rows(rows, a, b, out):
    """out = a - b for 6x6 matrices."""
    a, b, out = offset(a), offset(b), offset(out)
    for n in range(144):
        rows[out + n] = rows[a + n] - rows[b + n]


@kernel
def add_rows(rows, a, b, out):
    """out = a + b for 6x6 matrices."""
    a, b, out = offset(a), offset(b), offset(out)
    for n in range(144):
        rows[out + n] = rows[a + n] + rows[b + n]


@kernel(fastmath=_REORDER)
def invert_rows(rows, at):
    """Inverses of a quad's symmetric `HESSIAN`, of which only the lower halves are looked at.

    Blockwise, as `tree.gaussian.invert`; `PROPER` gets 1 where the matrix is positive definite.
    """
    at = offset(at)
    for lane in range(4):
        m = at + HESSIAN + lane
        p = inverse_of(rows[m], *_pair(rows, m + 24), *_triple(rows, m + 48))
        b0, b1, b2 = _triple(rows, m + 72)
        c0, c1, c2 = _triple(rows, m + 96)
        d0, d1, d2 = _triple(rows, m + 120)
        x0, x1, x2 = along(p, b0, b1, b2)  # the slope of the lower half on the upper
        y0, y1, y2 = along(p, c0, c1, c2)
        z0, z1, z2 = along(p, d0, d1, d2)
        v = inverse_of(
            rows[m + 84] - (x0 * b0 + x1 * b1 + x2 * b2),
            rows[m + 108] - (y0 * b0 + y1 * b1 + y2 * b2),
            rows[m + 112] - (y0 * c0 + y1 * c1 + y2 * c2),
            rows[m + 132] - (z0 * b0 + z1 * b1 + z2 * b2),
            rows[m + 136] - (z0 * c0 + z1 * c1 + z2 * c2),
            rows[m + 140] - (z0 * d0 + z1 * d1 + z2 * d2),
        )
        f0, g0, h0 = along(v, x0, y0, z0)
        f1, g1, h1 = along(v, x1, y1, z1)
        f2, g2, h2 = along(v, x2, y2, z2)
        n = at + INVERSE + lane
        rows[n] = p[0] + x0 * f0 + y0 * g0 + z0 * h0
        rows[n + 4] = rows[n + 24] = p[1] + x1 * f0 + y1 * g0 + z1 * h0
        rows[n + 28] = p[2] + x1 * f1 + y1 * g1 + z1 * h1
        rows[n + 8] = rows[n + 48] = p[3] + x2 * f0 + y2 * g0 + z2 * h0
        rows[n + 32] = rows[n + 52] = p[4] + x2 * f1 + y2 * g1 + z2 * h1
        rows[n + 56] = p[5] + x2 * f2 + y2 * g2 + z2 * h2
        rows[n + 12], rows[n + 36], rows[n + 60] = -f0, -f1, -f2
        rows[n + 72], rows[n + 76], rows[n + 80] = -f0, -f1, -f2
        rows[n + 16], rows[n + 40], rows[n + 64] = -g0, -g1, -g2
        rows[n + 96], rows[n + 100], rows[n + 104] = -g0, -g1, -g2
        rows[n + 20], rows[n + 44], rows[n + 68] = -h0, -h1, -h2
        rows[n + 120], rows[n + 124], rows[n + 128] = -h0, -h1, -h2
        rows[n + 84], rows[n + 112], rows[n + 140] = v[0], v[2], v[5]
        rows[n + 88] = rows[n + 108] = v[1]
        rows[n + 92] = rows[n + 132] = v[3]
        rows[n + 116] = rows[n + 136] = v[4]
        rows[at + PROPER + lane] = 1.0 if p[6] and v[6] else 0.0


@kernel(forceinline=True)
def _pair(rows, m):
    return rows[m], rows[m + 4]


@kernel(forceinline=True)
def _triple(rows, m):
    return rows[m], rows[m + 4], rows[m + 8]


@kernel(fastmath=_REORDER, forceinline=True)
def along(half, x, y, z):
    """A symmetric 3x3 matrix, as `tree.gaussian.inverse_of` gives it, times (x, y, z)."""
    return (
        half[0] * x + half[1] * y + half[3] * z,
        half[1] * x + half[2] * y + half[4] * z,
        half[3] * x + half[4] * y + half[5] * z,
    )
