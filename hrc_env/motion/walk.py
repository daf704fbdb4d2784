"""Walking: along a path, at a speed that rises and falls, footsteps laid along it.

Cadence and step length follow 68 walking trials of the CMU motion-capture database at
0.8 to 2 m/s: cadence = 96.2 v^0.468 steps/min, step length = 0.345 + 0.286 v m.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ANKLE_X, LEG, STAND_Z
from hrc_env.motion.curves import hump, min_jerk, placed, ramp, shift, wrap
from hrc_env.motion.feet import FLAT_S
from hrc_env.motion.holding import hold_load
from hrc_env.motion.paths import along, facing
from hrc_env.motion.posture import (
    RELAXED_ELBOW,
    RELAXED_PITCH,
    STANCE_HALF_WIDTH_M,
    TOE_OUT_RAD,
    hang,
    stand,
)
from hrc_env.motion.state import MAX_STEPS, Triple, Worker

CADENCE_PER_MIN, CADENCE_POWER, SLOWEST_M_S = 96.2, 0.468, 0.65
"""Fit above; slower starts and turns keep the cadence of the slowest speed [m/s]."""
LEG_M = 0.8685772217237624
"""Leg of a worker who walks just so; others step by the square root of their legs' ratio."""
SWING_SHARE, SWING_FAST_SHARE, FASTEST_M_S, MID_STANCE = 0.80, 0.02, 1.8, 0.46
"""Time in the air in periods of a step, up to so much more from 1 m/s to FASTEST_M_S; when the
root passes over a footprint, in periods after its landing."""
EARLIER = 0.31
"""Runners pass over a footprint so many periods earlier than walkers, for it is left earlier."""
RUN_WIDER_M = 0.015
"""Runners' heels pass the other shank higher up than walkers' [m]; judgement."""
WALK_HALF_WIDTH_M = 0.04
"""Half the step width at full speed [m]; 5 to 9 cm measured."""
SHIFT_S, TURN_S, TURN_RATE = 0.28, 0.5, 1.7
"""Weight shift before the first step [s]; duration of a turn: TURN_S + angle / TURN_RATE."""
SIDE_STEP_M, SIDE_STEP_PACE = 0.5, (0.0, 0.2, 0.52)
"""Nearer than this people do not turn, but take small steps; their `plan_pace`; judgement."""
CORNER_M_S2 = 1.6
"""Walkers slow down so that corners accelerate them sideways by no more [m/s^2]; judgement."""
NORMAL_M_S = 1.3
"""Speed at which the amplitudes below hold."""
BOB_M, BOB_PACE_M = 0.0095, 0.0035
"""Half the pelvis's rise and fall: of any walk, and more with the pace [m]; 2 to 4 cm measured."""
BENT_M, BENT_FAST_M = 0.026, 0.10
"""Lower than standing [m]: with the pace, with the square of the hurry; judgement."""
SWING_SLOW_RAD, SWING_FAST_RAD, FULL_SWING, ELBOW_SWING = 0.05, 0.104, 1.1, 0.73
"""Swing of the upper arm to each side [rad]: at any pace, with its cube; the elbow's share."""
LOADED_TWIST, LURCH_S = 0.4, 1.4
"""The trunk's share of turning that a load leaves; time that a stumble takes [s]; judgement."""


@kernel
def travelled(t: float, me: Worker) -> float:
    """Metres along the path at time t."""
    u, rise = t - me.depart, me.ramp
    slow = me.travel_s - rise
    return me.top_m_s * rise * (ramp(u / rise) - ramp((u - slow) / rise))


@kernel
def speed(t: float, me: Worker) -> float:
    """Rate of `travelled` [m/s]."""
    u, rise = t - me.depart, me.ramp
    slow = me.travel_s - rise
    a, b = min(max(u / rise, 0.0), 1.0), min(max((u - slow) / rise, 0.0), 1.0)
    return me.top_m_s * (a * a * (3.0 - 2.0 * a) - b * b * (3.0 - 2.0 * b))


@kernel
def root(t: float, me: Worker) -> Triple:
    """Where the walker's middle is at time t, and their heading (continuous, not wrapped)."""
    s = travelled(t, me)
    x, y = along(s, me)
    turning = min_jerk(t / me.turn_in_s)
    yaw = me.start_yaw - me.turn_in * turning
    if me.follow > 0.0:
        yaw += facing(min(s, me.length), me) - facing(0.0, me)
    turned = min_jerk((t - me.turn_out_at) / me.turn_out_s)
    return x, y, yaw + me.turn_out * turned


