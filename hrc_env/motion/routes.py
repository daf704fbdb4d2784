"""Search for paths around objects and people by A* on a grid (Hart et al. 1968) with shortcuts."""

import heapq
import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.motion.floorplan import CELL_M, FloorGrid, read_slack
from hrc_env.motion.paths import lay_path, locate_on_path
from hrc_env.motion.points import Point
from hrc_env.motion.state import MAX_VIA, Worker

STRIDE = 3
"""Distance between nodes of the search, in cells of the floor's grid (15 cm)."""
SAMPLE_M = 0.06
"""Distance between the points at which a line is checked [m]."""
EASE_M = 0.7
"""Distance from the ends of a path within which less slack than elsewhere is accepted [m]."""
SEARCHED_M = 0.05
"""Minimum slack at the nodes of the search [m]."""
PULLED_M = 0.03
"""Minimum slack along straight lines [m]."""
WALKED_M = -0.02
"""Minimum slack along the path with its arcs [m]."""
ARMS_M = (1.2, 0.7, 0.35, 0.15, 0.02)
"""Distances before a corner at which its arc may begin, tried in turn [m]."""
BOW_SHARE = 0.12
"""Maximum lateral bow of an unobstructed path, as a fraction of its length."""


class Ground(NamedTuple):
    """Obstacles to be avoided by a path."""

    ends: Floats
    """Ends (2, 3) of the path: x, y, slack [m]."""
    discs: Floats
    """Temporary obstacles (n, 3): x, y, radius [m]."""
    grid: FloorGrid
    """Slack on the floor."""


@kernel
def is_point_free(x: float, y: float, margin: float, ground: Ground) -> bool:
    """Return whether a point of a path is free of obstacles.

    Args:
        x: world x [m].
        y: world y [m].
        margin: minimum slack far from the ends [m].
        ground: obstacles.
    """
    least = margin
    for k in range(2):
        slack = ground.ends[k, 2]
        if slack < margin:
            away = math.hypot(x - ground.ends[k, 0], y - ground.ends[k, 1]) / EASE_M
            least = min(least, slack - 0.005 + (margin - slack) * min(away, 1.0))
    if read_slack(x, y, ground.grid) < least:
        return False
    for k in range(ground.discs.shape[0]):
        if math.hypot(x - ground.discs[k, 0], y - ground.discs[k, 1]) < ground.discs[k, 2]:
            return False
    return True


@kernel
def is_line_free(x0: float, y0: float, x1: float, y1: float, margin: float, ground: Ground) -> bool:
    """Return whether a straight line is free of obstacles.

    Args:
        x0: world x of its first point [m].
        y0: world y of its first point [m].
        x1: world x of its last point [m].
        y1: world y of its last point [m].
        margin: minimum slack far from the ends [m].
        ground: obstacles.
    """
    n = int(math.hypot(x1 - x0, y1 - y0) / SAMPLE_M) + 1
    for k in range(n + 1):
        u = k / n
        x, y = x0 + u * (x1 - x0), y0 + u * (y1 - y0)
        if not is_point_free(x, y, margin, ground):
            return False
    return True


@kernel(makes_arrays=True)
def find_route(
    start: Point, end: Point, bow: float, discs: Floats, grid: FloorGrid, worker: Worker
) -> bool:
    """Find a path and, if there is one, write it into the worker's record.

    Args:
        start: first point.
        end: last point.
        bow: lateral bow of a straight path, in [-1, 1].
        discs: temporary obstacles (n, 3): x, y, radius [m]; they are shrunk to leave the ends free.
        grid: slack on the floor.
        worker: record into which the path is written.

    Returns:
        Whether there is a path.
    """
    ends, shrunk, via = np.empty((2, 3)), discs.copy(), np.empty((MAX_VIA, 3))
    for k in range(2):
        x, y = (start.x, start.y) if k == 0 else (end.x, end.y)
        ends[k, 0], ends[k, 1], ends[k, 2] = x, y, read_slack(x, y, grid)
        for i in range(shrunk.shape[0]):
            shrunk[i, 2] = min(shrunk[i, 2], math.hypot(x - shrunk[i, 0], y - shrunk[i, 1]) - 0.02)
    ground = Ground(ends, shrunk, grid)
    if is_line_free(start.x, start.y, end.x, end.y, PULLED_M, ground):
        via[0, 0] = 0.5 * (start.x + end.x) - BOW_SHARE * bow * (end.y - start.y)
        via[0, 1] = 0.5 * (start.y + end.y) + BOW_SHARE * bow * (end.x - start.x)
        via[0, 2] = 9.0
        lay_path(start, via[:1], end, worker)
        if not is_path_free(ground, worker):
            lay_path(start, via[:0], end, worker)
        return True
    n = _search(start, end, ground, via)
    for arm in ARMS_M:
        if n >= 0:
            via[:n, 2] = arm
            lay_path(start, via[:n], end, worker)
            if is_path_free(ground, worker):
                return True
    return False


