"""Convex shapes as rows of tables (n, `WIDTH`), and where a line passes through them, exactly.

A line starts at an eye, p from the shape's centre, and has a unit direction d; its passage is the
interval of the way [m] that lies in the shape; `NEVER` has its entry after its exit.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats

PLANE, BOX, CYLINDER, CAPSULE = range(4)
"""Kinds of shapes; a sphere is a capsule without length."""
KIND, CENTRE, AXES, HALF_SIZE, REACH, WIDTH = 0, 1, 4, 13, 16, 17
"""Columns of a table and their number: centre [m], x, y and z axes, half edges (or radius and half
length along z) and the radius of the sphere that holds it [m]."""
NEVER = (math.inf, -math.inf)
PARALLEL = 1e-12
"""Square of the sine below which a line counts as parallel to an axis."""


def shape(kind: int, centre: Floats, axes: Floats, half_size: Floats) -> Floats:
    """The row (`WIDTH`,) of a shape of a kind with a centre (3,) [m], axes (3, 3) world_from_shape
    (cylinders and capsules lie along z, planes face z) and half_size (3,): half edges (infinite:
    endless), else radius, half length and 0 [m]."""
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


def bounds(table: Floats) -> Floats:
    """(2, 3) least and greatest corner of the box, along x, y and z, round boxes and capsules
    (n, `WIDTH`) [m]."""
    axes, half = np.abs(table[:, AXES:HALF_SIZE].reshape(-1, 3, 3)), table[:, HALF_SIZE:REACH]
    boxes = np.einsum("gi,gij->gj", half, axes)
    rods = half[:, 1:2] * axes[:, 2] + half[:, :1]
    reach = np.where(table[:, KIND, None] == BOX, boxes, rods)
    centre = table[:, CENTRE:AXES]
    return np.stack([(centre - reach).min(0), (centre + reach).max(0)])


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
def passage(table, row, p, d):
    """Where a line enters and leaves the shape of a row."""
    kind = table[row, KIND]
    if kind == BOX:
        return _through_box(table, row, p, d)
    if kind == PLANE:
        return _through_plane(table, row, p, d)
    against = against_axis(table, row, p, d)
    enter, leave = through_tube(against)
    half = table[row, HALF_SIZE + 1]
    if kind == CAPSULE:
        return rounded(enter, leave, half, against)
    low, high = _between(against[1], against[0], half)
    return max(enter, low), min(leave, high)


@kernel
def on_axis(table, row, axis, v):
    """A vector's part along an axis of a shape."""
    at = AXES + 3 * axis
    return table[row, at] * v[0] + table[row, at + 1] * v[1] + table[row, at + 2] * v[2]


@kernel
def against_axis(table, row, p, d):
    """A line against a shape's z axis and radius: rise and height (d and p along the axis), p
    along d [m], and p squared less the radius squared [m^2]."""
    radius = table[row, HALF_SIZE]
    ahead = p[0] * d[0] + p[1] * d[1] + p[2] * d[2]
    excess = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - radius * radius
    return on_axis(table, row, 2, d), on_axis(table, row, 2, p), ahead, excess


@kernel
def through_tube(against):
    """Through an endless cylinder."""
    rise, height, ahead, excess = against
    a, b, c = 1.0 - rise * rise, ahead - height * rise, excess - height * height
    if a < PARALLEL:
        return NEVER if c > 0.0 else (-math.inf, math.inf)
    discriminant = b * b - a * c
    if discriminant <= 0.0:
        return NEVER
    root, scale = math.sqrt(discriminant), 1.0 / a
    return scale * (-b - root), scale * (-b + root)


@kernel
def rounded(enter, leave, half, against):
    """What is left of a passage through a tube when it ends at +-half in balls: a capsule."""
    if enter > leave:
        return NEVER
    rise, height = against[0], against[1]
    at = height + enter * rise
    if abs(at) > half:
        enter, _ = _through_ball(math.copysign(half, at), against)
    at = height + leave * rise
    if abs(at) > half:
        _, leave = _through_ball(math.copysign(half, at), against)
    return enter, leave


@kernel
def _through_box(table, row, p, d):
    enter, leave = -math.inf, math.inf
    for i in range(3):
        height, rise = on_axis(table, row, i, p), on_axis(table, row, i, d)
        low, high = _between(height, rise, table[row, HALF_SIZE + i])
        enter, leave = max(enter, low), min(leave, high)
    return enter, leave


@kernel
def _through_plane(table, row, p, d):
    """A rectangle stops only what comes from its front, where its z points."""
    height, rise = on_axis(table, row, 2, p), on_axis(table, row, 2, d)
    if height < 0.0 or rise >= 0.0:
        return NEVER
    way = -height / rise
    for i in range(2):
        at = on_axis(table, row, i, p) + way * on_axis(table, row, i, d)
        if abs(at) > table[row, HALF_SIZE + i]:
            return NEVER
    return way, way


@kernel
def _through_ball(end, against):
    """Through the ball at `end` [m] on the axis."""
    rise, height, ahead, excess = against
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
