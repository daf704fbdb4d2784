"""A path over the floor: straight lines joined by arcs, by the distance walked along it.

The columns of a piece (a row of `Worker.path`) are the distance before it [m], x, y [m], the
direction at its beginning [rad] (not wrapped), its curvature [1/m] and the integral of the
direction up to it [rad m].
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion.curves import move_point, wrap
from hrc_env.motion.points import Point
from hrc_env.motion.state import MAX_VIA, Worker

HEADING_WINDOW_M = 0.3
"""Distance to both sides over which walkers average the direction (Grasso et al. 1998) [m]."""
OWN_EDGE = 0.9
"""Greatest share of the first or last edge that the arc of a corner takes."""
SHARED_EDGE = 0.5
"""Greatest share of an edge between two corners that the arc of either takes."""


@kernel
def lay_path(start: Point, via: Floats, end: Point, worker: Worker) -> None:
    """Write the path past some corners, its length and its greatest curvature.

    Args:
        start: its first point.
        via: corners (n, 3): x, y, and the distance before the corner at which its arc may begin
            [m].
        end: its last point.
        worker: record that the path is written into.
    """
    worker.end_x, worker.end_y = end.x, end.y
    n = min(via.shape[0], MAX_VIA)
    x, y, s, total, count = start.x, start.y, 0.0, 0.0, 0
    worker.sharpest = heading = 0.0
    for k in range(n + 1):
        to_x, to_y = (via[k, 0], via[k, 1]) if k < n else (end.x, end.y)
        direction = math.atan2(to_y - y, to_x - x)
        heading = direction if k == 0 else heading + wrap(direction - heading)
        arm, turn = 0.0, 0.0
        if k < n:
            next_x, next_y = (via[k + 1, 0], via[k + 1, 1]) if k + 1 < n else (end.x, end.y)
            turn = wrap(math.atan2(next_y - to_y, next_x - to_x) - heading)
            before, after = math.hypot(to_x - x, to_y - y), math.hypot(next_x - to_x, next_y - to_y)
            own = OWN_EDGE if k == 0 else 1.0  # what the corner before has left is all its own
            arm = min(via[k, 2], own * before, (SHARED_EDGE if k + 1 < n else OWN_EDGE) * after)
        straight = max(math.hypot(to_x - x, to_y - y) - arm, 0.0)
        worker.path[count, :] = (s, x, y, heading, 0.0, total)
        s, total, count = s + straight, total + heading * straight, count + 1
        x, y = x + straight * math.cos(heading), y + straight * math.sin(heading)
        if arm > 1e-6 and abs(turn) > 1e-6:
            radius = arm / math.tan(0.5 * abs(turn))
            curvature, length = math.copysign(1.0 / radius, turn), radius * abs(turn)
            worker.path[count, :] = (s, x, y, heading, curvature, total)
            worker.sharpest = max(worker.sharpest, 1.0 / radius)
            s, total, count = s + length, total + (heading + 0.5 * turn) * length, count + 1
            heading += turn
            x = to_x + arm * math.cos(heading)
            y = to_y + arm * math.sin(heading)
    worker.length, worker.n_pieces = max(s, 1e-6), count


@kernel
def _find_piece(s: float, worker: Worker) -> int:
    """Return the index of the piece at a distance `s` [m] along the path."""
    k = worker.n_pieces - 1
    while k > 0 and worker.path[k, 0] > s:
        k -= 1
    return k


@kernel
def locate_on_path(s: float, worker: Worker) -> Point:
    """Return the point of the path after `s` metres, held at its ends."""
    s = min(max(s, 0.0), worker.length)
    piece = worker.path[_find_piece(s, worker)]
    way, heading, curvature = s - piece[0], piece[3], piece[4]
    half = 0.5 * curvature * way
    if abs(half) > 1e-9:  # the chord of an arc
        way *= math.sin(half) / half
    return move_point(piece[1], piece[2], heading + half, way, 0.0)


@kernel
def average_heading(s: float, worker: Worker) -> float:
    """Return the mean direction of the path around `s` metres [rad].

    The direction and its rate are continuous.
    """
    behind, ahead = s - HEADING_WINDOW_M, s + HEADING_WINDOW_M
    return (_integrate_heading(ahead, worker) - _integrate_heading(behind, worker)) / (
        2.0 * HEADING_WINDOW_M
    )


@kernel
def _integrate_heading(s: float, worker: Worker) -> float:
    """Return the integral of the direction from 0 to `s` [rad m].

    The path goes on straight at its ends.
    """
    within = min(max(s, 0.0), worker.length)
    piece = worker.path[_find_piece(within, worker)]
    way, heading, curvature = within - piece[0], piece[3], piece[4]
    total = piece[5] + (heading + 0.5 * curvature * way) * way
    return total + (s - within) * (heading + curvature * way)
