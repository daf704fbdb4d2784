"""Convex shapes as rows of tables (n, `WIDTH`), and their exact intersections with lines.

A line is given by its origin (the eye) relative to the centre of the shape [m], and by a unit
direction. Its passage is the interval of distances from the eye over which it is inside the shape.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Capsules, Floats, Vector3

PLANE, BOX, CYLINDER, CAPSULE = range(4)
"""Kinds of shapes. A sphere is a capsule of length zero."""
KIND, CENTRE, AXES, HALF_SIZE, REACH, WIDTH = 0, 1, 4, 13, 16, 17
"""Indices of the first columns of the entries of a table, and the number of columns. The entries
are kind, centre [m], axes x, y and z, half edge lengths (or radius and half length along z) [m],
and radius of the bounding sphere [m]."""
PARALLEL = 1e-12
"""Squared sine of the angle below which a line is considered parallel to an axis."""
Vector: TypeAlias = Floats | Vector3
"""A vector (3,), either an array or a `Vector3`."""


class Passage(NamedTuple):
    """The interval over which a line is inside a shape; it is empty if `leave` is below `enter`."""

    enter: float
    """Distance from the eye at which the line enters the shape [m]; negative if behind the eye."""
    leave: float
    """Distance from the eye at which the line leaves the shape [m]; negative if behind the eye."""


NEVER = Passage(math.inf, -math.inf)
"""The empty passage of a line that misses a shape."""
ALWAYS = Passage(-math.inf, math.inf)
"""The infinite passage of a line that is entirely inside an unbounded shape."""


class AxisLine(NamedTuple):
    """A line relative to the z axis of a cylinder or capsule."""

    rise: float
    """Component of the line's direction along the z axis."""
    height: float
    """Axial coordinate of the line's origin (the eye), relative to the shape's centre [m]."""
    ahead: float
    """Coordinate of the eye along the line's direction, relative to the shape's centre [m]."""
    excess: float
    """Squared distance of the eye from the shape's centre minus the squared radius [m^2]."""


def shape(kind: int, centre: Floats, axes: Floats, half_size: Floats) -> Floats:
    """Return the row (`WIDTH`,) of a shape.

    Args:
        kind: `PLANE`, `BOX`, `CYLINDER` or `CAPSULE`.
        centre: (3,) position of the centre [m].
        axes: (3, 3) rotation world_from_shape; z is the axis of cylinders and capsules, and the
            normal of planes.
        half_size: (3,) half edge lengths of a plane or box, infinite if it is unbounded; radius,
            half length and 0 for other shapes [m].
    """
    row = np.empty(WIDTH)
    row[KIND], row[CENTRE:AXES], row[AXES:HALF_SIZE] = kind, centre, axes.T.ravel()
    row[HALF_SIZE:REACH] = half_size
    row[REACH] = half_size.sum() if kind == CAPSULE else np.sqrt((half_size**2).sum())
    return row


def absent_shape() -> Floats:
    """Return the row (`WIDTH`,) of a shape that no line intersects."""
    row = np.zeros(WIDTH)
    row[KIND], row[REACH] = CAPSULE, -np.inf
    return row


def bounds(table: Floats) -> Floats:
    """Return the minimum and maximum corners (2, 3) of a bounding box of boxes and capsules [m]."""
    axes, half = np.abs(table[:, AXES:HALF_SIZE].reshape(-1, 3, 3)), table[:, HALF_SIZE:REACH]
    boxes = np.einsum("gi,gij->gj", half, axes)
    rods = half[:, 1:2] * axes[:, 2] + half[:, :1]
    reach = np.where(table[:, KIND, None] == BOX, boxes, rods)
    centre = table[:, CENTRE:AXES]
    return np.stack([(centre - reach).min(0), (centre + reach).max(0)])


@kernel
def set_rows(table: Floats, first: int, rows: Floats) -> None:
    """Copy shapes (n, `WIDTH`) to consecutive rows of a table, beginning with row `first`."""
    for k in range(len(rows)):
        for i in range(WIDTH):
            table[first + k, i] = rows[k, i]


@kernel
def set_capsules(table: Floats, first: int, ends: Capsules, radius: Floats) -> None:
    """Set consecutive rows of a table to capsules.

    Args:
        table: (m, `WIDTH`) table, which is changed.
        first: row of the first capsule.
        ends: (n, 2, 3) end points of the axes [m].
        radius: (n,) radii [m].
    """
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
def passage(table: Floats, row: int, eye: Vector, direction: Vector) -> Passage:
    """Return the interval over which a line is inside a shape.

    Args:
        table: (n, `WIDTH`) table of shapes.
        row: row of the shape.
        eye: (3,) origin of the line, relative to the shape's centre [m].
        direction: (3,) unit direction of the line.
    """
    kind = table[row, KIND]
    if kind == BOX:
        return _cross_box(table, row, eye, direction)
    if kind == PLANE:
        return _cross_plane(table, row, eye, direction)
    line = line_from_axis(table, row, eye, direction)
    tube = cross_tube(line)
    half = table[row, HALF_SIZE + 1]
    if kind == CAPSULE:
        return round_ends(tube, half, line)
    slab = _cross_slab(line.height, line.rise, half)
    return Passage(max(tube.enter, slab.enter), min(tube.leave, slab.leave))


