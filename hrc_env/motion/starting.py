"""Start of the activity with a given index, by the start functions in `activities`."""

import math
from collections.abc import Callable

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Vector3
from hrc_env.motion import state as st
from hrc_env.motion.activities import loads
from hrc_env.motion.activities import work_plans as wp
from hrc_env.motion.activities.climb import start_climb, start_look_round
from hrc_env.motion.activities.going import start_push, start_step_back, start_stumble
from hrc_env.motion.activities.planning import choose_hand, clear_plan, finish_plan, scale_draw
from hrc_env.motion.config import HandParams
from hrc_env.motion.curves import wrap
from hrc_env.motion.decision import Decision
from hrc_env.motion.feet import place_feet
from hrc_env.motion.hands import LiftTimes, plan_lift, plan_reach
from hrc_env.motion.points import Point, Sides
from hrc_env.motion.posture import locate_ahead
from hrc_env.motion.reaches import Reach
from hrc_env.motion.state import Worker
from hrc_env.motion.walk import plan_walk
from hrc_env.worker.props import PROP_NAMES

TAKE_M = 0.52
"""Distance ahead of the root at which a hand is held out for an offered tool [m]."""
TAKE_S = 0.8
"""Time for which the hand is held out [s]."""
BODY_M = 0.36
"""Minimum distance of the hands from the worker's root [m]."""
OWN_SIDE_M = 0.30
"""Minimum distance of a hand's target from the midline between two workers [m]."""


def start_going(
    activity: int, draws: Floats, end_yaw: float, pace_m_s: float, prop: int, worker: Worker
) -> float:
    """Plan to walk, carry a load, push a cart or stumble along the worker's path.

    The plan of carrying is the same as that of walking.

    Args:
        activity: index into `ACTIVITY_NAMES`.
        draws: uniform random numbers (N_START,) in [0, 1).
        end_yaw: heading at the end [rad].
        pace_m_s: walking speed [m/s].
        prop: cart that is pushed, an index into `PROPS`; it is used only by pushing.
        worker: record with the path; the plan is written into it.

    Returns:
        The duration [s].
    """
    if activity == st.PUSH:
        return start_push(end_yaw, pace_m_s, prop, worker)
    if activity == st.STUMBLE:
        return start_stumble(draws, end_yaw, pace_m_s, worker)
    return plan_walk(end_yaw, pace_m_s, worker)