@kernel
def walk(t: float, clock_s: float, me: Worker) -> None:
    """The control vector of a walker but for the feet."""
    q = me.q
    x, y, yaw = root(t, me)
    stand(x, y, yaw, clock_s, me)
    period, last = me.step_period, me.step_count - 1.0
    phase = (t - me.step_start) / period
    lead = 1.0 - 2.0 * me.step_first
    aloft = me.step_swing / period
    going = min_jerk((phase + 0.4) / 0.8) - min_jerk((phase - last) / 0.9)
    pace = speed(t, me) / NORMAL_M_S
    over = -lead * math.cos(math.pi * (phase - 0.5 * aloft)) * going
    left_ahead = lead * math.cos(math.pi * (phase - aloft)) * pace
    both_down = math.cos(2.0 * math.pi * (phase - 0.5 * (1.0 + aloft)))
    shift(q, c.ROOT_X, yaw, 0.0, (0.028 - 0.008 * min(pace, 1.0)) * over)
    bob = BOB_M * going + BOB_PACE_M * pace
    hurry = max(pace * math.sqrt(LEG_M / me.size[LEG]) - 1.0, 0.0)
    q[c.PELVIS_Z] -= 0.006 * going + BENT_M * pace + BENT_FAST_M * hurry * hurry
    q[c.PELVIS_Z] -= bob * both_down
    q[c.PELVIS_PITCH] += 0.03 * pace
    q[c.PELVIS_ROLL] += 0.04 * over
    q[c.PELVIS_YAW] -= 0.075 * left_ahead
    q[c.SPINE_FLEX] += 0.03 * pace
    q[c.SPINE_SIDE] -= 0.05 * over
    q[c.SPINE_TWIST] += 0.19 * left_ahead
    _, _, ahead = root(t + 0.5, me)
    q[c.HEAD_YAW] += 0.8 * min(max(ahead - yaw, -0.8), 0.8) - 0.5 * 0.115 * left_ahead
    for side in range(2):
        swing = -(1.0 - 2.0 * side) * left_ahead
        swing *= SWING_SLOW_RAD + SWING_FAST_RAD * min(pace, FULL_SWING) ** 3
        upper, elbow = RELAXED_PITCH - 0.06 * pace, RELAXED_ELBOW + 0.10 * pace
        hang(side, upper + swing, elbow + ELBOW_SWING * swing, me)
    if me.trip > 0.0:
        _lurch(t - me.trip_at, me.trip, me)
    if me.load_prop > 0.0:
        q[c.SPINE_TWIST] *= LOADED_TWIST
        hold_load(x, y, yaw, q[c.PELVIS_Z] - me.size[STAND_Z], me)


@kernel
def _lurch(t: float, trip: float, me: Worker) -> None:
    """Pitch forward and down with the arms out, `t` after a foot caught, and come up again."""
    q = me.q
    scale = me.size[LEG] / LEG_M
    fall, arms = trip * hump(t / LURCH_S), trip * scale * hump((t - 0.04) / (1.6 * LURCH_S))
    q[c.ROOT_X] += math.cos(q[c.HEADING]) * 0.08 * scale * fall
    q[c.ROOT_Y] += math.sin(q[c.HEADING]) * 0.08 * scale * fall
    q[c.PELVIS_Z] -= 0.09 * fall
    q[c.PELVIS_PITCH] += 0.32 * fall
    q[c.SPINE_FLEX] += 0.38 * fall
    q[c.HEAD_PITCH] -= 0.15 * fall
    for side in range(2):
        at = c.HAND_OFFSET + 3 * side
        q[at] += (0.34 - 0.10 * side) * arms
        q[at + 1] += (1.0 - 2.0 * side) * 0.12 * arms
        q[at + 2] += (0.22 + 0.08 * side) * arms


@kernel
def plan_walk(end_yaw: float, wished_m_s: float, me: Worker) -> float:
    """Plan to go along the path that is laid; returns the duration [s]."""
    if me.length <= SIDE_STEP_M:
        return plan_pace(SIDE_STEP_PACE, end_yaw, me)
    bend = math.sqrt(CORNER_M_S2 / max(me.sharpest, 1e-6))
    wished = min(wished_m_s, max(bend, SLOWEST_M_S))
    return plan_pace((1.0, wished, 0.0), end_yaw, me)


@kernel
def plan_pace(pace: Triple, end_yaw: float, me: Worker) -> float:
    """Plan speed, turns and steps along the path that is laid; returns the duration [s].

    `pace`: whether to face along the path (1) or keep the heading (0); top speed [m/s]; time of a
    step [s], 0: that of people at this speed.
    """
    me.follow, wished, period = pace
    me.flight_s = 0.0
    plan_way(wished, 0.45 + 0.4 * wished, end_yaw, me)
    if period == 0.0:
        period = 60.0 / (CADENCE_PER_MIN * max(me.top_m_s, SLOWEST_M_S) ** CADENCE_POWER)
        period *= math.sqrt(me.size[LEG] / LEG_M)
    fast = min(max((me.top_m_s - 1.0) / (FASTEST_M_S - 1.0), 0.0), 1.0)
    me.step_period = period
    me.step_swing = (SWING_SHARE + SWING_FAST_SHARE * fast) * period
    return plan_steps(0, me)


