"""A sudden reach into the workspace with a step: the hand is there in half a second.

Hands at 2.5 to 3.5 m/s; assumed, near the fastest arm movements at work.
"""

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.planning import (
    between,
    blank,
    dominant,
    look_to,
    put_tool,
    step_ahead,
    strokes,
)
from hrc_env.motion.activities.strokes import STILL
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.motion.anatomy import ARM

AHEAD_ARMS = (1.2, 1.5)
"""How far ahead it is, in lengths of the arm: a step and a bow away; judgement."""


@kernel
def plan_lunge(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to snatch at something ahead, at the place's height; the hand's speed [m/s]."""
    blank(me)
    side = dominant(draws[0], me)
    sign = 1.0 - 2.0 * side
    z = place[3] if place[3] > 0.0 else between(draws[1], 0.9, 1.3)
    step_ahead(side, between(draws[2], 0.32, 0.42), me)
    ahead = me.size[ARM] * between(draws[3], *AHEAD_ARMS)
    at = (ahead, sign * between(draws[4], -0.1, 0.25), z)
    put_tool(0, side, at, (0.0, 0.0, 0.0), me)
    look_to(at, me)
    strokes(STILL, 0.0, 0.0, between(draws[5], 0.0, 0.3), 1, me)
    me.plan[pl.SETTLE_S], me.plan[pl.OUT_AT] = 0.7, 0.12
    me.plan[pl.STEP_SWING] = 0.40
    me.plan[pl.TWIST] = -0.35 * sign
    return between(draws[6], 1.9, 2.3)
