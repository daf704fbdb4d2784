"""Paths on a floor among footprints: gaps on a grid, shortest paths to a place, ranges of rays.

Footprints (N, 5) are upright rectangles: middle x, y, half length, half width [m], yaw [rad]. Grids
are square, with points `cell` metres apart from an origin (2,). Shortest paths are by Dijkstra
(1959, doi:10.1007/BF01386390) with eight neighbours; rays by sphere tracing (Hart 1996,
doi:10.1007/s003710050084).
"""

import heapq
import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Capsules, Floats, Ints, JointAngles, Points2

NEAREST_M = 0.02
"""Gap at which a ray ends [m]."""
STEPS = 64
"""Greatest number of steps along a ray."""


class GridPoint(NamedTuple):
    """A point of a grid by its indices."""

    i: int
    """Index along x."""
    j: int
    """Index along y."""


def gaps_m(xs: Floats, ys: Floats, footprints: Floats) -> Floats:
    """Return the distances of grid points from the nearest footprint.

    Args:
        xs: (X,) first coordinates of the points [m].
        ys: (Y,) second coordinates of the points [m].
        footprints: (N, 5) rectangles.

    Returns:
        (X, Y) distances, negative inside of a footprint, infinite without any [m].
    """
    gaps = np.full((len(xs), len(ys)), np.inf)
    for x, y, half_length, half_width, yaw in np.asarray(footprints, float).tolist():
        cos, sin, dx, dy = math.cos(yaw), math.sin(yaw), xs[:, None] - x, ys - y
        along = np.abs(cos * dx + sin * dy) - half_length
        across = np.abs(cos * dy - sin * dx) - half_width
        outside = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
        gaps = np.minimum(gaps, outside + np.minimum(np.maximum(along, across), 0.0))
    return gaps


@kernel
def value_at(x: float, y: float, field: Floats, origin: Floats, cell: float) -> float:
    """Return the value of a field at a place, interpolated between its grid points.

    Args:
        x: first coordinate of the place [m].
        y: second coordinate of the place [m].
        field: (X, Y) values at the grid points; beyond them those of the edge count.
        origin: (2,) first point of the grid [m].
        cell: distance between the points of the grid [m].
    """
    u = min(max((x - origin[0]) / cell, 0.0), field.shape[0] - 1.0)
    v = min(max((y - origin[1]) / cell, 0.0), field.shape[1] - 1.0)
    i, j = min(int(u), field.shape[0] - 2), min(int(v), field.shape[1] - 2)
    u, v = u - i, v - j
    low = field[i, j] + v * (field[i, j + 1] - field[i, j])
    high = field[i + 1, j] + v * (field[i + 1, j + 1] - field[i + 1, j])
    return low + u * (high - low)


def ways_m(price: Floats, goal: tuple[int, int], cell: float) -> Floats:
    """Return the length of the shortest path from every grid point to a goal.

    Args:
        price: (X, Y) factor on the length of a path at each point; infinite where it is blocked.
        goal: indices of the goal.
        cell: distance between the points of the grid [m].

    Returns:
        (X, Y) lengths [m]. A point that is blocked or cut off has the length of the nearest point
        that is not, plus the distance to it.
    """
    ways = np.full(price.shape, np.inf)
    _find_shortest(np.ascontiguousarray(price, float), goal[0], goal[1], cell, ways)
    return ways


@kernel(makes_arrays=True)
def _find_shortest(price: Floats, goal_i: int, goal_j: int, cell: float, ways: Floats) -> None:
    """Write the lengths (X, Y) of shortest paths; see `ways_m`.

    Free points come first, from the goal on; then all others, from the free ones on, in the order
    of their distance from these, so that the two sides of a wall do not mix.
    """
    n_x, n_y = price.shape
    order = np.full((n_x, n_y), np.inf)
    queue = [(0.0, goal_i * n_y + goal_j)]
    order[goal_i, goal_j] = 0.0
    for inside in range(2):
        if inside:
            for i in range(n_x):
                for j in range(n_y):
                    ways[i, j] = order[i, j]
                    if order[i, j] < math.inf:
                        order[i, j] = 0.0
                        heapq.heappush(queue, (0.0, i * n_y + j))
        while len(queue) > 0:
            length, node = heapq.heappop(queue)
            i, j = node // n_y, node % n_y
            if length > order[i, j]:
                continue
            for a in range(max(i - 1, 0), min(i + 2, n_x)):
                for b in range(max(j - 1, 0), min(j + 2, n_y)):
                    rate = 1.0 if inside else 0.5 * (price[i, j] + price[a, b])
                    step = cell * math.hypot(a - i, b - j) * rate
                    if length + step < order[a, b]:
                        order[a, b] = length + step
                        ways[a, b] = ways[i, j] + step
                        heapq.heappush(queue, (order[a, b], a * n_y + b))


