"""Positions on the tree, four joints at a time: prior, bones, and the step of a search.

The prior of the positions alone is taken as a tree of 3-vectors; rows and quads are those of
`quads`. Of symmetric matrices six rows are kept: 00, 10, 11, 20, 21, 22.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.tracking.tree.gaussian import inverse_of
from hrc_env.tracking.tree.quads import (
    ABOVE,
    COV,
    DESCENT,
    EDGE,
    PASSES,
    POSITIONS,
    QUAD,
    QUADS,
    along,
    fetch_above,
    offset,
    pass_on,
)

_PRECISION = POSITIONS
"""Of a position given its parent's (6 rows); then that times the slope (9), and the slope's
transpose times that (6)."""
_PULL, _BACK = _PRECISION + 24, _PRECISION + 60
BONE, CAMERA = _PRECISION + 84, _PRECISION + 120
"""Information (6) and gradient (3), as functions of the shifts, at none."""
_NODE, _TOLD = _PRECISION + 156, _PRECISION + 192
"""Cameras and subtree; what the parent is told of them."""
_INVERSE, _FOLLOW, _TOTAL = _PRECISION + 228, _PRECISION + 252, _PRECISION + 288
"""Inverse Hessian (6), slope on the parent's shift (9), gradient (3)."""
SHIFT, POINT = _PRECISION + 300, _PRECISION + 312
"""From the predicted mean to the point of linearisation [m]; that point (3 each)."""
ABOVE_SHIFT, _ABOVE_POINT = _PRECISION + 324, _PRECISION + 336
MEAN, LENGTH, VARIANCE = _PRECISION + 348, _PRECISION + 360, _PRECISION + 364
_REORDER = {"reassoc", "contract", "nsz"}


@kernel(fastmath=_REORDER)
def position_prior(rows, at):
    """Precisions of a quad's positions given their parents'; needs the covariances with these."""
    at = offset(at)
    for lane in range(4):
        m = at + lane
        a = m + ABOVE
        above = inverse_of(*_lower(rows, a))
        e = m + EDGE
        e00, e01, e02 = rows[e], rows[e + 4], rows[e + 8]
        e10, e11, e12 = rows[e + 24], rows[e + 28], rows[e + 32]
        e20, e21, e22 = rows[e + 48], rows[e + 52], rows[e + 56]
        f00, f01, f02 = along(above, e00, e01, e02)  # the slope
        f10, f11, f12 = along(above, e10, e11, e12)
        f20, f21, f22 = along(above, e20, e21, e22)
        c00, c10, c11, c20, c21, c22 = _lower(rows, m + COV)
        given = inverse_of(
            c00 - (f00 * e00 + f01 * e01 + f02 * e02),
            c10 - (f10 * e00 + f11 * e01 + f12 * e02),
            c11 - (f10 * e10 + f11 * e11 + f12 * e12),
            c20 - (f20 * e00 + f21 * e01 + f22 * e02),
            c21 - (f20 * e10 + f21 * e11 + f22 * e12),
            c22 - (f20 * e20 + f21 * e21 + f22 * e22),
        )
        _put(rows, m + _PRECISION, given)
        p00, p10, p20 = along(given, f00, f10, f20)
        p01, p11, p21 = along(given, f01, f11, f21)
        p02, p12, p22 = along(given, f02, f12, f22)
        n = m + _PULL
        rows[n], rows[n + 4], rows[n + 8] = p00, p01, p02
        rows[n + 12], rows[n + 16], rows[n + 20] = p10, p11, p12
        rows[n + 24], rows[n + 28], rows[n + 32] = p20, p21, p22
        n = m + _BACK
        rows[n] = f00 * p00 + f10 * p10 + f20 * p20
        rows[n + 4] = f01 * p00 + f11 * p10 + f21 * p20
        rows[n + 8] = f01 * p01 + f11 * p11 + f21 * p21
        rows[n + 12] = f02 * p00 + f12 * p10 + f22 * p20
        rows[n + 16] = f02 * p01 + f12 * p11 + f22 * p21
        rows[n + 20] = f02 * p02 + f12 * p12 + f22 * p22


@kernel(fastmath=_REORDER)
def linearise_bones(rows, at):
    """What the bones from a quad's joints to their parents say, at the points."""
    at = offset(at)
    for lane in range(4):
        m = at + lane
        x = rows[m + POINT] - rows[m + _ABOVE_POINT]
        y = rows[m + POINT + 4] - rows[m + _ABOVE_POINT + 4]
        z = rows[m + POINT + 8] - rows[m + _ABOVE_POINT + 8]
        now = math.sqrt(x * x + y * y + z * z) + 1e-9
        scale = 1.0 / now
        x, y, z = x * scale, y * scale, z * scale
        miss = rows[m + LENGTH] - now
        miss += x * (rows[m + SHIFT] - rows[m + ABOVE_SHIFT])
        miss += y * (rows[m + SHIFT + 4] - rows[m + ABOVE_SHIFT + 4])
        miss += z * (rows[m + SHIFT + 8] - rows[m + ABOVE_SHIFT + 8])
        known = 1.0 / rows[m + VARIANCE]
        px, py, pz = x * known, y * known, z * known
        n = m + BONE
        rows[n], rows[n + 4], rows[n + 8] = px * x, py * x, py * y
        rows[n + 12], rows[n + 16], rows[n + 20] = pz * x, pz * y, pz * z
        rows[n + 24], rows[n + 28], rows[n + 32] = px * miss, py * miss, pz * miss


