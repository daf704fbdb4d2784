"""Ways round things and people: A* on a grid (Hart, Nilsson and Raphael 1968), pulled tight."""

import heapq
import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.motion.floorplan import CELL_M, slack_at
from hrc_env.motion.paths import along, lay_path
from hrc_env.motion.state import MAX_VIA, Pair, Worker

STRIDE, SAMPLE_M = 3, 0.06
"""Grid points of the field to a node of the search: 15 cm; lines are looked at in such steps."""
EASE_M = 0.7
"""So near its ends a way may be as near to things as its ends are [m]."""
SEARCHED_M, PULLED_M, WALKED_M = 0.05, 0.03, -0.02
"""Slack that nodes, straight lines and the arcs at last must have [m]."""
ARMS_M = (1.2, 0.7, 0.35, 0.15, 0.02)
"""How far before a corner an arc begins at most [m], tried in turn."""
BOW_SHARE = 0.12
"""People do not walk dead straight: sideways bow of a free way as a share of it; judgement."""


class Ground(NamedTuple):
    """What ways keep clear of."""

    ends: Floats
    """(2, 3) x, y and slack of the way's ends."""
    discs: Floats
    """(n, 3) x, y, radius of what is in the way for now."""
    slack: Floats
    origin: Floats
    """Of a `Floorplan`."""


@kernel
def roomy(x: float, y: float, margin: float, ground: Ground) -> bool:
    """Whether a point of a way is free, with `margin` [m] of slack far from the ends."""
    need = margin
    for k in range(2):
        own = ground.ends[k, 2]
        if own < margin:
            away = math.hypot(x - ground.ends[k, 0], y - ground.ends[k, 1]) / EASE_M
            need = min(need, own - 0.005 + (margin - own) * min(away, 1.0))
    if slack_at(x, y, ground.slack, ground.origin) < need:
        return False
    for k in range(ground.discs.shape[0]):
        if math.hypot(x - ground.discs[k, 0], y - ground.discs[k, 1]) < ground.discs[k, 2]:
            return False
    return True


@kernel
def clear(x0: float, y0: float, x1: float, y1: float, margin: float, ground: Ground) -> bool:
    """Whether a straight line is free."""
    n = int(math.hypot(x1 - x0, y1 - y0) / SAMPLE_M) + 1
    for k in range(n + 1):
        u = k / n
        x, y = x0 + u * (x1 - x0), y0 + u * (y1 - y0)
        if not roomy(x, y, margin, ground):
            return False
    return True


@kernel(makes_arrays=True)
def route(
    start: Pair, end: Pair, bow: float, discs: Floats, slack: Floats, origin: Floats, me: Worker
) -> bool:
    """Find a way and lay the path, if there is one; whether there is.

    `bow` in [-1, 1] is how a free way bends; discs (n, 3), x, y, radius, give way to its ends.
    """
    ends, own, via = np.empty((2, 3)), discs.copy(), np.empty((MAX_VIA, 3))
    for k in range(2):
        x, y = start if k == 0 else end
        ends[k, 0], ends[k, 1], ends[k, 2] = x, y, slack_at(x, y, slack, origin)
        for i in range(own.shape[0]):
            own[i, 2] = min(own[i, 2], math.hypot(x - own[i, 0], y - own[i, 1]) - 0.02)
    ground = Ground(ends, own, slack, origin)
    if clear(start[0], start[1], end[0], end[1], PULLED_M, ground):
        via[0, 0] = 0.5 * (start[0] + end[0]) - BOW_SHARE * bow * (end[1] - start[1])
        via[0, 1] = 0.5 * (start[1] + end[1]) + BOW_SHARE * bow * (end[0] - start[0])
        via[0, 2] = 9.0
        lay_path(start, via[:1], end, me)
        if not walkable(ground, me):
            lay_path(start, via[:0], end, me)
        return True
    n = _search(start, end, ground, via)
    for arm in ARMS_M:
        if n >= 0:
            via[:n, 2] = arm
            lay_path(start, via[:n], end, me)
            if walkable(ground, me):
                return True
    return False


@kernel
def walkable(ground: Ground, me: Worker) -> bool:
    """Whether the path of a plan is free."""
    n = int(me.length / SAMPLE_M) + 1
    for k in range(n + 1):
        x, y = along(k / n * me.length, me)
        if not roomy(x, y, WALKED_M, ground):
            return False
    return True


@kernel(makes_arrays=True)
def _search(start: Pair, end: Pair, ground: Ground, via: Floats) -> int:
    """Corners of a short way by A* (`route`); -1 where there is none, or it has too many."""
    h, origin = STRIDE * CELL_M, ground.origin
    n_x = (ground.slack.shape[0] + STRIDE - 1) // STRIDE
    n_y = (ground.slack.shape[1] + STRIDE - 1) // STRIDE
    cost, parent = np.full(n_x * n_y, np.inf), np.full(n_x * n_y, -1)
    state = np.zeros(n_x * n_y, np.int8)  # 0 not looked at, 1 free, 2 not free, 3 done
    queue: list = [(0.0, -1)]
    heapq.heappop(queue)
    si, sj = round((start[0] - origin[0]) / h), round((start[1] - origin[1]) / h)
    for i in range(max(si - 2, 0), min(si + 3, n_x)):
        for j in range(max(sj - 2, 0), min(sj + 3, n_y)):
            x, y = origin[0] + i * h, origin[1] + j * h
            if clear(start[0], start[1], x, y, PULLED_M, ground):
                node = i * n_y + j
                cost[node] = math.hypot(x - start[0], y - start[1])
                state[node] = 1
                heapq.heappush(queue, (cost[node] + math.hypot(end[0] - x, end[1] - y), node))
    while len(queue) > 0:
        _, node = heapq.heappop(queue)
        if state[node] == 3:
            continue
        state[node] = 3
        i, j = node // n_y, node % n_y
        x, y = origin[0] + i * h, origin[1] + j * h
        near = math.hypot(end[0] - x, end[1] - y) < 2.0 * h
        if near and clear(x, y, end[0], end[1], PULLED_M, ground):
            return _pull(node, parent, n_y, start, end, ground, via)
        for a in range(max(i - 1, 0), min(i + 2, n_x)):
            for b in range(max(j - 1, 0), min(j + 2, n_y)):
                other, x, y = a * n_y + b, origin[0] + a * h, origin[1] + b * h
                if state[other] == 0:
                    state[other] = 1 if roomy(x, y, SEARCHED_M, ground) else 2
                longer = cost[node] + h * math.hypot(a - i, b - j)
                if state[other] == 1 and longer < cost[other] - 1e-9:
                    cost[other], parent[other] = longer, node
                    heapq.heappush(queue, (longer + math.hypot(end[0] - x, end[1] - y), other))
    return -1


@kernel
def _pull(
    goal: int, parent: Ints, n_y: int, start: Pair, end: Pair, ground: Ground, via: Floats
) -> int:
    """Pull a chain of nodes tight, from its end to its start, into at most MAX_VIA corners."""
    origin, h = ground.origin, STRIDE * CELL_M
    at_x, at_y, last_x, last_y = end[0], end[1], end[0], end[1]
    node, count = goal, 0
    while True:
        if node >= 0:
            x, y = origin[0] + (node // n_y) * h, origin[1] + (node % n_y) * h
        else:
            x, y = start
        if not clear(at_x, at_y, x, y, PULLED_M, ground):
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
