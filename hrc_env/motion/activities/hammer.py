"""Hammering: light taps and full blows, down onto a bench or the floor, or against a wall.

Light hammering in the recordings: about 5.6 blows a second, wrists at 1.4 m/s (95th percentile);
driving nails 1.25 to 2.0 m/s.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.planning import (
    CALM_M_S,
    before_knee,
    between,
    blank,
    dominant,
    kneel_down,
    look_to,
    put_other,
    put_tool,
    step_ahead,
    strokes,
)
from hrc_env.motion.activities.strokes import STRIKE
from hrc_env.motion.activities.work import LOW_M
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.worker.props import prop_index

HAMMER = prop_index("hammer")
HEAD_M, FACE_M = 0.25, 0.05
"""From the fist to the hammer's head along the handle, and to its face [m]; `props`."""
LIGHT_HZ, LIGHT_M = 5.6, 0.060
"""Light taps: to and fro by 6 cm, at most 1.1 m/s and a little more on the way forward."""
LOW_SHARE = 0.7
"""Share of a blow's size at floor height, where the trunk is in its way; judgement."""
WALL_M = 1.2
"""Nails at this height or higher are driven into a wall, lower ones downwards [m]."""


@kernel
def plan_hammer(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to drive nails at the place's height; returns how fast hands may go to it [m/s]."""
    blank(me)
    side = dominant(draws[0], me)
    sign = 1.0 - 2.0 * side
    z = place[3] if place[3] > 0.0 else between(draws[1], 0.85, 1.4)
    if z < LOW_M:
        kneel_down(side, me)
    else:
        step_ahead(1 - side, 0.16, me)
    aside = before_knee(me)
    if z < WALL_M:
        ahead, turn = (0.62 if z < LOW_M else 0.72), (0.0, 0.5 * math.pi, 0.0)
        at = (ahead - HEAD_M, aside + 0.06 * sign, z + FACE_M + 0.02)
    else:
        ahead, turn = 0.68, (0.0, 0.0, 0.0)
        at = (ahead - FACE_M, 0.06 * sign, z - HEAD_M)
    put_tool(HAMMER, side, at, turn, me)
    put_other((ahead - 0.02, aside - 0.09 * sign, z + 0.05 if z < WALL_M else z - 0.05), me)
    look_to((ahead, aside, z), me)
    light = draws[2] < 0.4
    size = LIGHT_M if light else between(draws[3], 0.16, 0.22)
    if z < LOW_M:
        size *= LOW_SHARE
    rate = LIGHT_HZ if light else between(draws[4], 1.9, 2.2)
    strokes(STRIKE, size, rate, between(draws[5], 1.6, 3.2), 2 + int(3.0 * draws[6]), me)
    me.plan[pl.WANDER_M] = 0.08 * sign
    return CALM_M_S