def ranges_m(
    places: Points2 | JointAngles,
    angles: Floats,
    gaps: Floats,
    origin: Floats,
    cell: float,
    most_m: float,
) -> Floats:
    """Return the lengths of horizontal rays from places to the nearest obstacle.

    Args:
        places: (B, 2 or more) x and y [m], then anything.
        angles: (R,) directions of the rays from the x axis [rad].
        gaps: (X, Y) distances of grid points from the nearest obstacle [m].
        origin: (2,) first point of the grid [m].
        cell: distance between the points of the grid [m].
        most_m: greatest length of a ray [m].

    Returns:
        (B, R) [m].
    """
    ranges = np.empty((len(places), len(angles)))
    _trace_rays(places, angles, gaps, origin, cell, most_m, ranges)
    return ranges


@kernel
def _trace_rays(
    places: Floats,
    angles: Floats,
    gaps: Floats,
    origin: Floats,
    cell: float,
    most_m: float,
    ranges: Floats,
) -> None:
    """Write the lengths (B, R) of rays; each step is the gap, which holds no obstacle."""
    for b in range(len(places)):
        for k in range(len(angles)):
            way, c, s = 0.0, math.cos(angles[k]), math.sin(angles[k])
            for _ in range(STEPS):
                x, y = places[b, 0] + way * c, places[b, 1] + way * s
                gap = value_at(x, y, gaps, origin, cell)
                if gap < NEAREST_M or way >= most_m:
                    break
                way += gap
            ranges[b, k] = min(way, most_m)


def find_overlaps(capsules_world: Capsules, radius_m: Floats, footprints: Floats) -> Bools:
    """Return which robots overlap a footprint, seen from above.

    Args:
        capsules_world: (B, K, 2, 3) capsules of each robot [m].
        radius_m: (K,) their radii [m].
        footprints: (N, 5) rectangles.

    Returns:
        (B,)
    """
    overlaps = np.zeros(len(capsules_world), bool)
    _find_overlaps(capsules_world, radius_m, np.asarray(footprints, float), overlaps)
    return overlaps


@kernel
def _find_overlaps(capsules: Capsules, radius: Floats, footprints: Floats, overlaps: Bools) -> None:
    """Set the robots (B,) that overlap a footprint.

    Two convex shapes that do not intersect are nearest to each other at a corner of one of them.
    """
    for b in range(len(capsules)):
        for n in range(len(footprints)):
            x, y, yaw = footprints[n, 0], footprints[n, 1], footprints[n, 4]
            length, width = footprints[n, 2], footprints[n, 3]
            c, s = math.cos(yaw), math.sin(yaw)
            for k in range(capsules.shape[1]):
                ends = capsules[b, k]
                ax, ay, bx, by = ends[0, 0] - x, ends[0, 1] - y, ends[1, 0] - x, ends[1, 1] - y
                reach = length + width + radius[k]
                if min(ax, bx) > reach or max(ax, bx) < -reach:
                    continue
                if min(ay, by) > reach or max(ay, by) < -reach:
                    continue
                ax, ay = c * ax + s * ay, c * ay - s * ax
                bx, by = c * bx + s * by, c * by - s * bx
                gap = min(
                    _from_rectangle(ax, ay, length, width), _from_rectangle(bx, by, length, width)
                )
                for sx in (-1.0, 1.0):
                    for sy in (-1.0, 1.0):
                        gap = min(gap, _from_segment(sx * length, sy * width, ax, ay, bx, by))
                if gap <= radius[k]:
                    overlaps[b] = True


@kernel
def _from_rectangle(x: float, y: float, length: float, width: float) -> float:
    """Return the distance of a point from a rectangle around the origin with these half sides."""
    return math.hypot(max(abs(x) - length, 0.0), max(abs(y) - width, 0.0))


@kernel
def _from_segment(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the distance of a point (x, y) from the segment from (ax, ay) to (bx, by)."""
    ux, uy = bx - ax, by - ay
    square = ux * ux + uy * uy
    share = 0.0
    if square > 0.0:
        share = min(max(((x - ax) * ux + (y - ay) * uy) / square, 0.0), 1.0)
    return math.hypot(x - ax - share * ux, y - ay - share * uy)


def nearest_point(x: float, y: float, origin: Floats, cell: float) -> GridPoint:
    """Return the grid point nearest to a place.

    Args:
        x: first coordinate of the place [m].
        y: second coordinate of the place [m].
        origin: (2,) first point of the grid [m].
        cell: distance between the points of the grid [m].
    """
    i, j = np.rint((np.array([x, y]) - origin) / cell).astype(int).tolist()
    return GridPoint(i, j)


def select_apart(points: Points2, apart_m: float) -> Ints:
    """Return indices of points (n, 2) that all are at least `apart_m` from each other [m].

    The first point is chosen, then always the farthest from those that are chosen.
    """
    chosen, away = [0], np.linalg.norm(points - points[0], axis=1)
    while (k := int(np.argmax(away))) and away[k] >= apart_m:
        chosen.append(k)
        away = np.minimum(away, np.linalg.norm(points - points[k], axis=1))
    return np.array(chosen)