@kernel
def solve_positions(rows):
    """Shifts = the minimum of the quadratic that prior, cameras and bones make."""
    for quad in range(QUADS):
        for n in range(36):
            rows[quad * QUAD + _NODE + n] = rows[quad * QUAD + CAMERA + n]
    for step in range(len(PASSES)):
        _eliminate(rows, PASSES[step][0] * QUAD)
        pass_on(rows, step, _TOLD, _NODE, 9)
    _eliminate(rows, (QUADS - 1) * QUAD)
    for n in range(len(DESCENT)):
        fetch_above(rows, DESCENT[n], SHIFT, ABOVE_SHIFT, 3)
        _shift(rows, DESCENT[n] * QUAD)


@kernel(fastmath=_REORDER)
def _eliminate(rows, at):
    """Slopes and inverse Hessians of a quad's shifts, and what these tell the parents'."""
    at = offset(at)
    for lane in range(4):
        m = at + lane
        b00, b10, b11, b20, b21, b22 = _six(rows, m + BONE)
        n00, n10, n11, n20, n21, n22 = _six(rows, m + _NODE)
        q00, q10, q11, q20, q21, q22 = _six(rows, m + _PRECISION)
        inverse = inverse_of(
            n00 + q00 + b00,
            n10 + q10 + b10,
            n11 + q11 + b11,
            n20 + q20 + b20,
            n21 + q21 + b21,
            n22 + q22 + b22,
        )
        _put(rows, m + _INVERSE, inverse)
        n = m + _PULL
        c00, c01, c02 = rows[n] + b00, rows[n + 4] + b10, rows[n + 8] + b20
        c10, c11, c12 = rows[n + 12] + b10, rows[n + 16] + b11, rows[n + 20] + b21
        c20, c21, c22 = rows[n + 24] + b20, rows[n + 28] + b21, rows[n + 32] + b22
        f00, f10, f20 = along(inverse, c00, c10, c20)
        f01, f11, f21 = along(inverse, c01, c11, c21)
        f02, f12, f22 = along(inverse, c02, c12, c22)
        n = m + _FOLLOW
        rows[n], rows[n + 4], rows[n + 8] = f00, f01, f02
        rows[n + 12], rows[n + 16], rows[n + 20] = f10, f11, f12
        rows[n + 24], rows[n + 28], rows[n + 32] = f20, f21, f22
        e0, e1, e2 = rows[m + BONE + 24], rows[m + BONE + 28], rows[m + BONE + 32]
        g0 = rows[m + _NODE + 24] + e0
        g1 = rows[m + _NODE + 28] + e1
        g2 = rows[m + _NODE + 32] + e2
        rows[m + _TOTAL], rows[m + _TOTAL + 4], rows[m + _TOTAL + 8] = g0, g1, g2
        t00, t10, t11, t20, t21, t22 = _six(rows, m + _BACK)
        n = m + _TOLD
        rows[n] = t00 + b00 - (c00 * f00 + c10 * f10 + c20 * f20)
        rows[n + 4] = t10 + b10 - (c01 * f00 + c11 * f10 + c21 * f20)
        rows[n + 8] = t11 + b11 - (c01 * f01 + c11 * f11 + c21 * f21)
        rows[n + 12] = t20 + b20 - (c02 * f00 + c12 * f10 + c22 * f20)
        rows[n + 16] = t21 + b21 - (c02 * f01 + c12 * f11 + c22 * f21)
        rows[n + 20] = t22 + b22 - (c02 * f02 + c12 * f12 + c22 * f22)
        rows[n + 24] = f00 * g0 + f10 * g1 + f20 * g2 - e0
        rows[n + 28] = f01 * g0 + f11 * g1 + f21 * g2 - e1
        rows[n + 32] = f02 * g0 + f12 * g1 + f22 * g2 - e2


@kernel(fastmath=_REORDER)
def _shift(rows, at):
    """A quad's shifts, given their parents'; and the points to which they lead."""
    at = offset(at)
    for lane in range(4):
        m = at + lane
        v00, v10, v11, v20, v21, v22 = _six(rows, m + _INVERSE)
        g0, g1, g2 = rows[m + _TOTAL], rows[m + _TOTAL + 4], rows[m + _TOTAL + 8]
        n = m + ABOVE_SHIFT
        x, y, z = rows[n], rows[n + 4], rows[n + 8]
        f = m + _FOLLOW
        s0 = v00 * g0 + v10 * g1 + v20 * g2
        s1 = v10 * g0 + v11 * g1 + v21 * g2
        s2 = v20 * g0 + v21 * g1 + v22 * g2
        s0 += rows[f] * x + rows[f + 4] * y + rows[f + 8] * z
        s1 += rows[f + 12] * x + rows[f + 16] * y + rows[f + 20] * z
        s2 += rows[f + 24] * x + rows[f + 28] * y + rows[f + 32] * z
        n = m + SHIFT
        rows[n], rows[n + 4], rows[n + 8] = s0, s1, s2
        mean, n = m + MEAN, m + POINT
        rows[n], rows[n + 4], rows[n + 8] = (
            rows[mean] + s0,
            rows[mean + 4] + s1,
            rows[mean + 8] + s2,
        )


@kernel(forceinline=True)
def _lower(rows, m):
    """Six numbers of the upper left 3x3 block of a symmetric 6x6 matrix."""
    near = (rows[m], rows[m + 24], rows[m + 28])
    return (*near, rows[m + 48], rows[m + 52], rows[m + 56])


@kernel(forceinline=True)
def _six(rows, m):
    return rows[m], rows[m + 4], rows[m + 8], rows[m + 12], rows[m + 16], rows[m + 20]


@kernel(forceinline=True)
def _put(rows, m, half):
    rows[m], rows[m + 4], rows[m + 8] = half[0], half[1], half[2]
    rows[m + 12], rows[m + 16], rows[m + 20] = half[3], half[4], half[5]
