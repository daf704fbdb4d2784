"""Starting an activity by its number, whatever start functions it has (`activities`)."""

import math
from collections.abc import Callable

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import state as st
from hrc_env.motion.activities import loads
from hrc_env.motion.activities import work_plans as wp
from hrc_env.motion.activities.climb import start_climb, start_look_round
from hrc_env.motion.activities.going import start_push, start_step_back, start_stumble
from hrc_env.motion.activities.planning import between, blank, dominant, finish
from hrc_env.motion.config import Numbers
from hrc_env.motion.curves import wrap
from hrc_env.motion.decision import Decision
from hrc_env.motion.feet import feet
from hrc_env.motion.hands import plan_lift, plan_reach
from hrc_env.motion.posture import from_here
from hrc_env.motion.state import Pair, Triple, Worker
from hrc_env.motion.walk import plan_walk
from hrc_env.worker.props import PROP_NAMES

TAKE_M, TAKE_S = 0.52, 0.8
"""Hands are put out so far ahead for what is brought [m]; they hold it there for so long [s]."""
BODY_M, OWN_SIDE_M = 0.36, 0.30
"""Hands keep so far from their own root, and from the middle to another worker [m]."""


def start_going(
    activity: int, draws: Floats, end_yaw: float, pace_m_s: float, prop: int, me: Worker
) -> float:
    """Start to walk, carry, push or stumble along the path that is laid; how long [s]."""
    if activity == st.PUSH:
        return start_push(end_yaw, pace_m_s, prop, me)
    if activity == st.STUMBLE:
        return start_stumble(draws, end_yaw, pace_m_s, me)
    return plan_walk(end_yaw, pace_m_s, me)


@kernel
def start_take(draws: Floats, height: float, me: Worker) -> float:
    """Put out a hand at the height for what somebody brings, and hold it there."""
    blank(me)
    me.side = dominant(draws[0], me)
    used = (0.0, 1.0) if me.side == 1 else (1.0, 0.0)
    at = from_here((TAKE_M, (1.0 - 2.0 * me.side) * 0.10, height), me)
    me.out_at = 0.1 + 0.3 * draws[1]
    lasts = plan_reach(at, used, 1.1, TAKE_S, (0.0, 1.0), me)
    for i in range(3):
        me.tool_pose[i] = me.target[3 * me.side + i]
    return lasts


Start = Callable[[Floats, float, Worker], float]
"""Begins an activity from N_START draws in [0, 1) at a height [m]; how long it lasts [s]."""


def _work(plan: Start) -> Start:
    return lambda draws, height, me: finish(plan(draws, height, me), me)


def _load(plan: Start) -> Start:
    return lambda draws, height, me: loads.finish_lift(plan(draws, height, me), me)


STARTS: dict[int, Start] = {
    st.LOOK_ROUND: start_look_round, st.CLIMB: start_climb, st.STEP_BACK: start_step_back,
    st.SET_DOWN: _load(loads.plan_set_down), st.HAND_OVER: _load(loads.plan_hand_over),
    st.RECEIVE: _load(loads.plan_receive), st.HAMMER: _work(wp.plan_hammer),
    st.DRILL: _work(wp.plan_drill), st.OVERHEAD: _work(wp.plan_drill), st.SAW: _work(wp.plan_saw),
    st.MEASURE: _work(wp.plan_measure), st.POINT: _work(wp.plan_point),
    st.SQUATTING: _work(wp.plan_squat), st.KNEELING: _work(wp.plan_kneel),
    st.LUNGE: _work(wp.plan_lunge), st.SCREW: _work(wp.plan_screw), st.TAKE: start_take,
}  # fmt: skip
"""What is begun where the worker stands: each compiled by itself when it is first wanted."""


def start_here(who: Decision, activity: int, height: float, at_rest: Floats | None = None) -> float:
    """Start an activity where the worker stands; how long it takes [s], 0 of standing. What is
    picked up or set down is `at_rest` (6,) before or after."""
    draws, config, me = who.draws, who.mind.numbers, who.me
    feet(0.0, me)
    if activity == st.REACH:
        others = who.workers["spot"][who.others(), :2]
        return start_reach(draws, config, who.kind_here == "robot", height, others, me)
    if activity == st.LIFT:
        return start_lift(draws, config, me)
    if at_rest is not None:
        return _start_load(who, activity, at_rest)
    if activity == st.DRILL:  # below the head, and above it for drilling overhead
        height = min(height, wp.OVERHEAD_M - 0.1)
    elif activity == st.OVERHEAD:
        height = max(height, wp.OVERHEAD_M + 0.1)
    return STARTS[activity](draws, height, me) if activity in STARTS else 0.0


