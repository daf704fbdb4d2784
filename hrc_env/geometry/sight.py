"""Lines of sight: what stands between an eye and points. Of a table of shapes, only those in the
cone round the points whose bounding spheres a line meets are asked exactly."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Capsules, Floats, Ints, Points3
from hrc_env.geometry import shapes

NEAR_POINT_M = 0.08
"""A line of sight ends so far before the point: what a joint touches does not hide it."""
BLOCKING_CHORD = 1.4
"""A line that runs so many radii through a body's capsule, past the axis within 0.7, is blocked."""
OWN_CAPSULE_M = 0.06
"""So much longer may the way out of a capsule be that the joint itself lies in [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """All that can stand between cameras and workers, but the workers, in B environments."""

    still: Floats  # (G, `shapes.WIDTH`) what never moves, a shape a row
    moving: Floats  # (B, M, `shapes.WIDTH`) what is carried about; some rows `shapes.absent`
    capsules_world: Capsules  # (B, K, 2, 3) the robot [m]
    capsule_radius_m: Floats  # (K,) [m]


def nothing(batch: int) -> Surroundings:
    """Free lines of sight."""
    still, moving = np.zeros((0, shapes.WIDTH)), np.zeros((batch, 0, shapes.WIDTH))
    return Surroundings(still, moving, np.zeros((batch, 0, 2, 3)), np.zeros(0))


def hidden(surroundings: Surroundings, eyes_world: Points3, points_world: Points3) -> Bools:
    """(B, C, J) whether anything stands between eyes (C, 3) and points (B, J, 3) [m]."""
    batch = len(surroundings.capsules_world)
    check_shape("points_world", points_world.shape[::2], (batch, 3), "environments, ..., xyz")
    eyes, points = np.ascontiguousarray(eyes_world), np.ascontiguousarray(points_world)
    result = np.empty((batch, len(eyes), points.shape[1]), bool)
    _hidden(
        surroundings.still, surroundings.moving, surroundings.capsules_world,
        surroundings.capsule_radius_m, eyes, points, result,
    )  # fmt: skip
    return result


class Occluders(NamedTuple):
    """A table of shapes, the last of them workers' capsules, and which of them are in view."""

    table: Floats  # (G, `shapes.WIDTH`)
    first_body: int  # the first row of a worker's capsule
    spheres: Floats  # (5, G) in view: centre less the eye, tangent squared, radius [m]
    rows: Ints  # (G,) their rows in the table


@kernel(makes_arrays=True)
def make_occluders(still, n_more, n_body):
    """A table that begins with `still`, with room for more shapes and for those of bodies."""
    first_body = len(still) + n_more
    n = first_body + n_body
    table = np.empty((n, shapes.WIDTH))
    table[: len(still)] = still
    return Occluders(table, first_body, np.empty((5, n)), np.empty(n, np.int64))


@kernel
def look(eye, points, occluders):
    """Put what can stand between an eye and any of the points (J, 3) into `spheres`; how many."""
    table, view = occluders.table, occluders.spheres
    ux, uy, uz, radius = _ball_round(eye, points)
    far = math.sqrt(ux * ux + uy * uy + uz * uz)
    sine = min(radius / far, 1.0)
    cosine = math.sqrt(1.0 - sine * sine)
    n = 0
    for k in range(len(table)):
        reach = table[k, shapes.REACH]
        x, y = table[k, shapes.CENTRE] - eye[0], table[k, shapes.CENTRE + 1] - eye[1]
        z = table[k, shapes.CENTRE + 2] - eye[2]
        squared = x * x + y * y + z * z
        if table[k, shapes.KIND] == shapes.PLANE:
            if not _is_between(eye, points, table, k):
                continue
        elif sine < 1.0:  # the lines are in a cone; is the sphere beside or behind it?
            along = (x * ux + y * uy + z * uz) / far
            aside = math.sqrt(max(squared - along * along, 0.0))
            if aside * cosine - along * sine > reach or along > far + radius + reach:
                continue
        occluders.rows[n] = k
        view[0, n], view[1, n], view[2, n] = x, y, z
        view[3, n], view[4, n] = squared - reach * reach, reach
        n += 1
    return n