@kernel
def on_axis(table: Floats, row: int, axis: int, vector: Vector) -> float:
    """Return the component of a vector (3,) along an axis (0 to 2) of a shape."""
    at = AXES + 3 * axis
    x = table[row, at] * vector[0]
    return x + table[row, at + 1] * vector[1] + table[row, at + 2] * vector[2]


@kernel
def line_from_axis(table: Floats, row: int, eye: Vector, direction: Vector) -> AxisLine:
    """Describe a line relative to the z axis and the radius of a cylinder or capsule."""
    radius = table[row, HALF_SIZE]
    ahead = eye[0] * direction[0] + eye[1] * direction[1] + eye[2] * direction[2]
    excess = eye[0] * eye[0] + eye[1] * eye[1] + eye[2] * eye[2] - radius * radius
    rise, height = on_axis(table, row, 2, direction), on_axis(table, row, 2, eye)
    return AxisLine(rise, height, ahead, excess)


@kernel
def cross_tube(line: AxisLine) -> Passage:
    """Return the interval over which a line is inside a cylinder of infinite length."""
    rise, height = line.rise, line.height
    a, b, c = 1.0 - rise * rise, line.ahead - height * rise, line.excess - height * height
    if a < PARALLEL:
        return NEVER if c > 0.0 else ALWAYS
    discriminant = b * b - a * c
    if discriminant <= 0.0:
        return NEVER
    root, scale = math.sqrt(discriminant), 1.0 / a
    return Passage(scale * (-b - root), scale * (-b + root))


@kernel
def round_ends(tube: Passage, half: float, line: AxisLine) -> Passage:
    """Return the interval over which a line is inside a capsule.

    Args:
        tube: passage of the line through the infinite cylinder with the capsule's axis and radius.
        half: half the length of the capsule's axis [m].
        line: the line relative to the capsule's axis.
    """
    enter, leave = tube.enter, tube.leave
    if enter > leave:
        return NEVER
    at = line.height + enter * line.rise
    if abs(at) > half:
        enter = _cross_ball(math.copysign(half, at), line).enter
    at = line.height + leave * line.rise
    if abs(at) > half:
        leave = _cross_ball(math.copysign(half, at), line).leave
    return Passage(enter, leave)


@kernel
def _cross_ball(end: float, line: AxisLine) -> Passage:
    """Return the interval over which a line is inside the sphere at `end` [m] on the axis."""
    nearest = end * line.rise - line.ahead
    room = nearest * nearest - (line.excess - 2.0 * end * line.height + end * end)
    if room <= 0.0:
        return NEVER
    root = math.sqrt(room)
    return Passage(nearest - root, nearest + root)


@kernel
def _cross_box(table: Floats, row: int, eye: Vector, direction: Vector) -> Passage:
    """Return the interval over which a line is inside a box."""
    enter, leave = -math.inf, math.inf
    for i in range(3):
        height, rise = on_axis(table, row, i, eye), on_axis(table, row, i, direction)
        slab = _cross_slab(height, rise, table[row, HALF_SIZE + i])
        enter, leave = max(enter, slab.enter), min(leave, slab.leave)
    return Passage(enter, leave)


@kernel
def _cross_plane(table: Floats, row: int, eye: Vector, direction: Vector) -> Passage:
    """Return the point, as a `Passage`, at which a line crosses a rectangle from its front (+z)."""
    height, rise = on_axis(table, row, 2, eye), on_axis(table, row, 2, direction)
    if height < 0.0 or rise >= 0.0:
        return NEVER
    way = -height / rise
    for i in range(2):
        at = on_axis(table, row, i, eye) + way * on_axis(table, row, i, direction)
        if abs(at) > table[row, HALF_SIZE + i]:
            return NEVER
    return Passage(way, way)


@kernel
def _cross_slab(height: float, rise: float, half: float) -> Passage:
    """Return the interval over which a line is between planes at `-half` and `half` [m]."""
    if rise == 0.0:
        return ALWAYS if abs(height) <= half else NEVER
    one, other = (-half - height) / rise, (half - height) / rise
    return Passage(min(one, other), max(one, other))
