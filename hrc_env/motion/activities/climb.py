"""Climbing a step or a low ladder and coming down backwards; looking round where one stands."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.planning import between, blank
from hrc_env.motion.curves import cruise, min_jerk, shift
from hrc_env.motion.feet import step_time
from hrc_env.motion.posture import RELAXED_ELBOW, RELAXED_PITCH, hang
from hrc_env.motion.state import Worker

HIGHEST_RISER_M = 0.32
"""Greatest rise of one step [m]; ladders have rungs 0.25 to 0.30 m apart (EN 131-1)."""
FIRST_M, TREAD_M = 0.40, 0.24
"""Where a foot goes on the first tread, and from tread to tread [m]."""
STEP_AT_S, PERIOD_S, SWING_S, TURN_S = 0.12, 0.72, 0.56, 0.75
"""First lift-off, period and swing of a climber's steps; to turn the head across [s]; judgement."""


@kernel
def climb(t: float, me: Worker) -> None:
    """Let a standing q climb, stay, and come down as it went up."""
    q = me.q
    up_s, treads = me.up_s, me.treads
    when = step_time(t, me)
    along = cruise((when - 0.25) / (up_s - 0.25), 0.4)
    risen = cruise((when - 0.50) / (up_s - 0.55), 0.4)
    shift(q, c.ROOT_X, me.start_yaw, (FIRST_M + TREAD_M * (treads - 1.0)) * along, 0.0)
    q[c.PELVIS_Z] += treads * me.riser_m * risen
    going = min_jerk(when / 0.5) - min_jerk((when - up_s + 0.3) / 0.6)
    q[c.SPINE_FLEX] += 0.14 * going
    q[c.PELVIS_PITCH] += 0.10 * going
    q[c.HEAD_PITCH] += 0.20 * going
    for side in range(2):
        hang(side, RELAXED_PITCH - 0.05 * going, RELAXED_ELBOW + 0.25 * going, me)


@kernel
def start_climb(draws: Floats, height: float, me: Worker) -> float:
    """Plan to climb to the height; returns how long it takes [s]."""
    blank(me)
    prints = me.prints
    high = height if height > 0.0 else between(draws[0], 0.18, 0.30)
    treads = max(1, math.ceil(high / HIGHEST_RISER_M))
    me.treads, me.riser_m = treads, high / treads
    first = 1 if draws[1] < 0.5 else 0
    me.step_start, me.step_period, me.step_swing = STEP_AT_S, PERIOD_S, SWING_S
    me.step_first, me.step_count = first, treads + 1
    for k in range(treads + 1):
        side, tread = (k + first) % 2, min(k + 1, treads)
        for i in range(3):
            prints[k, i] = me.stance[side, i]
        shift(prints[k], 0, me.start_yaw, FIRST_M + TREAD_M * (tread - 1.0), 0.0)
        prints[k, 3], prints[k, 4] = 0.25, tread * me.riser_m
    me.up_s = STEP_AT_S + treads * PERIOD_S + SWING_S + 0.1
    me.undo_at = me.up_s + 0.5 * between(draws[2], 0.5, 4.0)
    return 2.0 * me.undo_at


@kernel
def look_round(t: float, me: Worker) -> None:
    """Let a standing q look about."""
    q = me.q
    there, across = min_jerk(t / TURN_S), min_jerk((t - me.left_s) / TURN_S)
    back = min_jerk((t - me.right_s) / TURN_S)
    gaze = me.left_rad * (there - across) + me.right_rad * (across - back)
    q[c.HEAD_YAW] += 0.62 * gaze
    q[c.SPINE_TWIST] += 0.26 * gaze
    q[c.PELVIS_YAW] += 0.12 * gaze


@kernel
def start_look_round(draws: Floats, height: float, me: Worker) -> float:
    """Plan to look round; returns how long it takes [s]."""
    blank(me)
    first = 1.0 if draws[0] < 0.5 else -1.0
    me.left_rad = first * between(draws[1], 0.6, 1.5)
    me.right_rad = -first * between(draws[2], 0.6, 1.5)
    me.left_s = TURN_S + between(draws[3], 0.3, 1.2)
    me.right_s = me.left_s + TURN_S + between(draws[4], 0.3, 1.2)
    return me.right_s + TURN_S + 0.05