@kernel
def is_path_free(ground: Ground, worker: Worker) -> bool:
    """Return whether a worker's path is free of obstacles."""
    n = int(worker.length / SAMPLE_M) + 1
    for k in range(n + 1):
        x, y = locate_on_path(k / n * worker.length, worker)
        if not is_point_free(x, y, WALKED_M, ground):
            return False
    return True


@kernel(makes_arrays=True)
def _search(start: Point, end: Point, ground: Ground, via: Floats) -> int:
    """Find the corners of a short path by A*.

    Args:
        start: first point.
        end: last point.
        ground: obstacles.
        via: corners (`MAX_VIA`, 3), of which the first two columns are written.

    Returns:
        The number of corners; -1 if there is no path, or it has more than `MAX_VIA` corners.
    """
    h, slack, origin = STRIDE * CELL_M, ground.grid.slack, ground.grid.origin
    n_x = (slack.shape[0] + STRIDE - 1) // STRIDE
    n_y = (slack.shape[1] + STRIDE - 1) // STRIDE
    cost, parent = np.full(n_x * n_y, np.inf), np.full(n_x * n_y, -1)
    state = np.zeros(n_x * n_y, np.int8)  # 0 not visited, 1 free, 2 blocked, 3 done
    queue: list = [(0.0, -1)]
    heapq.heappop(queue)
    si, sj = round((start.x - origin[0]) / h), round((start.y - origin[1]) / h)
    for i in range(max(si - 2, 0), min(si + 3, n_x)):
        for j in range(max(sj - 2, 0), min(sj + 3, n_y)):
            x, y = origin[0] + i * h, origin[1] + j * h
            if is_line_free(start.x, start.y, x, y, PULLED_M, ground):
                node = i * n_y + j
                cost[node] = math.hypot(x - start.x, y - start.y)
                state[node] = 1
                heapq.heappush(queue, (cost[node] + math.hypot(end.x - x, end.y - y), node))
    while len(queue) > 0:
        _, node = heapq.heappop(queue)
        if state[node] == 3:
            continue
        state[node] = 3
        i, j = node // n_y, node % n_y
        x, y = origin[0] + i * h, origin[1] + j * h
        near = math.hypot(end.x - x, end.y - y) < 2.0 * h
        if near and is_line_free(x, y, end.x, end.y, PULLED_M, ground):
            return _pull_tight(node, parent, n_y, start, end, ground, via)
        for a in range(max(i - 1, 0), min(i + 2, n_x)):
            for b in range(max(j - 1, 0), min(j + 2, n_y)):
                other, x, y = a * n_y + b, origin[0] + a * h, origin[1] + b * h
                if state[other] == 0:
                    state[other] = 1 if is_point_free(x, y, SEARCHED_M, ground) else 2
                longer = cost[node] + h * math.hypot(a - i, b - j)
                if state[other] == 1 and longer < cost[other] - 1e-9:
                    cost[other], parent[other] = longer, node
                    heapq.heappush(queue, (longer + math.hypot(end.x - x, end.y - y), other))
    return -1


@kernel
def _pull_tight(
    goal: int, parent: Ints, n_y: int, start: Point, end: Point, ground: Ground, via: Floats
) -> int:
    """Reduce a chain of nodes, from its end to its start, to the necessary corners.

    Args:
        goal: last node of the chain.
        parent: node before each node; -1 for the first one.
        n_y: number of nodes along y.
        start: first point of the path.
        end: last point of the path.
        ground: obstacles.
        via: corners (`MAX_VIA`, 3), of which the first two columns are written.

    Returns:
        The number of corners; -1 if there are more than `MAX_VIA`.
    """
    origin, h = ground.grid.origin, STRIDE * CELL_M
    at_x, at_y, last_x, last_y = end.x, end.y, end.x, end.y
    node, count = goal, 0
    while True:
        if node >= 0:
            x, y = origin[0] + (node // n_y) * h, origin[1] + (node % n_y) * h
        else:
            x, y = start.x, start.y
        if not is_line_free(at_x, at_y, x, y, PULLED_M, ground):
            if count == via.shape[0] or (last_x == at_x and last_y == at_y):
                return -1
            via[count, 0], via[count, 1] = last_x, last_y
            at_x, at_y, count = last_x, last_y, count + 1
        last_x, last_y = x, y
        if node < 0:
            break
        node = parent[node]
    for k in range(count // 2):
        for i in range(2):
            via[k, i], via[count - 1 - k, i] = via[count - 1 - k, i], via[k, i]
    return count
