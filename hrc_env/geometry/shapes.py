"""Convex shapes as rows of tables (n, `WIDTH`), and where a line passes through them, exactly.

A line starts at an eye and has a unit direction. The eye is given relative to the centre of the
shape [m]. The passage of the line is the interval of distances from the eye at which it is inside
of the shape.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Capsules, Floats, Vector3

PLANE, BOX, CYLINDER, CAPSULE = range(4)
"""Kinds of shapes; a sphere is a capsule without length."""
KIND, CENTRE, AXES, HALF_SIZE, REACH, WIDTH = 0, 1, 4, 13, 16, 17
"""Columns of a table and their number: kind, centre [m], x, y and z axes, half edges (or radius and
half length along z) [m] and the radius of the bounding sphere [m]."""
PARALLEL = 1e-12
"""Square of the sine below which a line counts as parallel to an axis."""
Vector: TypeAlias = Floats | Vector3
"""(3,) an array or a `Vector3`."""


class Passage(NamedTuple):
    """The part of a line that is inside of a shape; empty if it ends before it begins."""

    enter: float
    """Distance from the eye at which the line enters the shape [m]; negative: behind the eye."""
    leave: float
    """Distance from the eye at which the line leaves the shape [m]."""


NEVER = Passage(math.inf, -math.inf)
"""The passage of a line that misses a shape."""
ALWAYS = Passage(-math.inf, math.inf)
"""The passage of a line that stays inside."""


class AxisLine(NamedTuple):
    """A line relative to the z axis of a cylinder or capsule."""

    rise: float
    """Component of the line's direction along the axis."""
    height: float
    """Component of the eye along the axis, from the centre [m]."""
    ahead: float
    """Component of the eye along the line's direction, from the centre [m]."""
    excess: float
    """Squared distance of the eye from the centre less the squared radius [m^2]."""


def shape(kind: int, centre: Floats, axes: Floats, half_size: Floats) -> Floats:
    """Return the row (`WIDTH`,) of a shape.

    Args:
        kind: `PLANE`, `BOX`, `CYLINDER` or `CAPSULE`.
        centre: (3,) [m].
        axes: (3, 3) world_from_shape; cylinders and capsules lie along z, planes face z.
        half_size: (3,) half edges of a plane or box, infinite for one without end; else radius,
            half length and 0 [m].
    """
    row = np.empty(WIDTH)
    row[KIND], row[CENTRE:AXES], row[AXES:HALF_SIZE] = kind, centre, axes.T.ravel()
    row[HALF_SIZE:REACH] = half_size
    row[REACH] = half_size.sum() if kind == CAPSULE else np.sqrt((half_size**2).sum())
    return row


def absent_shape() -> Floats:
    """Return the row (`WIDTH`,) of a shape that no line can hit."""
    row = np.zeros(WIDTH)
    row[KIND], row[REACH] = CAPSULE, -np.inf
    return row


def bounds(table: Floats) -> Floats:
    """Return the lowest and the highest corner (2, 3) of a box around boxes and capsules [m]."""
    axes, half = np.abs(table[:, AXES:HALF_SIZE].reshape(-1, 3, 3)), table[:, HALF_SIZE:REACH]
    boxes = np.einsum("gi,gij->gj", half, axes)
    rods = half[:, 1:2] * axes[:, 2] + half[:, :1]
    reach = np.where(table[:, KIND, None] == BOX, boxes, rods)
    centre = table[:, CENTRE:AXES]
    return np.stack([(centre - reach).min(0), (centre + reach).max(0)])


@kernel
def set_rows(table: Floats, first: int, rows: Floats) -> None:
    """Write shapes (n, `WIDTH`) into a table from row `first` on."""
    for k in range(len(rows)):
        for i in range(WIDTH):
            table[first + k, i] = rows[k, i]


@kernel
def set_capsules(table: Floats, first: int, ends: Capsules, radius: Floats) -> None:
    """Write capsules into a table from row `first` on.

    Args:
        table: (m, `WIDTH`) is changed.
        first: the row of the first capsule.
        ends: (n, 2, 3) end points of the axes [m].
        radius: (n,) [m].
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
    """Return where a line passes through the shape of a row.

    Args:
        table: (n, `WIDTH`) shapes.
        row: the shape.
        eye: (3,) where the line starts, from the shape's centre [m].
        direction: (3,) unit vector.
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
    """Return a line relative to the z axis and the radius of a cylinder or capsule."""
    radius = table[row, HALF_SIZE]
    ahead = eye[0] * direction[0] + eye[1] * direction[1] + eye[2] * direction[2]
    excess = eye[0] * eye[0] + eye[1] * eye[1] + eye[2] * eye[2] - radius * radius
    rise, height = on_axis(table, row, 2, direction), on_axis(table, row, 2, eye)
    return AxisLine(rise, height, ahead, excess)


@kernel
def cross_tube(line: AxisLine) -> Passage:
    """Return the passage through a cylinder without ends."""
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
    """Return the passage through a capsule, given that through its endless cylinder.

    Args:
        tube: the passage through the cylinder.
        half: half the length of the capsule's axis [m].
        line: the line relative to the axis.
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
    """Return the passage through the ball at `end` [m] on the axis."""
    nearest = end * line.rise - line.ahead
    room = nearest * nearest - (line.excess - 2.0 * end * line.height + end * end)
    if room <= 0.0:
        return NEVER
    root = math.sqrt(room)
    return Passage(nearest - root, nearest + root)


@kernel
def _cross_box(table: Floats, row: int, eye: Vector, direction: Vector) -> Passage:
    """Return the passage through a box."""
    enter, leave = -math.inf, math.inf
    for i in range(3):
        height, rise = on_axis(table, row, i, eye), on_axis(table, row, i, direction)
        slab = _cross_slab(height, rise, table[row, HALF_SIZE + i])
        enter, leave = max(enter, slab.enter), min(leave, slab.leave)
    return Passage(enter, leave)


@kernel
def _cross_plane(table: Floats, row: int, eye: Vector, direction: Vector) -> Passage:
    """Return the passage through a rectangle, which only stops lines from its front (+z)."""
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
    """Return the passage between two parallel planes at -half and half [m]."""
    if rise == 0.0:
        return ALWAYS if abs(height) <= half else NEVER
    one, other = (-half - height) / rise, (half - height) / rise
    return Passage(min(one, other), max(one, other))
