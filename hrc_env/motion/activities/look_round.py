"""Looking round: the head to one side and the other, the trunk a little with it."""

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.planning import between, blank
from hrc_env.motion.curves import min_jerk
from hrc_env.motion.posture import stand
from hrc_env.motion.state import Place, Worker

TURN_S = 0.75
"""To turn the head across [s]; about 1.5 rad/s."""


@kernel
def look_round(t: float, clock_s: float, me: Worker) -> None:
    """The control vector of someone who looks about."""
    q = me.q
    stand(me.start_x, me.start_y, me.start_yaw, clock_s, me)
    there, across = min_jerk(t / TURN_S), min_jerk((t - me.left_s) / TURN_S)
    back = min_jerk((t - me.right_s) / TURN_S)
    gaze = me.left_rad * (there - across) + me.right_rad * (across - back)
    q[c.HEAD_YAW] += 0.62 * gaze
    q[c.SPINE_TWIST] += 0.26 * gaze
    q[c.PELVIS_YAW] += 0.12 * gaze


@kernel
def start_look_round(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to look round; returns how long it takes [s]."""
    blank(me)
    first = 1.0 if draws[0] < 0.5 else -1.0
    me.left_rad = first * between(draws[1], 0.6, 1.5)
    me.right_rad = -first * between(draws[2], 0.6, 1.5)
    me.left_s = TURN_S + between(draws[3], 0.3, 1.2)
    me.right_s = me.left_s + TURN_S + between(draws[4], 0.3, 1.2)
    return me.right_s + TURN_S + 0.05
