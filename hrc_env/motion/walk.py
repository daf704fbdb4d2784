"""Walking: along a path, at a speed that rises and falls, footsteps laid along it.

Cadence and step length follow 68 walking trials of the CMU motion-capture database at
0.8 to 2 m/s: cadence = 96.2 v^0.468 steps/min, step length = 0.345 + 0.286 v m.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.anatomy import ANKLE_X, LEG, STAND_Z
from hrc_env.motion.curves import hump, min_jerk, ramp, wrap
from hrc_env.motion.feet import FLAT_S
from hrc_env.motion.holding import hold_load
from hrc_env.motion.paths import along, facing, lay_path
from hrc_env.motion.posture import (
    RELAXED_ELBOW,
    RELAXED_PITCH,
    STANCE_HALF_WIDTH_M,
    TOE_OUT_RAD,
    hang,
    stand,
)

CADENCE_PER_MIN, CADENCE_POWER, SLOWEST_M_S = 96.2, 0.468, 0.65
"""Fit above; slower starts and turns keep the cadence of the slowest speed [m/s]."""
LEG_M = 0.8685772217237624
"""Leg of a worker who walks just so; others step more or less often by the square root of their
legs' ratio, as pendulums would (dynamic similarity, Alexander 1989)."""
SWING_SHARE, SWING_FAST_SHARE, FASTEST_M_S = 0.80, 0.02, 1.8
"""Time in the air in periods of a step: stance is 60 % of the gait cycle; up to so much more from
1 m/s to FASTEST_M_S, for stance gets shorter (59 % at 1.8 m/s)."""
MID_STANCE = 0.46
"""When the root passes over a footprint, in periods of a step after its landing."""
WALK_HALF_WIDTH_M = 0.04
"""Half the step width at full speed [m]; 5 to 9 cm measured."""
SHIFT_S, TURN_S, TURN_RATE = 0.28, 0.5, 1.7
"""Weight shift before the first step [s]; duration of a turn: TURN_S + angle / TURN_RATE."""
SIDE_STEP_M_S, SIDE_STEP_PERIOD_S, SIDE_STEP_M = 0.2, 0.52, 0.5
"""Going nowhere far (nearer than SIDE_STEP_M), people do not turn: they take small steps, slow
enough that the feet never cross; judgement."""
CORNER_M_S2 = 1.6
"""Walkers slow down so that corners accelerate them sideways by no more [m/s^2]; judgement."""
NORMAL_M_S = 1.3
"""Speed at which the amplitudes below hold."""
BOB_M, BOB_PACE_M = 0.0095, 0.0035
"""Half the pelvis's rise and fall: of any walk, and more with the pace [m]; 2 to 4 cm measured."""
BENT_M, BENT_FAST_M = 0.026, 0.10
"""How much lower than standing people walk [m]: with the pace, and with the square of how much
faster they go than suits their legs, or these would lift them at mid-stance; judgement."""
SWING_SLOW_RAD, SWING_FAST_RAD, FULL_SWING, ELBOW_SWING = 0.05, 0.104, 1.1, 0.73
"""Swing of the upper arm to each side [rad]: at any pace, and more with the cube of the pace (up to
FULL_SWING); the elbow's share of it. Wrists so go as fast as those measured at 1.1 to 1.4 m/s."""
LOADED_TWIST = 0.4
"""Share of the trunk's turning that is left with something in the hands; judgement."""
LURCH_S = 1.4
"""From a foot's catching to the walk's going on [s]; judgement."""


@kernel
def travelled(t: float, plan: Floats) -> float:
    """Metres along the path at time t."""
    u, rise = t - plan[pl.DEPART], plan[pl.RAMP]
    slow = plan[pl.DURATION] - rise
    return plan[pl.SPEED] * rise * (ramp(u / rise) - ramp((u - slow) / rise))


@kernel
def speed(t: float, plan: Floats) -> float:
    """Rate of `travelled` [m/s]."""
    u, rise = t - plan[pl.DEPART], plan[pl.RAMP]
    slow = plan[pl.DURATION] - rise
    a, b = min(max(u / rise, 0.0), 1.0), min(max((u - slow) / rise, 0.0), 1.0)
    return plan[pl.SPEED] * (a * a * (3.0 - 2.0 * a) - b * b * (3.0 - 2.0 * b))