@kernel
def plan_way(wished_m_s: float, ramp_s: float, end_yaw: float, me: Worker) -> None:
    """Plan how fast to go along the path that is laid, the turns at its ends, the first foot."""
    me.undo_at = me.trip = me.taken_s = 0.0
    me.ramp = ramp_s
    me.top_m_s = min(wished_m_s, me.length / me.ramp)
    me.travel_s = me.length / me.top_m_s + me.ramp
    _plan_turns(end_yaw, me)
    me.step_start = SHIFT_S
    me.step_first = _first_foot(me)


@kernel
def brake(t: float, me: Worker) -> float:
    """Come to a stand on the path as soon as a walker can from time t; the new duration [s], -1:
    about to arrive, and goes on. Landings of feet in the air stay as they were."""
    t -= me.taken_s
    going = max(t - me.depart, me.ramp)
    if me.follow == 0.0 or going + me.ramp >= me.travel_s:
        return -1.0
    me.travel_s = going + me.ramp
    me.turn_out, me.turn_out_s = 0.0, 1.0
    me.turn_out_at = me.depart + me.travel_s - 1.0
    me.end_x, me.end_y, me.end_yaw = root(me.depart + me.travel_s + 1.0, me)
    lifted = math.floor((t - me.step_start) / me.step_period) + 1
    lasts = plan_steps(max(int(lifted), 0), me)
    me.lasts = lasts + 2.0 * me.taken_s
    return me.lasts


@kernel
def _plan_turns(end_yaw: float, me: Worker) -> None:
    """Turn into the path and out of it; who must turn far sets off when the turn is nearly done."""
    first, final = facing(0.0, me), facing(me.length, me)
    start_yaw = me.start_yaw
    turn = wrap(start_yaw - first) if me.follow > 0.0 else 0.0
    me.turn_in, me.turn_in_s = turn, TURN_S + abs(turn) / TURN_RATE
    me.depart = SHIFT_S + 0.10 + max(0.0, me.turn_in_s - TURN_S - 0.45)
    arrival = me.depart + me.travel_s
    heading = start_yaw - turn
    heading += final - first if me.follow > 0.0 else 0.0
    turn = wrap(end_yaw - heading)
    me.turn_out, me.turn_out_s = turn, TURN_S + abs(turn) / TURN_RATE
    me.turn_out_at = max(arrival - 0.7, SHIFT_S) if me.follow > 0.0 else SHIFT_S
    me.end_yaw = heading + turn


@kernel
def plan_steps(first: int, me: Worker) -> float:
    """Lay footprints from a step on where the root passes at mid-stance; when all is over [s]."""
    period, start = me.step_period, me.step_start
    done = max(me.depart + me.travel_s, me.turn_out_at + me.turn_out_s)
    over = start + me.step_swing + MID_STANCE * period
    count = min(max(2 + math.ceil((done - 0.12 - over) / period), first + 2), MAX_STEPS)
    me.step_count = count
    for k in range(first, count):
        side = (k + me.step_first) % 2
        when, share = over + k * period if k < count - 2 else done + 1.0, 0.0
        if me.flight_s > 0.0:
            share = min(speed(start + k * period, me) / me.top_m_s, 1.0)
            when += (me.flight_s - EARLIER * period) * share
        x, y, yaw = root(when, me)
        narrow = min(speed(when, me) / 0.8, 1.0) * me.follow
        half = STANCE_HALF_WIDTH_M + (WALK_HALF_WIDTH_M - STANCE_HALF_WIDTH_M) * narrow
        half += RUN_WIDER_M * share
        footprint(side, x, y, yaw, half, me.prints[k], me)
        x, y = me.stance[side, 0], me.stance[side, 1]
        if k >= 2:
            x, y = me.prints[k - 2, 0], me.prints[k - 2, 1]
        stride = math.hypot(me.prints[k, 0] - x, me.prints[k, 1] - y)
        me.prints[k, 3] = share if me.flight_s > 0.0 else min(stride / NORMAL_M_S, 1.1)
    return start + (count - 1) * period + me.step_swing + FLAT_S


@kernel
def _first_foot(me: Worker) -> float:
    """Begin with the foot on the side that the walker turns or steps to."""
    x, y, yaw = root(me.depart + me.travel_s, me)
    dx, dy = x - me.start_x, y - me.start_y
    side = -dx * math.sin(me.start_yaw) + dy * math.cos(me.start_yaw)
    turn = -me.turn_in if me.follow > 0.0 else side + 0.1 * (yaw - me.start_yaw)
    return 0.0 if turn >= 0.0 else 1.0


@kernel
def footprint(
    side: int, x: float, y: float, yaw: float, half_width: float, out: Floats, me: Worker
) -> None:
    """x, y, heading of a foot of someone whose middle is over (x, y)."""
    sign = 1.0 - 2.0 * side
    out[0], out[1] = placed(x, y, yaw, me.size[ANKLE_X], sign * half_width)
    out[2] = yaw + sign * TOE_OUT_RAD
    out[4] = 0.0
