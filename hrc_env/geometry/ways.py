"""Ways on a floor among footprints: gaps on a grid, shortest ways to a place, ranges of rays.

Footprints (N, 5) are upright rectangles: middle x, y, half length, half width [m], yaw [rad]. Grids
are square, their points `cell` apart from an origin (2,) on [m]. Shortest ways by Dijkstra (1959,
doi:10.1007/BF01386390) to eight neighbours; rays by sphere tracing (Hart 1996,
doi:10.1007/s003710050084).
"""

import heapq
import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Capsules, Floats, Ints

NEAREST_M, STEPS = 0.02, 64
"""A ray ends so near to something, or after so many steps."""


def gaps_m(xs: Floats, ys: Floats, footprints: Floats) -> Floats:
    """(X, Y) distance of points from the nearest of footprints, negative in one [m]; infinite
    without any."""
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
    """A field (X, Y) between its grid points; beyond them as at its edge."""
    u = min(max((x - origin[0]) / cell, 0.0), field.shape[0] - 1.0)
    v = min(max((y - origin[1]) / cell, 0.0), field.shape[1] - 1.0)
    i, j = min(int(u), field.shape[0] - 2), min(int(v), field.shape[1] - 2)
    u, v = u - i, v - j
    low = field[i, j] + v * (field[i, j + 1] - field[i, j])
    high = field[i + 1, j] + v * (field[i + 1, j + 1] - field[i + 1, j])
    return low + u * (high - low)


def ways_m(price: Floats, goal: tuple[int, int], cell: float) -> Floats:
    """(X, Y) length of the shortest way from every grid point to the goal [m], a metre counting
    `price` (X, Y) times, infinite where there is no way. Points that are not free, or cut off,
    have the length of the nearest that is, and the way there."""
    ways = np.full(price.shape, np.inf)
    _spread(np.ascontiguousarray(price, float), goal[0], goal[1], cell, ways)
    return ways


@kernel(makes_arrays=True)
def _spread(price: Floats, goal_i: int, goal_j: int, cell: float, ways: Floats) -> None:
    """First over free points from the goal, in the order of their lengths; then from these over all
    others, in the order of how far off they are: a wall's two sides do not mix."""
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
    places: Floats, angles: Floats, gaps: Floats, origin: Floats, cell: float, most_m: float
) -> Floats:
    """(B, R) how far it is from places (B, 2 or more), x, y [m], to what stands there, at angles
    (R,) from the x axis [rad]; at most `most_m`."""
    found = np.empty((len(places), len(angles)))
    _trace(places, angles, gaps, origin, cell, most_m, found)
    return found


@kernel
def _trace(places, angles, gaps, origin, cell, most_m, found):
    """Step on by the gap, which nothing can be nearer than."""
    for b in range(len(places)):
        for k in range(len(angles)):
            way, c, s = 0.0, math.cos(angles[k]), math.sin(angles[k])
            for _ in range(STEPS):
                x, y = places[b, 0] + way * c, places[b, 1] + way * s
                gap = value_at(x, y, gaps, origin, cell)
                if gap < NEAREST_M or way >= most_m:
                    break
                way += gap
            found[b, k] = min(way, most_m)


def met(capsules_world: Capsules, radius_m: Floats, footprints: Floats) -> Bools:
    """(B,) whether any of capsules (B, K, 2, 3), seen from above, meets a footprint."""
    found = np.zeros(len(capsules_world), bool)
    _meet(capsules_world, radius_m, np.asarray(footprints, float), found)
    return found


@kernel
def _meet(capsules, radius, footprints, found):
    """Two convex shapes that do not cross are nearest to each other at a corner of one."""
    for b in range(len(capsules)):
        for n in range(len(footprints)):
            x, y, length, width, yaw = footprints[n]
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
                gap = min(_out(ax, ay, length, width), _out(bx, by, length, width))
                for sx in (-1.0, 1.0):
                    for sy in (-1.0, 1.0):
                        gap = min(gap, _off(sx * length, sy * width, ax, ay, bx, by))
                if gap <= radius[k]:
                    found[b] = True


@kernel
def _out(x, y, length, width):
    """How far a point is out of a rectangle."""
    return math.hypot(max(abs(x) - length, 0.0), max(abs(y) - width, 0.0))


@kernel
def _off(x, y, ax, ay, bx, by):
    """How far a point is from a segment."""
    ux, uy = bx - ax, by - ay
    square = ux * ux + uy * uy
    share = 0.0
    if square > 0.0:
        share = min(max(((x - ax) * ux + (y - ay) * uy) / square, 0.0), 1.0)
    return math.hypot(x - ax - share * ux, y - ay - share * uy)


def nearest_point(x: float, y: float, origin: Floats, cell: float) -> tuple[int, int]:
    """The grid point nearest to a place."""
    i, j = np.rint((np.array([x, y]) - origin) / cell).astype(int).tolist()
    return i, j


def spread_out(points: Floats, apart_m: float) -> Ints:
    """Which of points (n, 2) to keep so that all are so far apart: the first, then always the
    farthest from those that are kept."""
    kept, away = [0], np.linalg.norm(points - points[0], axis=1)
    while (k := int(np.argmax(away))) and away[k] >= apart_m:
        kept.append(k)
        away = np.minimum(away, np.linalg.norm(points - points[k], axis=1))
    return np.array(kept)
