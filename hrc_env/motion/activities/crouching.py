"""Work at floor height with both hands: on a knee, or on the haunches."""

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.planning import (
    CALM_M_S,
    CROUCH_S,
    before_knee,
    between,
    blank,
    dominant,
    kneel_down,
    look_to,
    put_other,
    put_tool,
    strokes,
)
from hrc_env.motion.activities.strokes import BUSY
from hrc_env.motion.activities.worker import Place, Worker


@kernel
def plan_kneel(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to kneel and work low; returns how fast hands may go to it [m/s]."""
    blank(me)
    side = dominant(draws[0], me)
    kneel_down(side, me)
    return _hands_low(0.42, side, draws, place, me)


@kernel
def plan_squat(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to work low on the haunches; returns how fast hands may go to it [m/s]."""
    blank(me)
    plan = me.plan
    plan[pl.CROUCH], plan[pl.AHEAD] = 1.0, 0.02
    plan[pl.SETTLE_S], plan[pl.OUT_AT] = CROUCH_S, 0.1
    return _hands_low(0.50, dominant(draws[0], me), draws, place, me)


@kernel
def _hands_low(ahead: float, side: int, draws: Floats, place: Place, me: Worker) -> float:
    """Plan what both hands do at floor height."""
    sign = 1.0 - 2.0 * side
    z = place[3] if place[3] > 0.0 else between(draws[1], 0.12, 0.35)
    aside = before_knee(me)
    put_tool(0, side, (ahead, aside + 0.10 * sign, z), (0.0, 0.0, 0.0), me)
    put_other((ahead + 0.03, aside - 0.12 * sign, z), me)
    look_to((ahead + 0.03, aside, z), me)
    size, rate = between(draws[2], 0.02, 0.05), between(draws[3], 0.8, 1.4)
    strokes(BUSY, size, rate, between(draws[4], 1.5, 3.5), 1 + int(3.0 * draws[5]), me)
    me.plan[pl.WANDER_M] = 0.10
    return CALM_M_S
