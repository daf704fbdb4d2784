"""Measuring: both hands pull a tape along the work, hold it still and read it."""

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
    put_tool,
    step_ahead,
    strokes,
)
from hrc_env.motion.activities.strokes import SHIFT
from hrc_env.motion.activities.work import LOW_M
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.worker.props import prop_index

TAPE = prop_index("tape_measure")


@kernel
def plan_measure(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to measure at the place's height; returns how fast hands may go to it [m/s]."""
    blank(me)
    z = place[3] if place[3] > 0.0 else between(draws[1], 0.85, 1.3)
    if z < LOW_M:
        kneel_down(1, me)
    else:
        step_ahead(dominant(draws[0], me), 0.12, me)
    put_tool(TAPE, 1, (0.48, before_knee(me), z + 0.04), (0.0, 0.0, 0.0), me)
    look_to((0.46, 0.12, z), me)
    strokes(SHIFT, 0.0, 0.0, between(draws[2], 0.8, 1.6), 2 + int(3.0 * draws[3]), me)
    me.plan[pl.WANDER_M] = between(draws[4], 0.10, 0.18)
    return CALM_M_S
