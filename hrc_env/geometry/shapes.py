"""Convex shapes as rows of numbers, and where a line passes through them, exactly.

A table (n, `WIDTH`) has a shape a row. A line starts at an eye and has a unit direction d; its
passage is the interval of the way from the eye [m] that lies in the shape, negative behind the
eye; `NEVER` has its entry after its exit. p is the eye less the shape's centre.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats

PLANE, BOX, CYLINDER, CAPSULE = range(4)
"""Kinds of shapes; a sphere is a capsule without length."""
KIND, CENTRE, AXES, HALF_SIZE, REACH, WIDTH = 0, 1, 4, 13, 16, 17
"""Columns of a table and their number: the centre [m], the shape's x, y and z axes, its half
edges (or its radius and half length along z) and the radius of the sphere that holds it [m]."""
NEVER = (math.inf, -math.inf)
PARALLEL = 1e-12
"""Square of the sine below which a line counts as parallel to an axis."""


def shape(kind: int, centre: Floats, axes: Floats, half_size: Floats) -> Floats:
    """The row (`WIDTH`,) of a shape of a kind.

    Args:
        kind: `PLANE`, `BOX`, `CYLINDER` or `CAPSULE`.
        centre: (3,) [m].
        axes: (3, 3) world_from_shape; cylinders and capsules lie along z, planes face z.
        half_size: (3,) half edges (infinite: endless), else radius, half length and 0 [m].
    """
    row = np.empty(WIDTH)
    row[KIND], row[CENTRE:AXES], row[AXES:HALF_SIZE] = kind, centre, axes.T.ravel()
    row[HALF_SIZE:REACH] = half_size
    row[REACH] = half_size.sum() if kind == CAPSULE else np.sqrt((half_size**2).sum())
    return row


def absent() -> Floats:
    """The row (`WIDTH`,) of a shape that is not there: no line meets its sphere."""
    row = np.zeros(WIDTH)
    row[KIND], row[REACH] = CAPSULE, -np.inf
    return row


@kernel
def set_rows(table, first, rows):
    """Shapes into the rows of a table from `first` on."""
    for k in range(len(rows)):
        for i in range(WIDTH):
            table[first + k, i] = rows[k, i]


@kernel
def set_capsules(table, first, ends, radius):
    """Capsules with ends (n, 2, 3) and radii (n,) into the rows from `first` on."""
    for k in range(len(ends)):
        row, squared = first + k, 0.0
        for i in range(3):
            table[row, CENTRE + i] = 0.5 * (ends[k, 0, i] + ends[k, 1, i])
            table[row, AXES + 6 + i] = ends[k, 1, i] - ends[k, 0, i]
            squared += table[row, AXES + 6 + i] ** 2
        length = math.sqrt(squared)
        for i in range(3):
            table[row, AXES + 6 + i] /= max(length, 1e-12)
        table[row, KIND] = CAPSULE
        table[row, HALF_SIZE], table[row, HALF_SIZE + 1] = radius[k], 0.5 * length
        table[row, REACH] = 0.5 * length + radius[k]


@kernel
def passage(table, row, px, py, pz, dx, dy, dz):
    """Where a line enters and leaves the shape of a row."""
    kind = table[row, KIND]
    if kind == BOX:
        return _through_box(table, row, px, py, pz, dx, dy, dz)
    if kind == PLANE:
        return _through_plane(table, row, px, py, pz, dx, dy, dz)
    rise, height, ahead, excess = against_axis(table, row, px, py, pz, dx, dy, dz)
    enter, leave = through_tube(rise, height, ahead, excess)
    half = table[row, HALF_SIZE + 1]
    if kind == CAPSULE:
        return rounded(enter, leave, half, rise, height, ahead, excess)
    low, high = _between(height, rise, half)
    return max(enter, low), min(leave, high)


@kernel
def on_axis(table, row, axis, x, y, z):
    """A vector's part along an axis of a shape."""
    at = AXES + 3 * axis
    return table[row, at] * x + table[row, at + 1] * y + table[row, at + 2] * z


@kernel
def against_axis(table, row, px, py, pz, dx, dy, dz):
    """A line against a shape's z axis and radius, as the functions below are given it: d and p
    along the axis, p along d [m], p squared less the radius squared [m^2]."""
    radius = table[row, HALF_SIZE]
    rise, height = on_axis(table, row, 2, dx, dy, dz), on_axis(table, row, 2, px, py, pz)
    ahead = px * dx + py * dy + pz * dz
    return rise, height, ahead, px * px + py * py + pz * pz - radius * radius


@kernel
def through_tube(rise, height, ahead, excess):
    """Through an endless cylinder."""
    a, b, c = 1.0 - rise * rise, ahead - height * rise, excess - height * height
    if a < PARALLEL:
        return NEVER if c > 0.0 else (-math.inf, math.inf)
    discriminant = b * b - a * c
    if discriminant <= 0.0:
        return NEVER
    root, scale = math.sqrt(discriminant), 1.0 / a
    return scale * (-b - root), scale * (-b + root)


@kernel
def rounded(enter, leave, half, rise, height, ahead, excess):
    """What is left of a passage through a tube when it ends at +-half in balls: a capsule."""
    if enter > leave:
        return NEVER
    at = height + enter * rise
    if abs(at) > half:
        enter, _ = _through_ball(math.copysign(half, at), rise, height, ahead, excess)
    at = height + leave * rise
    if abs(at) > half:
        _, leave = _through_ball(math.copysign(half, at), rise, height, ahead, excess)
    return enter, leave


@kernel
def _through_box(table, row, px, py, pz, dx, dy, dz):
    enter, leave = -math.inf, math.inf
    for i in range(3):
        height, rise = on_axis(table, row, i, px, py, pz), on_axis(table, row, i, dx, dy, dz)
        low, high = _between(height, rise, table[row, HALF_SIZE + i])
        enter, leave = max(enter, low), min(leave, high)
    return enter, leave


@kernel
def _through_plane(table, row, px, py, pz, dx, dy, dz):
    """A rectangle stops only what comes from its front, where its z points."""
    height, rise = on_axis(table, row, 2, px, py, pz), on_axis(table, row, 2, dx, dy, dz)
    if height < 0.0 or rise >= 0.0:
        return NEVER
    way = -height / rise
    for i in range(2):
        at = on_axis(table, row, i, px, py, pz) + way * on_axis(table, row, i, dx, dy, dz)
        if abs(at) > table[row, HALF_SIZE + i]:
            return NEVER
    return way, way


@kernel
def _through_ball(end, rise, height, ahead, excess):
    """Through the ball at `end` [m] on the axis."""
    nearest = end * rise - ahead
    room = nearest * nearest - (excess - 2.0 * end * height + end * end)
    if room <= 0.0:
        return NEVER
    root = math.sqrt(room)
    return nearest - root, nearest + root


@kernel
def _between(height, rise, half):
    """Between two planes at -half and half."""
    if rise == 0.0:
        return (-math.inf, math.inf) if abs(height) <= half else NEVER
    one, other = (-half - height) / rise, (half - height) / rise
    return min(one, other), max(one, other)
