"""Planning on a floor with obstacles: distance fields, shortest paths and range measurements.

Footprints (N, 5) of obstacles are rectangles: centre x, y, half length, half width [m], yaw [rad].
Grids are square, with a spacing of `cell` metres and a first point `origin` (2,). Shortest paths
are found by Dijkstra's algorithm (1959, doi:10.1007/BF01386390) with eight neighbours, and ranges
of rays by sphere tracing (Hart 1996, doi:10.1007/s003710050084).
"""

import heapq
import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Capsules, Floats, Ints, JointAngles, Points2

NEAREST_M = 0.02
"""Distance from an obstacle below which a ray counts as ending there [m]."""
STEPS = 64
"""Maximum number of steps along a ray."""


class GridPoint(NamedTuple):
    """A point of a grid by its indices."""

    i: int
    """Index along x."""
    j: int
    """Index along y."""


def gaps_m(xs: Floats, ys: Floats, footprints: Floats) -> Floats:
    """Return the distance of each grid point from the nearest footprint.

    Args:
        xs: (X,) first coordinates of the points [m].
        ys: (Y,) second coordinates of the points [m].
        footprints: (N, 5) footprints of obstacles.

    Returns:
        (X, Y) distances [m], negative inside a footprint, and infinite if there are no footprints.
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
    """Return the value of a field at a position, interpolated between the grid points.

    Args:
        x: first coordinate of the position [m].
        y: second coordinate of the position [m].
        field: (X, Y) values at the grid points; outside the grid, those at its edge are used.
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
        price: (X, Y) cost per length of a path at each point; infinite at blocked points.
        goal: grid indices of the goal.
        cell: distance between the points of the grid [m].

    Returns:
        (X, Y) lengths, weighted with the costs [m]. A blocked or unreachable point has the length
        of the nearest reachable point plus the distance to that point.
    """
    ways = np.full(price.shape, np.inf)
    _find_shortest(np.ascontiguousarray(price, float), goal[0], goal[1], cell, ways)
    return ways


@kernel(makes_arrays=True)
def _find_shortest(price: Floats, goal_i: int, goal_j: int, cell: float, ways: Floats) -> None:
    """Compute the lengths `ways` (X, Y) of shortest paths; see `ways_m`.

    The search first covers all reachable points, starting at the goal. It then extends from these
    to all other points in the order of their distance, so that points inside a wall are assigned to
    the nearer side of the wall.
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
    """Return the lengths of horizontal rays from given positions to the nearest obstacle.

    Args:
        places: (B, 2 or more) positions x and y [m]; further columns are ignored.
        angles: (R,) directions of the rays, measured from the x axis [rad].
        gaps: (X, Y) distances of grid points from the nearest obstacle [m].
        origin: (2,) first point of the grid [m].
        cell: distance between the points of the grid [m].
        most_m: maximum length of a ray [m].

    Returns:
        (B, R) lengths [m].
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
    """Compute the lengths `ranges` (B, R) of rays by sphere tracing."""
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
    """Return a mask of the robots that overlap a footprint, as seen from above.

    Args:
        capsules_world: (B, K, 2, 3) capsules of each robot [m].
        radius_m: (K,) radii of the capsules [m].
        footprints: (N, 5) footprints of obstacles.

    Returns:
        (B,) True for each robot that overlaps a footprint.
    """
    overlaps = np.zeros(len(capsules_world), bool)
    _find_overlaps(capsules_world, radius_m, np.asarray(footprints, float), overlaps)
    return overlaps


@kernel
def _find_overlaps(capsules: Capsules, radius: Floats, footprints: Floats, overlaps: Bools) -> None:
    """Compute the mask `overlaps` (B,) of the robots that overlap a footprint.

    The closest points of two disjoint convex polygons include a corner of one of them.
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
    """Return the distance of a point from a rectangle around the origin, given its half sides."""
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
    """Return the grid point nearest to a position.

    Args:
        x: first coordinate of the position [m].
        y: second coordinate of the position [m].
        origin: (2,) first point of the grid [m].
        cell: distance between the points of the grid [m].
    """
    i, j = np.rint((np.array([x, y]) - origin) / cell).astype(int).tolist()
    return GridPoint(i, j)


def select_apart(points: Points2, apart_m: float) -> Ints:
    """Select points (n, 2) with distances of at least `apart_m` [m], and return their indices.

    The selection begins with the first point and repeatedly adds the point farthest from all
    selected ones.
    """
    chosen, away = [0], np.linalg.norm(points - points[0], axis=1)
    while (k := int(np.argmax(away))) and away[k] >= apart_m:
        chosen.append(k)
        away = np.minimum(away, np.linalg.norm(points - points[k], axis=1))
    return np.array(chosen)