def _start_load(who: Decision, activity: int, at_rest: Floats) -> float:
    """Start to pick up what is at rest, or to lay it down so."""
    draws, me = who.draws, who.me
    if activity == st.PICK_UP:
        prop, on_shoulder = PROP_NAMES.index(who.job.prop), bool(draws[8] < 0.5)
        raise_s = loads.plan_pick_up(draws, 0.0, prop, on_shoulder, me)
    else:
        raise_s = loads.plan_set_down(draws, 0.0, me)
    loads.put_load(at_rest, me)
    return loads.finish_lift(raise_s, me)


@kernel
def own_side(x: float, y: float, others: Floats, me: Worker) -> Pair:
    """A target, moved over to the worker's own side of the middle to every other worker."""
    mx, my = me.start_x, me.start_y
    for k in range(others.shape[0]):
        dx, dy = others[k, 0] - mx, others[k, 1] - my
        apart = math.hypot(dx, dy)
        if 1e-6 < apart < 2.5:
            dx, dy = dx / apart, dy / apart
            over = (x - mx) * dx + (y - my) * dy - (0.5 * apart - OWN_SIDE_M)
            if over > 0.0:
                x, y = x - over * dx, y - over * dy
    return x, y


@kernel
def _target(draws: Floats, config: Numbers, near: bool, height: float, me: Worker) -> Triple:
    """A world point for the hands: in the robot's workspace if `near`, else ahead."""
    z = between(draws[3], *config.target_z_m)
    if not near:
        return from_here((0.36 + 0.3 * draws[1], 0.7 * (draws[2] - 0.5), max(z, height)), me)
    bx, by = config.robot_xy_m
    dx, dy = me.start_x - bx, me.start_y - by
    farthest = math.hypot(dx, dy) - BODY_M
    low, high = config.target_radius_m
    radius = between(draws[1], min(low, farthest), min(high, farthest))
    azimuth = math.atan2(dy, dx) + config.target_spread_rad * (2.0 * draws[2] - 1.0)
    return bx + radius * math.cos(azimuth), by + radius * math.sin(azimuth), z


@kernel
def start_reach(
    draws: Floats, config: Numbers, near: bool, height: float, others: Floats, me: Worker
) -> float:
    """Draw a reach: where to (above `height`), with which hand, how fast, for how long."""
    x, y, z = _target(draws, config, near, height, me)
    x, y = own_side(x, y, others, me)
    side = wrap(math.atan2(y - me.start_y, x - me.start_x) - me.start_yaw)
    right = 0.5 + (me.right_handed - 0.5) * math.exp(-((side / 0.2) ** 2))
    right = min(max(right - side / 0.4, 0.0), 1.0)
    used = (0.0, 1.0) if draws[4] < right else (1.0, 0.0)
    if draws[5] < config.two_hands_probability and abs(side) < 0.6:
        used = (1.0, 1.0)
    sudden = draws[6] < config.sudden_probability
    peak = config.sudden_speed_m_s if sudden else between(draws[7], *config.hand_speed_m_s)
    hold = 0.15 + 0.2 * draws[8] if sudden else between(draws[8], *config.hold_s)
    fidget = (0.035 * draws[9] * draws[9], 0.6 + 0.8 * draws[10])
    me.out_at = 0.05 if sudden else 0.1 + 0.5 * draws[11]
    return plan_reach((x, y, z), used, peak, hold, fidget, me)


@kernel
def start_lift(draws: Floats, config: Numbers, me: Worker) -> float:
    """Draw a lift: where the load stands and how long bending, raising and holding take."""
    me.out_at = 0.1 + 0.4 * draws[11]
    times = (between(draws[1], *config.lift_s), between(draws[2], *config.lift_s), 0.3 + draws[3])
    z = between(draws[4], *config.load_z_m)
    ahead = 0.38 + 0.08 * draws[5]
    return plan_lift(ahead, z, times, me)