@kernel
def _ball_round(eye, points):
    """Middle, seen from an eye, and radius of a ball that holds points (J, 3)."""
    x, y, z, n = 0.0, 0.0, 0.0, len(points)
    for j in range(n):
        x, y, z = x + points[j, 0], y + points[j, 1], z + points[j, 2]
    x, y, z = x / n, y / n, z / n
    farthest = 0.0
    for j in range(n):
        dx, dy, dz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
        farthest = max(farthest, dx * dx + dy * dy + dz * dz)
    return x - eye[0], y - eye[1], z - eye[2], math.sqrt(farthest)


@kernel
def _is_between(eye, points, table, row):
    """Whether an eye is in front of a plane and any of the points is not."""
    level = shapes.on_axis(table, row, 2, table[row, shapes.CENTRE : shapes.AXES])
    if shapes.on_axis(table, row, 2, eye) < level:
        return False
    lowest = math.inf
    for j in range(len(points)):
        lowest = min(lowest, shapes.on_axis(table, row, 2, points[j]))
    return lowest < level


@kernel
def meets(view, i, d, length):
    """Whether a line of a length and unit direction d meets the i-th sphere in view."""
    along = view[0, i] * d[0] + view[1, i] * d[1] + view[2, i] * d[2]
    reach = view[4, i]
    return along * along >= view[3, i] and along >= -reach and along <= length + reach


@kernel
def blocks(enter, leave, length):
    """Whether a surface is passed, going in or (from inside) out, before the line has ended."""
    if enter > leave:
        return False
    first = enter if enter >= 0.0 else leave
    return 0.0 <= first < length - NEAR_POINT_M


@kernel
def line(eye, points, j):
    """Unit direction and length [m] of the way from an eye to one of the points (J, 3)."""
    dx, dy, dz = points[j, 0] - eye[0], points[j, 1] - eye[1], points[j, 2] - eye[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    scale = 1.0 / max(length, 1e-9)
    return (scale * dx, scale * dy, scale * dz), length


@kernel(makes_arrays=True)
def _hidden(still, moving, capsules, radius, eyes, points, hidden):
    occluders = make_occluders(still, len(radius) + moving.shape[1], 0)
    table = occluders.table
    for b in range(len(points)):
        shapes.set_capsules(table, len(still), capsules[b], radius)
        shapes.set_rows(table, len(still) + len(radius), moving[b])
        for c in range(len(eyes)):
            n_view = look(eyes[c], points[b], occluders)
            for j in range(points.shape[1]):
                hidden[b, c, j] = is_hidden(eyes[c], points[b], j, occluders, n_view)


@kernel
def is_hidden(eye, points, j, occluders, n_view):
    """Whether one of the `n_view` shapes in view stands between an eye and one of the points."""
    table, view = occluders.table, occluders.spheres
    d, length = line(eye, points, j)
    for i in range(n_view):
        if meets(view, i, d, length):
            row, p = occluders.rows[i], (-view[0, i], -view[1, i], -view[2, i])
            if row >= occluders.first_body:
                if body_blocks(table, row, p, d, length):
                    return True
                continue
            enter, leave = shapes.passage(table, row, p, d)
            if blocks(enter, leave, length):
                return True
    return False


@kernel
def body_blocks(table, row, p, d, length):
    """Whether a body's capsule, a row of shapes, hides what is at `length` [m] on a line; p is the
    eye less the capsule's centre, d the line's unit direction.

    A joint lies inside the body, and so do the ends of the capsules that meet there: it is hidden
    where the line's way through a capsule is much longer than from its axis to its surface.
    """
    radius, half = table[row, shapes.HALF_SIZE], table[row, shapes.HALF_SIZE + 1]
    against = shapes.against_axis(table, row, p, d)
    enter, leave = shapes.through_tube(against)
    if min(leave, length) - max(enter, 0.0) <= BLOCKING_CHORD * radius:
        return False  # and the way through the capsule is no longer
    enter, leave = shapes.rounded(enter, leave, half, against)
    within = enter < length and leave >= length
    chord = min(leave, length) - max(enter, 0.0)
    return chord > BLOCKING_CHORD * radius + (OWN_CAPSULE_M if within else 0.0)
