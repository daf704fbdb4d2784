"""Pointing at something: an arm stretched out, the head with it, a beat or two."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.planning import (
    between,
    blank,
    dominant,
    look_to,
    put_tool,
    strokes,
)
from hrc_env.motion.activities.strokes import JAB
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.motion.anatomy import ARM, STAND_Z

SHOULDER_SHARE, SHOULDER_M = 1.50, 0.19
"""Height of the shoulder in heights of the pelvis, and its distance from the middle [m]."""
POINT_M_S = 1.5
"""Peak speed of the pointing hand [m/s]; a quick reach."""


@kernel
def plan_point(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to point somewhere ahead, at its height if it has one; the hand's speed [m/s]."""
    blank(me)
    side = dominant(draws[0], me)
    sign = 1.0 - 2.0 * side
    aside = sign * between(draws[1], -0.4, 0.7)
    up = between(draws[2], -0.25, 0.25)
    reach = 0.95 * me.size[ARM]
    shoulder_z = SHOULDER_SHARE * me.size[STAND_Z]
    at = (
        reach * math.cos(up) * math.cos(aside),
        SHOULDER_M * sign + reach * math.cos(up) * math.sin(aside),
        shoulder_z + reach * math.sin(up),
    )
    put_tool(0, side, at, (0.0, 0.0, 0.0), me)
    look_to((10.0 * math.cos(aside), 10.0 * math.sin(aside), shoulder_z + 10.0 * math.tan(up)), me)
    strokes(JAB, 0.03, between(draws[3], 1.2, 1.8), between(draws[4], 0.8, 2.2), 1, me)
    me.plan[pl.TWIST] = 0.35 * aside
    return POINT_M_S