@kernel
def root(t: float, plan: Floats) -> tuple[float, float, float]:
    """Where the walker's middle is at time t, and their heading (continuous, not wrapped)."""
    s = travelled(t, plan)
    x, y = along(s, plan)
    turning = min_jerk(t / plan[pl.TURN_IN_S])
    yaw = plan[pl.START_YAW] - plan[pl.TURN_IN] * turning
    if plan[pl.FOLLOW] > 0.0:
        yaw += facing(min(s, plan[pl.LENGTH]), plan) - facing(0.0, plan)
    turned = min_jerk((t - plan[pl.TURN_OUT_AT]) / plan[pl.TURN_OUT_S])
    return x, y, yaw + plan[pl.TURN_OUT] * turned


@kernel
def walk(t: float, plan: Floats, clock_s: float, traits: Floats, size: Floats, q: Floats) -> None:
    """The control vector of a walker but for the feet."""
    x, y, yaw = root(t, plan)
    stand(x, y, yaw, clock_s, traits, size, q)
    period, last = plan[pl.STEP_PERIOD], plan[pl.STEP_COUNT] - 1.0
    phase = (t - plan[pl.STEP_START]) / period
    lead = 1.0 - 2.0 * plan[pl.STEP_FIRST]
    aloft = plan[pl.STEP_SWING] / period
    going = min_jerk((phase + 0.4) / 0.8) - min_jerk((phase - last) / 0.9)
    pace = speed(t, plan) / NORMAL_M_S
    over = -lead * math.cos(math.pi * (phase - 0.5 * aloft)) * going
    left_ahead = lead * math.cos(math.pi * (phase - aloft)) * pace
    both_down = math.cos(2.0 * math.pi * (phase - 0.5 * (1.0 + aloft)))
    shift = (0.028 - 0.008 * min(pace, 1.0)) * over
    q[c.ROOT_X] -= math.sin(yaw) * shift
    q[c.ROOT_Y] += math.cos(yaw) * shift
    bob = BOB_M * going + BOB_PACE_M * pace
    hurry = max(pace * math.sqrt(LEG_M / size[LEG]) - 1.0, 0.0)
    q[c.PELVIS_Z] -= 0.006 * going + BENT_M * pace + BENT_FAST_M * hurry * hurry
    q[c.PELVIS_Z] -= bob * both_down
    q[c.PELVIS_PITCH] += 0.03 * pace
    q[c.PELVIS_ROLL] += 0.04 * over
    q[c.PELVIS_YAW] -= 0.075 * left_ahead
    q[c.SPINE_FLEX] += 0.03 * pace
    q[c.SPINE_SIDE] -= 0.05 * over
    q[c.SPINE_TWIST] += 0.19 * left_ahead
    _, _, ahead = root(t + 0.5, plan)
    q[c.HEAD_YAW] += 0.8 * min(max(ahead - yaw, -0.8), 0.8) - 0.5 * 0.115 * left_ahead
    for side in range(2):
        swing = -(1.0 - 2.0 * side) * left_ahead
        swing *= SWING_SLOW_RAD + SWING_FAST_RAD * min(pace, FULL_SWING) ** 3
        upper, elbow = RELAXED_PITCH - 0.06 * pace, RELAXED_ELBOW + 0.10 * pace
        hang(side, upper + swing, elbow + ELBOW_SWING * swing, size, q)
    if plan[pl.TRIP] > 0.0:
        _lurch(t - plan[pl.TRIP_AT], plan[pl.TRIP], size, q)
    if plan[pl.LOAD_PROP] > 0.0:
        q[c.SPINE_TWIST] *= LOADED_TWIST
        x, y, yaw = root(t, plan)
        hold_load(x, y, yaw, q[c.PELVIS_Z] - size[STAND_Z], plan, q)


