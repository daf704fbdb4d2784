"""Looking round: the head to one side and the other, the trunk a little with it."""

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.planning import between, blank
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.motion.curves import min_jerk
from hrc_env.motion.posture import stand

TURN_S = 0.75
"""To turn the head across [s]; about 1.5 rad/s."""


@kernel
def look_round(
    t: float, plan: Floats, clock_s: float, traits: Floats, size: Floats, q: Floats
) -> None:
    """The control vector of someone who looks about."""
    stand(plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW], clock_s, traits, size, q)
    there, across = min_jerk(t / TURN_S), min_jerk((t - plan[pl.LEFT_S]) / TURN_S)
    back = min_jerk((t - plan[pl.RIGHT_S]) / TURN_S)
    gaze = plan[pl.LEFT_RAD] * (there - across) + plan[pl.RIGHT_RAD] * (across - back)
    q[c.HEAD_YAW] += 0.62 * gaze
    q[c.SPINE_TWIST] += 0.26 * gaze
    q[c.PELVIS_YAW] += 0.12 * gaze


@kernel
def start_look_round(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to look round; returns how long it takes [s]."""
    blank(me)
    plan = me.plan
    first = 1.0 if draws[0] < 0.5 else -1.0
    plan[pl.LEFT_RAD] = first * between(draws[1], 0.6, 1.5)
    plan[pl.RIGHT_RAD] = -first * between(draws[2], 0.6, 1.5)
    plan[pl.LEFT_S] = TURN_S + between(draws[3], 0.3, 1.2)
    plan[pl.RIGHT_S] = plan[pl.LEFT_S] + TURN_S + between(draws[4], 0.3, 1.2)
    return plan[pl.RIGHT_S] + TURN_S + 0.05