@kernel
def start_take(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to hold out a hand for a tool that the robot offers.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the hand [m].
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    clear_plan(worker)
    worker.side = choose_hand(draws[0], worker)
    used = Sides(0.0, 1.0) if worker.side == 1 else Sides(1.0, 0.0)
    at = locate_ahead(TAKE_M, (1.0 - 2.0 * worker.side) * 0.10, height, worker)
    worker.out_at = 0.1 + 0.3 * draws[1]
    duration_s = plan_reach(at, used, 1.1, TAKE_S, 0.0, 1.0, worker)
    for i in range(3):
        worker.tool_pose[i] = worker.target[3 * worker.side + i]
    return duration_s


Start = Callable[[Floats, float, Worker], float]
"""Function that plans an activity from random numbers (N_START,), a height [m] and a worker.

It writes the plan into the worker's record and returns the duration [s].
"""


def _finish_work(plan: Start) -> Start:
    """Return a start function that makes and completes a plan of work in place."""
    return lambda draws, height, worker: finish_plan(plan(draws, height, worker), worker)


def _finish_load(plan: Start) -> Start:
    """Return a start function that makes and completes a plan of handling a load."""
    return lambda draws, height, worker: loads.finish_lift(plan(draws, height, worker), worker)


STARTS: dict[int, Start] = {
    st.LOOK_ROUND: start_look_round,
    st.CLIMB: start_climb,
    st.STEP_BACK: start_step_back,
    st.SET_DOWN: _finish_load(loads.plan_set_down),
    st.HAND_OVER: _finish_load(loads.plan_hand_over),
    st.RECEIVE: _finish_load(loads.plan_receive),
    st.HAMMER: _finish_work(wp.plan_hammer),
    st.DRILL: _finish_work(wp.plan_drill),
    st.OVERHEAD: _finish_work(wp.plan_drill),
    st.SAW: _finish_work(wp.plan_saw),
    st.MEASURE: _finish_work(wp.plan_measure),
    st.POINT: _finish_work(wp.plan_point),
    st.SQUATTING: _finish_work(wp.plan_squat),
    st.KNEELING: _finish_work(wp.plan_kneel),
    st.LUNGE: _finish_work(wp.plan_lunge),
    st.SCREW: _finish_work(wp.plan_screw),
    st.TAKE: start_take,
}
"""Start functions of activities on the spot, by activity; each is compiled when first used."""


def start_here(
    decision: Decision, activity: int, height: float, at_rest: Floats | None = None
) -> float:
    """Plan an activity at the worker's current pose.

    Args:
        decision: inputs of the decision.
        activity: index into `ACTIVITY_NAMES`.
        height: height of the work [m].
        at_rest: pose (6,) of a load before it is picked up or after it is set down.

    Returns:
        The duration [s]; 0 for standing.
    """
    draws, params, worker = decision.draws, decision.mind.hand_params, decision.worker
    place_feet(0.0, worker)
    if activity == st.REACH:
        others = decision.workers["place"][decision.find_others(), :2]
        near = decision.kind_here == "robot"
        return start_reach(draws, params, near, height, others, worker)
    if activity == st.LIFT:
        return start_lift(draws, params, worker)
    if at_rest is not None:
        return _start_load(decision, activity, at_rest)
    if activity == st.DRILL:  # below the head, and above it for drilling overhead
        height = min(height, wp.OVERHEAD_M - 0.1)
    elif activity == st.OVERHEAD:
        height = max(height, wp.OVERHEAD_M + 0.1)
    return STARTS[activity](draws, height, worker) if activity in STARTS else 0.0


def _start_load(decision: Decision, activity: int, at_rest: Floats) -> float:
    """Plan to pick up a load from its rest pose, or to lay a load down at its rest pose."""
    draws, worker = decision.draws, decision.worker
    if activity == st.PICK_UP:
        prop, on_shoulder = PROP_NAMES.index(decision.job.prop), bool(draws[8] < 0.5)
        raise_s = loads.plan_pick_up(draws, 0.0, prop, on_shoulder, worker)
    else:
        raise_s = loads.plan_set_down(draws, 0.0, worker)
    loads.plan_load_pose(at_rest, worker)
    return loads.finish_lift(raise_s, worker)


@kernel
def keep_to_own_side(x: float, y: float, others: Floats, worker: Worker) -> Point:
    """Move a target to the worker's side of the midline to every other worker.

    Args:
        x: world x of the target [m].
        y: world y of the target [m].
        others: positions (n, 2) of the other workers [m].
        worker: record of the worker.
    """
    mx, my = worker.start_x, worker.start_y
    for k in range(others.shape[0]):
        dx, dy = others[k, 0] - mx, others[k, 1] - my
        apart = math.hypot(dx, dy)
        if 1e-6 < apart < 2.5:
            dx, dy = dx / apart, dy / apart
            over = (x - mx) * dx + (y - my) * dy - (0.5 * apart - OWN_SIDE_M)
            if over > 0.0:
                x, y = x - over * dx, y - over * dy
    return Point(x, y)


@kernel
def _draw_target(
    draws: Floats, params: HandParams, near: bool, height: float, worker: Worker
) -> Vector3:
    """Sample a target of the hands, in the world [m].

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        params: settings of reaches.
        near: whether the target is in the robot's workspace instead of ahead of the worker.
        height: minimum height of a target ahead [m].
        worker: record of the worker.
    """
    z = scale_draw(draws[3], *params.target_z_m)
    if not near:
        ahead, left = 0.36 + 0.3 * draws[1], 0.7 * (draws[2] - 0.5)
        return locate_ahead(ahead, left, max(z, height), worker)
    base = params.robot_xy_m
    dx, dy = worker.start_x - base.x, worker.start_y - base.y
    farthest = math.hypot(dx, dy) - BODY_M
    low, high = params.target_radius_m
    radius = scale_draw(draws[1], min(low, farthest), min(high, farthest))
    azimuth = math.atan2(dy, dx) + params.target_spread_rad * (2.0 * draws[2] - 1.0)
    x, y = base.x + radius * math.cos(azimuth), base.y + radius * math.sin(azimuth)
    return Vector3(x, y, z)


@kernel
def start_reach(
    draws: Floats, params: HandParams, near: bool, height: float, others: Floats, worker: Worker
) -> float:
    """Plan a random reach: its target, hands, speed and duration.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        params: settings of reaches.
        near: whether the target is in the robot's workspace instead of ahead of the worker.
        height: minimum height of a target ahead [m].
        others: positions (n, 2) of the other workers [m].
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    x, y, z = _draw_target(draws, params, near, height, worker)
    x, y = keep_to_own_side(x, y, others, worker)
    side = wrap(math.atan2(y - worker.start_y, x - worker.start_x) - worker.start_yaw)
    right = 0.5 + (worker.right_handed - 0.5) * math.exp(-((side / 0.2) ** 2))
    right = min(max(right - side / 0.4, 0.0), 1.0)
    used = Sides(0.0, 1.0) if draws[4] < right else Sides(1.0, 0.0)
    if draws[5] < params.two_hands_probability and abs(side) < 0.6:
        used = Sides(1.0, 1.0)
    sudden = draws[6] < params.sudden_probability
    peak = params.sudden_speed_m_s if sudden else scale_draw(draws[7], *params.hand_speed_m_s)
    hold = 0.15 + 0.2 * draws[8] if sudden else scale_draw(draws[8], *params.hold_s)
    fidget_m, fidget_hz = 0.035 * draws[9] * draws[9], 0.6 + 0.8 * draws[10]
    worker.out_at = 0.05 if sudden else 0.1 + 0.5 * draws[11]
    return plan_reach(Vector3(x, y, z), used, peak, hold, fidget_m, fidget_hz, worker)


def start_scripted_reach(decision: Decision, reach: Reach) -> float:
    """Plan a scripted reach with the hand on the side of its target; return its duration [s].

    Args:
        decision: inputs of the decision, at most `reaches.LEAD_S` before the start of the reach.
        reach: the reach.
    """
    worker, base = decision.worker, decision.mind.hand_params.robot_xy_m
    place_feet(0.0, worker)
    away_m = math.hypot(worker.start_x - base.x, worker.start_y - base.y)
    azimuth = math.atan2(worker.start_y - base.y, worker.start_x - base.x) + reach.azimuth_rad
    radius_m = min(reach.radius_m, away_m - BODY_M)
    x, y = base.x + radius_m * math.cos(azimuth), base.y + radius_m * math.sin(azimuth)
    side = wrap(math.atan2(y - worker.start_y, x - worker.start_x) - worker.start_yaw)
    used = Sides(1.0, 0.0) if side > 0.0 else Sides(0.0, 1.0)
    worker.out_at = max(reach.start_s - decision.clock_s, 0.0)
    target = Vector3(x, y, float(reach.z_m))
    return plan_reach(target, used, float(reach.peak_m_s), float(reach.hold_s), 0.0, 1.0, worker)


@kernel
def start_lift(draws: Floats, params: HandParams, worker: Worker) -> float:
    """Plan a random lift: the load's position, and the times to bend, raise and hold.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        params: settings of lifts.
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    worker.out_at = 0.1 + 0.4 * draws[11]
    times = LiftTimes(
        scale_draw(draws[1], *params.lift_s),
        scale_draw(draws[2], *params.lift_s),
        0.3 + draws[3],
    )
    z = scale_draw(draws[4], *params.load_z_m)
    ahead = 0.38 + 0.08 * draws[5]
    return plan_lift(ahead, z, times, worker)