@kernel
def _lurch(t: float, trip: float, size: Floats, q: Floats) -> None:
    """Pitch forward with the arms out, `t` after a foot caught, and come up again.

    Lower as well as forward, or the leg behind would come to its full stretch and jerk the body.
    """
    scale = size[LEG] / LEG_M
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
def plan_walk(
    start: tuple[float, float, float], via: Floats, end: tuple[float, float, float],
    wished_m_s: float, plan: Floats, prints: Floats, stance: Floats, size: Floats,
) -> float:  # fmt: skip
    """Plan to go from (x, y, yaw) to (x, y, yaw) past corners `via` (n, 3: `lay_path`).

    Returns the duration [s].
    """
    plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW] = start
    plan[pl.END_X], plan[pl.END_Y] = end[0], end[1]
    lay_path((start[0], start[1]), via, (end[0], end[1]), plan)
    if plan[pl.LENGTH] <= SIDE_STEP_M:
        pace = (0.0, SIDE_STEP_M_S, SIDE_STEP_PERIOD_S)
        return plan_pace(pace, end[2], plan, prints, stance, size)
    bend = math.sqrt(CORNER_M_S2 / max(plan[pl.SHARPEST], 1e-6))
    wished = min(wished_m_s, max(bend, SLOWEST_M_S))
    return plan_pace((1.0, wished, 0.0), end[2], plan, prints, stance, size)


@kernel
def plan_pace(
    pace: tuple[float, float, float], end_yaw: float,
    plan: Floats, prints: Floats, stance: Floats, size: Floats,
) -> float:  # fmt: skip
    """Plan speed, turns and steps along the path that is laid; returns the duration [s].

    Args:
        pace: whether to face along the path (1) or keep the heading (0); top speed [m/s]; time
            of a step [s], 0: that of people at this speed.
        end_yaw: heading at the end [rad].
        plan: START, END and the path stand.
        prints: gets the footprints.
        stance: where the feet are.
        size: of the body.
    """
    follow, wished, period = pace
    length = plan[pl.LENGTH]
    plan[pl.FOLLOW] = follow
    plan[pl.UNDO_AT] = plan[pl.TRIP] = plan[pl.TAKEN_S] = 0.0
    plan[pl.RAMP] = 0.45 + 0.4 * wished
    plan[pl.SPEED] = min(wished, length / plan[pl.RAMP])
    plan[pl.DURATION] = length / plan[pl.SPEED] + plan[pl.RAMP]
    _plan_turns(end_yaw, plan)
    if period == 0.0:
        period = 60.0 / (CADENCE_PER_MIN * max(plan[pl.SPEED], SLOWEST_M_S) ** CADENCE_POWER)
        period *= math.sqrt(size[LEG] / LEG_M)
    fast = min(max((plan[pl.SPEED] - 1.0) / (FASTEST_M_S - 1.0), 0.0), 1.0)
    plan[pl.STEP_PERIOD] = period
    plan[pl.STEP_SWING] = (SWING_SHARE + SWING_FAST_SHARE * fast) * period
    plan[pl.STEP_START] = SHIFT_S
    plan[pl.STEP_FIRST] = _first_foot(plan)
    return _plan_steps(0, plan, prints, stance, size)


@kernel
def brake(t: float, plan: Floats, prints: Floats, stance: Floats, size: Floats) -> float:
    """Come to a stand on the path as soon as a walker can from time t; the new duration [s].

    What has happened until t stays as it was, and so do the landings of feet in the air.
    Returns -1 for one who is about to arrive, and goes on.
    """
    t -= plan[pl.TAKEN_S]
    going = max(t - plan[pl.DEPART], plan[pl.RAMP])
    if plan[pl.FOLLOW] == 0.0 or going + plan[pl.RAMP] >= plan[pl.DURATION]:
        return -1.0
    plan[pl.DURATION] = going + plan[pl.RAMP]
    plan[pl.TURN_OUT], plan[pl.TURN_OUT_S] = 0.0, 1.0
    plan[pl.TURN_OUT_AT] = plan[pl.DEPART] + plan[pl.DURATION] - 1.0
    plan[pl.END_X], plan[pl.END_Y], plan[pl.END_YAW] = root(
        plan[pl.DEPART] + plan[pl.DURATION] + 1.0, plan
    )
    lifted = math.floor((t - plan[pl.STEP_START]) / plan[pl.STEP_PERIOD]) + 1
    lasts = _plan_steps(max(int(lifted), 0), plan, prints, stance, size)
    plan[pl.LASTS] = lasts + 2.0 * plan[pl.TAKEN_S]
    return plan[pl.LASTS]


