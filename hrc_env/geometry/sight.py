"""Occlusion: whether anything stands between an eye and points.

Of a table of shapes, only those are tested exactly that are in the cone around the points and have
bounding spheres that a line meets.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Capsules, Floats, Ints, Points3, Vector3
from hrc_env.geometry import shapes
from hrc_env.geometry.shapes import Passage, Vector

NEAR_POINT_M = 0.08
"""Last part of a line of sight that nothing blocks [m]: contact with a joint does not hide it."""
BLOCKING_CHORD = 1.4
"""A line is blocked if it runs this many radii through a body's capsule, which lines within 0.7
radii of the axis do."""
OWN_CAPSULE_M = 0.06
"""Length by which the limit is longer in the capsule that contains the joint itself [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """All occluders between cameras and workers except the workers, in B environments."""

    still: Floats
    """(G, `shapes.WIDTH`) shapes that never move."""
    moving: Floats
    """(B, M, `shapes.WIDTH`) shapes that are carried; rows may be `shapes.absent_shape`."""
    capsules_world: Capsules
    """(B, K, 2, 3) capsules of the robot [m]."""
    capsule_radius_m: Floats
    """(K,) radii of the robot's capsules [m]."""


class Occluders(NamedTuple):
    """A table of shapes, the last of them workers' capsules, and a list of those in view."""

    table: Floats
    """(G, `shapes.WIDTH`) the shapes."""
    first_body: int
    """First row of the workers' capsules."""
    spheres: Floats
    """(5, G) bounding spheres in view: centre less the eye (3) [m], squared length of the tangent
    from the eye [m^2], radius [m]."""
    rows: Ints
    """(G,) row in the table of each shape in view."""


class Ball(NamedTuple):
    """A ball as seen from an eye [m]."""

    x: float
    """First coordinate of the middle, from the eye [m]."""
    y: float
    """Second coordinate of the middle, from the eye [m]."""
    z: float
    """Third coordinate of the middle, from the eye [m]."""
    radius: float
    """Radius [m]."""


class Line(NamedTuple):
    """A line from an eye to a point."""

    direction: Vector3
    """Unit direction."""
    length: float
    """Distance of the point from the eye [m]."""


def no_surroundings(batch: int) -> Surroundings:
    """Return surroundings of `batch` environments in which nothing blocks a line of sight."""
    still, moving = np.zeros((0, shapes.WIDTH)), np.zeros((batch, 0, shapes.WIDTH))
    return Surroundings(still, moving, np.zeros((batch, 0, 2, 3)), np.zeros(0))


def find_hidden(surroundings: Surroundings, eyes_world: Points3, points_world: Points3) -> Bools:
    """Return which points are hidden from which eyes.

    Args:
        surroundings: of B environments.
        eyes_world: (C, 3) [m].
        points_world: (B, J, 3) [m].

    Returns:
        (B, C, J) true where something stands between eye and point.
    """
    batch = len(surroundings.capsules_world)
    check_shape("points_world", points_world.shape[::2], (batch, 3), "environments, ..., xyz")
    eyes, points = np.ascontiguousarray(eyes_world), np.ascontiguousarray(points_world)
    result = np.empty((batch, len(eyes), points.shape[1]), bool)
    _find_hidden(
        surroundings.still,
        surroundings.moving,
        surroundings.capsules_world,
        surroundings.capsule_radius_m,
        eyes,
        points,
        result,
    )
    return result


@kernel(makes_arrays=True)
def _find_hidden(
    still: Floats,
    moving: Floats,
    capsules: Capsules,
    radius: Floats,
    eyes: Points3,
    points: Points3,
    hidden: Bools,
) -> None:
    """Write which points (B, J, 3) are hidden from which eyes (C, 3); see `Surroundings`."""
    occluders = make_occluders(still, len(radius) + moving.shape[1], 0)
    table = occluders.table
    for b in range(len(points)):
        shapes.set_capsules(table, len(still), capsules[b], radius)
        shapes.set_rows(table, len(still) + len(radius), moving[b])
        for c in range(len(eyes)):
            n_view = select_occluders(eyes[c], points[b], occluders)
            for j in range(points.shape[1]):
                hidden[b, c, j] = is_hidden(eyes[c], points[b], j, occluders, n_view)


@kernel(makes_arrays=True)
def make_occluders(still: Floats, n_more: int, n_body: int) -> Occluders:
    """Return a table that begins with `still` and has room for other shapes.

    Args:
        still: (G, `shapes.WIDTH`) shapes that never move.
        n_more: number of other shapes.
        n_body: number of capsules of workers' bodies, which are last.
    """
    first_body = len(still) + n_more
    n = first_body + n_body
    table = np.empty((n, shapes.WIDTH))
    table[: len(still)] = still
    return Occluders(table, first_body, np.empty((5, n)), np.empty(n, np.int64))


@kernel
def select_occluders(eye: Floats, points: Points3, occluders: Occluders) -> int:
    """List the shapes that may stand between an eye (3,) and any of the points (J, 3) [m].

    Returns:
        The number of shapes in view, the first entries of `spheres` and `rows` of `occluders`.
    """
    table, view = occluders.table, occluders.spheres
    ball = _bounding_ball(eye, points)
    far = math.sqrt(ball.x * ball.x + ball.y * ball.y + ball.z * ball.z)
    sine = min(ball.radius / far, 1.0)
    cosine = math.sqrt(1.0 - sine * sine)
    n = 0
    for k in range(len(table)):
        reach = table[k, shapes.REACH]
        x, y = table[k, shapes.CENTRE] - eye[0], table[k, shapes.CENTRE + 1] - eye[1]
        z = table[k, shapes.CENTRE + 2] - eye[2]
        squared = x * x + y * y + z * z
        if table[k, shapes.KIND] == shapes.PLANE:
            if not _is_plane_between(eye, points, table, k):
                continue
        elif sine < 1.0:  # the lines are in a cone; is the sphere beside or behind it?
            along = (x * ball.x + y * ball.y + z * ball.z) / far
            aside = math.sqrt(max(squared - along * along, 0.0))
            if aside * cosine - along * sine > reach or along > far + ball.radius + reach:
                continue
        occluders.rows[n] = k
        view[0, n], view[1, n], view[2, n] = x, y, z
        view[3, n], view[4, n] = squared - reach * reach, reach
        n += 1
    return n


@kernel
def _bounding_ball(eye: Floats, points: Points3) -> Ball:
    """Return a ball around points (J, 3), seen from an eye (3,) [m]."""
    x, y, z, n = 0.0, 0.0, 0.0, len(points)
    for j in range(n):
        x, y, z = x + points[j, 0], y + points[j, 1], z + points[j, 2]
    x, y, z = x / n, y / n, z / n
    farthest = 0.0
    for j in range(n):
        dx, dy, dz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
        farthest = max(farthest, dx * dx + dy * dy + dz * dz)
    return Ball(x - eye[0], y - eye[1], z - eye[2], math.sqrt(farthest))


@kernel
def _is_plane_between(eye: Floats, points: Points3, table: Floats, row: int) -> bool:
    """Return whether an eye (3,) is in front of a plane and any of the points (J, 3) is not."""
    level = shapes.on_axis(table, row, 2, table[row, shapes.CENTRE : shapes.AXES])
    if shapes.on_axis(table, row, 2, eye) < level:
        return False
    lowest = math.inf
    for j in range(len(points)):
        lowest = min(lowest, shapes.on_axis(table, row, 2, points[j]))
    return lowest < level


@kernel
def is_hidden(eye: Floats, points: Points3, j: int, occluders: Occluders, n_view: int) -> bool:
    """Return whether a shape stands between an eye and one of the points.

    Args:
        eye: (3,) [m].
        points: (J, 3) [m].
        j: the point.
        occluders: shapes, of which `select_occluders` has listed those in view.
        n_view: number of shapes in view.
    """
    table, view = occluders.table, occluders.spheres
    line = line_to(eye, points, j)
    for i in range(n_view):
        if _hits_sphere(view, i, line):
            row = occluders.rows[i]
            from_centre = Vector3(-view[0, i], -view[1, i], -view[2, i])
            if row >= occluders.first_body:
                if is_behind_body(table, row, from_centre, line.direction, line.length):
                    return True
                continue
            if _is_blocked(shapes.passage(table, row, from_centre, line.direction), line.length):
                return True
    return False


@kernel
def line_to(eye: Floats, points: Points3, j: int) -> Line:
    """Return the line from an eye (3,) to one of the points (J, 3) [m]."""
    dx, dy, dz = points[j, 0] - eye[0], points[j, 1] - eye[1], points[j, 2] - eye[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    scale = 1.0 / max(length, 1e-9)
    return Line(Vector3(scale * dx, scale * dy, scale * dz), length)


@kernel
def _hits_sphere(view: Floats, i: int, line: Line) -> bool:
    """Return whether a line hits the i-th of the bounding spheres in view (5, G)."""
    d, reach = line.direction, view[4, i]
    along = view[0, i] * d.x + view[1, i] * d.y + view[2, i] * d.z
    return along * along >= view[3, i] and along >= -reach and along <= line.length + reach


@kernel
def _is_blocked(passage: Passage, length: float) -> bool:
    """Return whether a line enters a shape, or leaves it from inside, before its length [m]."""
    if passage.enter > passage.leave:
        return False
    first = passage.enter if passage.enter >= 0.0 else passage.leave
    return 0.0 <= first < length - NEAR_POINT_M


@kernel
def is_behind_body(table: Floats, row: int, eye: Vector, direction: Vector, length: float) -> bool:
    """Return whether the capsule of a body hides the point at the end of a line.

    A joint lies inside the body, and so do the ends of the capsules that meet there: it is hidden
    where the line runs through a capsule for much longer than from its axis to its surface.

    Args:
        table: (n, `shapes.WIDTH`) shapes.
        row: the capsule.
        eye: (3,) where the line starts, from the capsule's centre [m].
        direction: (3,) unit vector.
        length: of the line [m].
    """
    radius, half = table[row, shapes.HALF_SIZE], table[row, shapes.HALF_SIZE + 1]
    line = shapes.line_from_axis(table, row, eye, direction)
    tube = shapes.cross_tube(line)
    if min(tube.leave, length) - max(tube.enter, 0.0) <= BLOCKING_CHORD * radius:
        return False  # and the way through the capsule is no longer
    inside = shapes.round_ends(tube, half, line)
    is_within = inside.enter < length and inside.leave >= length
    chord = min(inside.leave, length) - max(inside.enter, 0.0)
    return chord > BLOCKING_CHORD * radius + (OWN_CAPSULE_M if is_within else 0.0)
