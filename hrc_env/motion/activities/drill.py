"""Drilling and driving screws: one hand leans on the drill, the other fetches screws from the
pouch; overhead it holds the work up."""

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
from hrc_env.motion.activities.strokes import BORE, PRESS
from hrc_env.motion.activities.work import LOW_M
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.worker.props import prop_index

DRILL = prop_index("drill")
BIT_M, BIT_UP_M = 0.22, 0.09
"""Tip of the bit: ahead of the fist and above it [m]; `props`."""
THRUST_M = 0.04
"""How far the drill goes in [m]; a screw."""
OVERHEAD_M = 1.7
"""From this height on people work above their head [m]."""


@kernel
def plan_drill(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to drill at the place's height; returns how fast hands may go to it [m/s]."""
    blank(me)
    side = dominant(draws[0], me)
    sign = 1.0 - 2.0 * side
    z = place[3] if place[3] > 0.0 else between(draws[1], 1.1, 1.4)
    overhead = z >= OVERHEAD_M
    if z < LOW_M:
        kneel_down(side, me)
    else:
        step_ahead(1 - side, 0.10 if overhead else 0.18, me)
    aside = before_knee(me)
    if overhead:
        ahead, turn = 0.34, (0.0, -0.5 * math.pi, 0.0)
        at, beside = (ahead + BIT_UP_M, 0.10 * sign, z - BIT_M - THRUST_M), (ahead, z - 0.04)
    else:
        ahead, turn = 0.70, (0.0, 0.0, 0.0)
        at = (ahead - BIT_M - THRUST_M, aside + 0.05 * sign, z - BIT_UP_M)
        beside = (ahead - 0.04, z - 0.02)
    put_tool(DRILL, side, at, turn, me)
    put_other((beside[0], aside - (0.22 if overhead else 0.12) * sign, beside[1]), me)
    look_to((ahead, aside, z), me)
    strokes(
        PRESS if overhead else BORE,
        THRUST_M,
        0.0,
        between(draws[2], 1.5, 1.8),
        2 + int(3.0 * draws[3]),
        me,
    )
    me.plan[pl.WANDER_M] = 0.12 * sign
    return CALM_M_S