@kernel
def _plan_turns(end_yaw: float, plan: Floats) -> None:
    """Turn into the path and out of it; who must turn far sets off when the turn is nearly done."""
    first, final = facing(0.0, plan), facing(plan[pl.LENGTH], plan)
    start_yaw = plan[pl.START_YAW]
    turn = wrap(start_yaw - first) if plan[pl.FOLLOW] > 0.0 else 0.0
    plan[pl.TURN_IN], plan[pl.TURN_IN_S] = turn, TURN_S + abs(turn) / TURN_RATE
    plan[pl.DEPART] = SHIFT_S + 0.10 + max(0.0, plan[pl.TURN_IN_S] - TURN_S - 0.45)
    arrival = plan[pl.DEPART] + plan[pl.DURATION]
    heading = start_yaw - turn
    heading += final - first if plan[pl.FOLLOW] > 0.0 else 0.0
    turn = wrap(end_yaw - heading)
    plan[pl.TURN_OUT], plan[pl.TURN_OUT_S] = turn, TURN_S + abs(turn) / TURN_RATE
    plan[pl.TURN_OUT_AT] = max(arrival - 0.7, SHIFT_S) if plan[pl.FOLLOW] > 0.0 else SHIFT_S
    plan[pl.END_YAW] = heading + turn


@kernel
def _plan_steps(first: int, plan: Floats, prints: Floats, stance: Floats, size: Floats) -> float:
    """Lay footprints from a step on where the root will pass at mid-stance; when all is over [s].

    The last two stand at the end. Steps before the first are taken already.
    """
    period, start = plan[pl.STEP_PERIOD], plan[pl.STEP_START]
    done = max(plan[pl.DEPART] + plan[pl.DURATION], plan[pl.TURN_OUT_AT] + plan[pl.TURN_OUT_S])
    over = start + plan[pl.STEP_SWING] + MID_STANCE * period
    count = min(max(2 + math.ceil((done - 0.12 - over) / period), first + 2), pl.MAX_STEPS)
    plan[pl.STEP_COUNT] = count
    for k in range(first, count):
        side = (k + int(plan[pl.STEP_FIRST])) % 2
        when = over + k * period if k < count - 2 else done + 1.0
        x, y, yaw = root(when, plan)
        narrow = min(speed(when, plan) / 0.8, 1.0) * plan[pl.FOLLOW]
        half = STANCE_HALF_WIDTH_M + (WALK_HALF_WIDTH_M - STANCE_HALF_WIDTH_M) * narrow
        footprint(side, x, y, yaw, half, size, prints[k])
        x, y = stance[side, 0], stance[side, 1]
        if k >= 2:
            x, y = prints[k - 2, 0], prints[k - 2, 1]
        prints[k, 3] = min(math.hypot(prints[k, 0] - x, prints[k, 1] - y) / NORMAL_M_S, 1.1)
    return start + (count - 1) * period + plan[pl.STEP_SWING] + FLAT_S


@kernel
def _first_foot(plan: Floats) -> float:
    """Begin with the foot on the side that the walker turns or steps to."""
    x, y, yaw = root(plan[pl.DEPART] + plan[pl.DURATION], plan)
    dx, dy = x - plan[pl.START_X], y - plan[pl.START_Y]
    side = -dx * math.sin(plan[pl.START_YAW]) + dy * math.cos(plan[pl.START_YAW])
    turn = -plan[pl.TURN_IN] if plan[pl.FOLLOW] > 0.0 else side + 0.1 * (yaw - plan[pl.START_YAW])
    return 0.0 if turn >= 0.0 else 1.0


@kernel
def footprint(
    side: int, x: float, y: float, yaw: float, half_width: float, size: Floats, out: Floats
) -> None:
    """x, y, heading of a foot of someone whose middle is over (x, y)."""
    sign = 1.0 - 2.0 * side
    cos, sin = math.cos(yaw), math.sin(yaw)
    ahead, left = size[ANKLE_X], sign * half_width
    out[0] = x + cos * ahead - sin * left
    out[1] = y + sin * ahead + cos * left
    out[2] = yaw + sign * TOE_OUT_RAD
    out[4] = 0.0
