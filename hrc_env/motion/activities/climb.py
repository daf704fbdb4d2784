"""Climbing a step or a low ladder, looking about up there, and coming down backwards."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.planning import between, blank
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.motion.curves import cruise, min_jerk
from hrc_env.motion.feet import step_time
from hrc_env.motion.posture import RELAXED_ELBOW, RELAXED_PITCH, hang, stand

HIGHEST_RISER_M = 0.32
"""Greatest rise of one step [m]; ladders have rungs 0.25 to 0.30 m apart (EN 131-1)."""
FIRST_M, TREAD_M = 0.40, 0.24
"""Where a foot goes on the first tread, and from tread to tread [m]."""
STEP_AT_S, PERIOD_S, SWING_S = 0.12, 0.72, 0.56
"""First lift-off, then the times of `plans` of a climber's steps [s]; judgement."""


@kernel
def climb(t: float, plan: Floats, clock_s: float, traits: Floats, size: Floats, q: Floats) -> None:
    """The control vector of someone who climbs, stays, and comes down as they went up."""
    x, y, yaw = plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW]
    stand(x, y, yaw, clock_s, traits, size, q)
    up_s, treads = plan[pl.UP_S], plan[pl.TREADS]
    when = step_time(t, plan)
    along = cruise((when - 0.25) / (up_s - 0.25), 0.4)
    risen = cruise((when - 0.50) / (up_s - 0.55), 0.4)
    ahead = (FIRST_M + TREAD_M * (treads - 1.0)) * along
    q[c.ROOT_X] += math.cos(yaw) * ahead
    q[c.ROOT_Y] += math.sin(yaw) * ahead
    q[c.PELVIS_Z] += treads * plan[pl.RISER_M] * risen
    going = min_jerk(when / 0.5) - min_jerk((when - up_s + 0.3) / 0.6)
    q[c.SPINE_FLEX] += 0.14 * going
    q[c.PELVIS_PITCH] += 0.10 * going
    q[c.HEAD_PITCH] += 0.20 * going
    for side in range(2):
        hang(side, RELAXED_PITCH - 0.05 * going, RELAXED_ELBOW + 0.25 * going, size, q)


@kernel
def start_climb(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to climb to the place's height; returns how long it takes [s]."""
    blank(me)
    plan, prints = me.plan, me.prints
    high = place[3] if place[3] > 0.0 else between(draws[0], 0.18, 0.30)
    treads = max(1, math.ceil(high / HIGHEST_RISER_M))
    plan[pl.TREADS], plan[pl.RISER_M] = treads, high / treads
    first = 1 if draws[1] < 0.5 else 0
    plan[pl.STEP_START], plan[pl.STEP_PERIOD], plan[pl.STEP_SWING] = STEP_AT_S, PERIOD_S, SWING_S
    plan[pl.STEP_FIRST], plan[pl.STEP_COUNT] = first, treads + 1
    cos, sin = math.cos(plan[pl.START_YAW]), math.sin(plan[pl.START_YAW])
    for k in range(treads + 1):
        side, tread = (k + first) % 2, min(k + 1, treads)
        ahead = FIRST_M + TREAD_M * (tread - 1.0)
        for i in range(3):
            prints[k, i] = me.stance[side, i]
        prints[k, 0] += cos * ahead
        prints[k, 1] += sin * ahead
        prints[k, 3], prints[k, 4] = 0.25, tread * plan[pl.RISER_M]
    plan[pl.UP_S] = STEP_AT_S + treads * PERIOD_S + SWING_S + 0.1
    plan[pl.UNDO_AT] = plan[pl.UP_S] + 0.5 * between(draws[2], 0.5, 4.0)
    return 2.0 * plan[pl.UNDO_AT]
