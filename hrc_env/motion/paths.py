"""A way over the floor: straight lines joined by arcs, by the metres walked along it.

Pieces (rows of `path`): metres before it, x, y, direction there [rad] (not wrapped), curvature
[1/m], integral of the direction up to it [rad m].
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion.curves import placed, wrap
from hrc_env.motion.state import MAX_VIA, Pair, Worker

HEADING_WINDOW_M = 0.3
"""Walkers face the mean direction of so much of the path behind and ahead (Grasso et al. 1998)."""
OWN_EDGE, SHARED_EDGE = 0.9, 0.5
"""Most of an edge that the arc of a corner takes: of the first or last, of one between two."""


@kernel
def lay_path(start: Pair, via: Floats, end: Pair, me: Worker) -> None:
    """Write the path past corners `via` (n, 3): x, y, and how far from it its arc may begin [m]."""
    me.end_x, me.end_y = end
    n = min(via.shape[0], MAX_VIA)
    x, y, s, total, count = start[0], start[1], 0.0, 0.0, 0
    me.sharpest = heading = 0.0
    for k in range(n + 1):
        to_x, to_y = (via[k, 0], via[k, 1]) if k < n else end
        direction = math.atan2(to_y - y, to_x - x)
        heading = direction if k == 0 else heading + wrap(direction - heading)
        arm, turn = 0.0, 0.0
        if k < n:
            next_x, next_y = (via[k + 1, 0], via[k + 1, 1]) if k + 1 < n else end
            turn = wrap(math.atan2(next_y - to_y, next_x - to_x) - heading)
            before, after = math.hypot(to_x - x, to_y - y), math.hypot(next_x - to_x, next_y - to_y)
            own = OWN_EDGE if k == 0 else 1.0  # what the corner before has left is all its own
            arm = min(via[k, 2], own * before, (SHARED_EDGE if k + 1 < n else OWN_EDGE) * after)
        straight = max(math.hypot(to_x - x, to_y - y) - arm, 0.0)
        me.path[count, :] = (s, x, y, heading, 0.0, total)
        s, total, count = s + straight, total + heading * straight, count + 1
        x, y = x + straight * math.cos(heading), y + straight * math.sin(heading)
        if arm > 1e-6 and abs(turn) > 1e-6:
            radius = arm / math.tan(0.5 * abs(turn))
            curvature, length = math.copysign(1.0 / radius, turn), radius * abs(turn)
            me.path[count, :] = (s, x, y, heading, curvature, total)
            me.sharpest = max(me.sharpest, 1.0 / radius)
            s, total, count = s + length, total + (heading + 0.5 * turn) * length, count + 1
            heading += turn
            x = to_x + arm * math.cos(heading)
            y = to_y + arm * math.sin(heading)
    me.length, me.n_pieces = max(s, 1e-6), count


@kernel
def _find(s: float, me: Worker) -> int:
    """The piece that s [m] along the path lies on."""
    k = me.n_pieces - 1
    while k > 0 and me.path[k, 0] > s:
        k -= 1
    return k


@kernel
def along(s: float, me: Worker) -> Pair:
    """Point of the path after s metres, held at its ends."""
    s = min(max(s, 0.0), me.length)
    piece = me.path[_find(s, me)]
    way, heading, curvature = s - piece[0], piece[3], piece[4]
    half = 0.5 * curvature * way
    if abs(half) > 1e-9:  # the chord of an arc
        way *= math.sin(half) / half
    return placed(piece[1], piece[2], heading + half, way, 0.0)


@kernel
def facing(s: float, me: Worker) -> float:
    """Mean direction of the path round s metres [rad], continuous and so is its rate."""
    behind, ahead = s - HEADING_WINDOW_M, s + HEADING_WINDOW_M
    return (_turned(ahead, me) - _turned(behind, me)) / (2.0 * HEADING_WINDOW_M)


@kernel
def _turned(s: float, me: Worker) -> float:
    """Integral of the direction from 0 to s [rad m]; straight on beyond the ends."""
    within = min(max(s, 0.0), me.length)
    piece = me.path[_find(within, me)]
    way, heading, curvature = within - piece[0], piece[3], piece[4]
    total = piece[5] + (heading + 0.5 * curvature * way) * way
    return total + (s - within) * (heading + curvature * way)
