"""Occlusion tests: whether a shape is between an eye and a point.

A shape of a table is tested exactly only if it is in the viewing cone of the points and the line
intersects its bounding sphere.
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
"""Length at the end of a line of sight in which occluders are ignored [m]. It prevents an object in
contact with a joint from hiding the joint."""
BLOCKING_CHORD = 1.4
"""Length inside a body's capsule above which a line counts as blocked, in units of the capsule's
radius. Lines within about 0.7 radii of the axis exceed it."""
OWN_CAPSULE_M = 0.06
"""Additional length that is allowed inside the capsule that contains the joint itself [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """The potential occluders of B environments, apart from the workers."""

    still: Floats
    """(G, `shapes.WIDTH`) shapes that never move."""
    moving: Floats
    """(B, M, `shapes.WIDTH`) movable shapes, such as carried objects; rows may be
    `shapes.absent_shape`."""
    capsules_world: Capsules
    """(B, K, 2, 3) capsules of the robot [m]."""
    capsule_radius_m: Floats
    """(K,) radii of the robot's capsules [m]."""


class Occluders(NamedTuple):
    """A table of shapes, with the workers' capsules last, and a list of the shapes in view."""

    table: Floats
    """(G, `shapes.WIDTH`) table of all shapes."""
    first_body: int
    """Row of the first of the workers' capsules."""
    spheres: Floats
    """(5, G) bounding spheres of the shapes in view: centre relative to the eye (3) [m], squared
    length of the tangent from the eye [m^2] and radius [m]."""
    rows: Ints
    """(G,) row of each shape in view in the table."""


class Ball(NamedTuple):
    """A sphere with coordinates relative to an eye."""

    x: float
    """First coordinate of the centre, relative to the eye [m]."""
    y: float
    """Second coordinate of the centre, relative to the eye [m]."""
    z: float
    """Third coordinate of the centre, relative to the eye [m]."""
    radius: float
    """Radius of the sphere [m]."""


class Line(NamedTuple):
    """A line from an eye to a point."""

    direction: Vector3
    """Unit direction from the eye to the point."""
    length: float
    """Distance of the point from the eye [m]."""


def no_surroundings(batch: int) -> Surroundings:
    """Return surroundings without occluders for `batch` environments."""
    still, moving = np.zeros((0, shapes.WIDTH)), np.zeros((batch, 0, shapes.WIDTH))
    return Surroundings(still, moving, np.zeros((batch, 0, 2, 3)), np.zeros(0))


def find_hidden(surroundings: Surroundings, eyes_world: Points3, points_world: Points3) -> Bools:
    """Return a mask of the points that are hidden from the eyes.

    Args:
        surroundings: occluders of B environments.
        eyes_world: (C, 3) positions of the eyes [m].
        points_world: (B, J, 3) positions of the points [m].

    Returns:
        (B, C, J) mask, which is True if an occluder is between the eye and the point.
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
    """Compute the mask `hidden` (B, C, J) of `find_hidden`; see also `Surroundings`."""
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
    """Return a table that begins with `still` and has empty rows for further shapes.

    Args:
        still: (G, `shapes.WIDTH`) shapes that never move.
        n_more: number of further shapes, apart from workers.
        n_body: number of capsules of the workers' bodies, which are the last rows.
    """
    first_body = len(still) + n_more
    n = first_body + n_body
    table = np.empty((n, shapes.WIDTH))
    table[: len(still)] = still
    return Occluders(table, first_body, np.empty((5, n)), np.empty(n, np.int64))


@kernel
def select_occluders(eye: Floats, points: Points3, occluders: Occluders) -> int:
    """Find the shapes that may be between an eye (3,) and any of the points (J, 3) [m].

    Returns:
        The number n of shapes in view; the first n entries of `occluders.spheres` and
        `occluders.rows` describe them.
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
        elif sine < 1.0:  # skip spheres beside or behind the cone of the lines
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
    """Return a sphere around points (J, 3) [m], relative to an eye (3,) [m]."""
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
    """Return whether a plane separates an eye (3,) in front of it from any of the points (J, 3)."""
    level = shapes.on_axis(table, row, 2, table[row, shapes.CENTRE : shapes.AXES])
    if shapes.on_axis(table, row, 2, eye) < level:
        return False
    lowest = math.inf
    for j in range(len(points)):
        lowest = min(lowest, shapes.on_axis(table, row, 2, points[j]))
    return lowest < level


@kernel
def is_hidden(eye: Floats, points: Points3, j: int, occluders: Occluders, n_view: int) -> bool:
    """Return whether a shape is between an eye and one of the points.

    Args:
        eye: (3,) position of the eye [m].
        points: (J, 3) positions of the points [m].
        j: index of the point.
        occluders: the shapes, as prepared by `select_occluders`.
        n_view: number of shapes in view, as returned by `select_occluders`.
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
    """Return the line from an eye (3,) to point `j` of points (J, 3) [m]."""
    dx, dy, dz = points[j, 0] - eye[0], points[j, 1] - eye[1], points[j, 2] - eye[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    scale = 1.0 / max(length, 1e-9)
    return Line(Vector3(scale * dx, scale * dy, scale * dz), length)


@kernel
def _hits_sphere(view: Floats, i: int, line: Line) -> bool:
    """Return whether a line intersects the i-th of the bounding spheres in view (5, G)."""
    d, reach = line.direction, view[4, i]
    along = view[0, i] * d.x + view[1, i] * d.y + view[2, i] * d.z
    return along * along >= view[3, i] and along >= -reach and along <= line.length + reach


@kernel
def _is_blocked(passage: Passage, length: float) -> bool:
    """Return whether a line of the given length [m] enters a shape or leaves it from inside."""
    if passage.enter > passage.leave:
        return False
    first = passage.enter if passage.enter >= 0.0 else passage.leave
    return 0.0 <= first < length - NEAR_POINT_M


@kernel
def is_behind_body(table: Floats, row: int, eye: Vector, direction: Vector, length: float) -> bool:
    """Return whether a capsule of a body hides the point at the end of a line.

    Joints are inside the body, at the ends of the capsules that meet there. A joint is considered
    hidden if the line's length inside a capsule is much greater than the capsule's radius.

    Args:
        table: (n, `shapes.WIDTH`) table of shapes.
        row: row of the capsule.
        eye: (3,) origin of the line, relative to the capsule's centre [m].
        direction: (3,) unit direction of the line.
        length: length of the line [m].
    """
    radius, half = table[row, shapes.HALF_SIZE], table[row, shapes.HALF_SIZE + 1]
    line = shapes.line_from_axis(table, row, eye, direction)
    tube = shapes.cross_tube(line)
    if min(tube.leave, length) - max(tube.enter, 0.0) <= BLOCKING_CHORD * radius:
        return False  # the length inside the capsule is not greater
    inside = shapes.round_ends(tube, half, line)
    is_within = inside.enter < length and inside.leave >= length
    chord = min(inside.leave, length) - max(inside.enter, 0.0)
    return chord > BLOCKING_CHORD * radius + (OWN_CAPSULE_M if is_within else 0.0)
