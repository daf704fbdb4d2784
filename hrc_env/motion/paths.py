"""Paths on the floor of straight lines joined by arcs, parameterized by arc length.

Each line or arc is a row of `Worker.path`. The columns are the arc length at its beginning [m]; x,
y [m] and the direction [rad] (not wrapped) at this point; the curvature [1/m]; and the integral of
the direction over the arc length up to this point [rad m].
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion.curves import move_point, wrap
from hrc_env.motion.points import Point
from hrc_env.motion.state import MAX_VIA, Worker

HEADING_WINDOW_M = 0.3
"""Half the width of the window over which the direction is averaged [m] (Grasso et al. 1998)."""
OWN_EDGE = 0.9
"""Maximum fraction of the first or last edge of a path that the arc of a corner occupies."""
SHARED_EDGE = 0.5
"""Maximum fraction of an edge between two corners that the arc of each corner occupies."""


@kernel
def lay_path(start: Point, via: Floats, end: Point, worker: Worker) -> None:
    """Compute a path with given corners, its length and its maximum curvature.

    Args:
        start: first point of the path.
        via: corners (n, 3): x, y, and the distance before the corner at which its arc may begin
            [m].
        end: last point of the path.
        worker: record into which the path is written.
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
            own_share = OWN_EDGE if k == 0 else 1.0  # the rest after the previous corner's arc
            next_share = SHARED_EDGE if k + 1 < n else OWN_EDGE
            arm = min(via[k, 2], own_share * before, next_share * after)
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
def _find_piece(distance: float, worker: Worker) -> int:
    """Return the index of the line or arc at a distance [m] along the path."""
    k = worker.n_pieces - 1
    while k > 0 and worker.path[k, 0] > distance:
        k -= 1
    return k


@kernel
def locate_on_path(distance: float, worker: Worker) -> Point:
    """Return the point at a distance [m] along the path, clamped to its ends."""
    distance = min(max(distance, 0.0), worker.length)
    piece = worker.path[_find_piece(distance, worker)]
    way, heading, curvature = distance - piece[0], piece[3], piece[4]
    half = 0.5 * curvature * way
    if abs(half) > 1e-9:  # the chord of an arc
        way *= math.sin(half) / half
    return move_point(piece[1], piece[2], heading + half, way, 0.0)


@kernel
def average_heading(distance: float, worker: Worker) -> float:
    """Return the mean direction of the path near a distance [m] along it [rad].

    The direction and its rate are continuous.
    """
    behind, ahead = distance - HEADING_WINDOW_M, distance + HEADING_WINDOW_M
    return (_integrate_heading(ahead, worker) - _integrate_heading(behind, worker)) / (
        2.0 * HEADING_WINDOW_M
    )


@kernel
def _integrate_heading(distance: float, worker: Worker) -> float:
    """Return the integral of the direction from 0 to a distance [m] along the path [rad m].

    The path is extended by straight lines at its ends.
    """
    within = min(max(distance, 0.0), worker.length)
    piece = worker.path[_find_piece(within, worker)]
    way, heading, curvature = within - piece[0], piece[3], piece[4]
    total = piece[5] + (heading + 0.5 * curvature * way) * way
    return total + (distance - within) * (heading + curvature * way)
