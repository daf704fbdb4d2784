"""Starting an activity by its number, whatever start functions it has (`activities`)."""

import math

import numba

from hrc_env.compiled import LEAN
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.climb import start_climb
from hrc_env.motion.activities.crouching import start_kneel, start_squat
from hrc_env.motion.activities.drill import start_drill
from hrc_env.motion.activities.going import (
    start_push,
    start_step_back,
    start_stumble,
    start_walk,
)
from hrc_env.motion.activities.hammer import start_hammer
from hrc_env.motion.activities.loads import (
    start_hand_over,
    start_pick_up,
    start_receive,
    start_set_down,
)
from hrc_env.motion.activities.look_round import start_look_round
from hrc_env.motion.activities.measure import start_measure
from hrc_env.motion.activities.point import start_point
from hrc_env.motion.activities.saw import start_saw
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.motion.config import Numbers
from hrc_env.motion.curves import wrap
from hrc_env.motion.feet import foot
from hrc_env.motion.hands import plan_lift, plan_reach
from hrc_env.typing import Floats

BODY_M = 0.36
"""Hands reach no nearer to their own root than this [m]."""
OWN_SIDE_M = 0.30
"""Hands keep so far from the middle between their worker and another [m]."""
OVERHEAD_M = 1.7
"""Drilling at this height or above is overhead work [m]."""


@numba.njit(**LEAN)
def between(draw: float, limits: tuple[float, float]) -> float:
    """A uniform draw in [0, 1) stretched to (low, high)."""
    return limits[0] + draw * (limits[1] - limits[0])


@numba.njit(**LEAN)
def start_going(
    activity: int, draws: Floats, place: Place, via: Floats, pace_m_s: float, prop: int, me: Worker
) -> float:
    """Start to walk, carry, push or stumble to a place past corners via (n, 3); how long [s]."""
    if activity == pl.PUSH:
        return start_push(place, via, pace_m_s, prop, me)
    if activity == pl.STUMBLE:
        return start_stumble(draws, place, via, pace_m_s, me)
    return start_walk(place, via, pace_m_s, me)


@numba.njit(**LEAN)
def start_here(
    activity: int, draws: Floats, place: Place, near: bool, others: Floats, prop: int,
    config: Numbers, me: Worker,
) -> float:  # fmt: skip
    """Start an activity where the worker stands; how long it takes [s], 0 of standing.

    Args:
        activity: index into `plans.ACTIVITY_NAMES`.
        draws: `worker.N_START` uniform numbers or more.
        place: of which the height counts.
        near: whether hands reach into the robot's workspace.
        others: (n, 2) where the other workers stand; hands stay on their own side.
        prop: what is picked up.
        config: see `config.numbers`.
        me: the worker.
    """
    for side in range(2):
        foot(0.0, side, me.plan, me.prints, me.stance, me.size, me.q)
    if activity == pl.REACH:
        return start_reach(draws, config, near, place[3], others, me)
    if activity == pl.LIFT:
        return start_lift(draws, config, me)
    if activity == pl.LOOK_ROUND:
        return start_look_round(draws, place, me)
    if activity == pl.PICK_UP:
        return start_pick_up(draws, place, prop, draws[8] < 0.5, me)
    if activity == pl.SET_DOWN:
        return start_set_down(draws, place, me)
    if activity == pl.HAND_OVER:
        return start_hand_over(draws, place, me)
    if activity == pl.RECEIVE:
        return start_receive(draws, place, me)
    if activity == pl.STEP_BACK:
        return start_step_back(draws, place, me)
    return _start_work(activity, draws, place, me)


@numba.njit(**LEAN)
def _start_work(activity: int, draws: Floats, place: Place, me: Worker) -> float:
    """Start work with a tool or on the floor; 0 of an activity that is none of these."""
    if activity == pl.HAMMER:
        return start_hammer(draws, place, me)
    if activity == pl.DRILL:
        low = (place[0], place[1], place[2], min(place[3], OVERHEAD_M - 0.1))
        return start_drill(draws, low, me)
    if activity == pl.OVERHEAD:
        high = (place[0], place[1], place[2], max(place[3], OVERHEAD_M + 0.1))
        return start_drill(draws, high, me)
    if activity == pl.SAW:
        return start_saw(draws, place, me)
    if activity == pl.MEASURE:
        return start_measure(draws, place, me)
    if activity == pl.POINT:
        return start_point(draws, place, me)
    if activity == pl.SQUATTING:
        return start_squat(draws, place, me)
    if activity == pl.KNEELING:
        return start_kneel(draws, place, me)
    if activity == pl.CLIMB:
        return start_climb(draws, place, me)
    return 0.0


@numba.njit(**LEAN)
def own_side(x: float, y: float, others: Floats, plan: Floats) -> tuple[float, float]:
    """A target, moved over to the worker's own side of the middle to every other worker."""
    mx, my = plan[pl.START_X], plan[pl.START_Y]
    for k in range(others.shape[0]):
        dx, dy = others[k, 0] - mx, others[k, 1] - my
        apart = math.hypot(dx, dy)
        if 1e-6 < apart < 2.5:
            dx, dy = dx / apart, dy / apart
            over = (x - mx) * dx + (y - my) * dy - (0.5 * apart - OWN_SIDE_M)
            if over > 0.0:
                x, y = x - over * dx, y - over * dy
    return x, y


@numba.njit(**LEAN)
def _target(
    draws: Floats, config: Numbers, near: bool, height: float, plan: Floats
) -> tuple[float, float, float]:
    """A world point for the hands: in the robot's workspace, or ahead of the worker."""
    z = between(draws[3], config.target_z_m)
    x, y = plan[pl.START_X], plan[pl.START_Y]
    if not near:
        z = max(z, height)
        ahead, left = 0.36 + 0.3 * draws[1], 0.7 * (draws[2] - 0.5)
        cos, sin = math.cos(plan[pl.START_YAW]), math.sin(plan[pl.START_YAW])
        return x + cos * ahead - sin * left, y + sin * ahead + cos * left, z
    bx, by = config.robot_xy_m
    own = math.hypot(x - bx, y - by)
    low, high = config.target_radius_m
    radius = between(draws[1], (min(low, own - BODY_M), min(high, own - BODY_M)))
    azimuth = math.atan2(y - by, x - bx) + config.target_spread_rad * (2.0 * draws[2] - 1.0)
    return bx + radius * math.cos(azimuth), by + radius * math.sin(azimuth), z


@numba.njit(**LEAN)
def start_reach(
    draws: Floats, config: Numbers, near: bool, height: float, others: Floats, me: Worker
) -> float:
    """Draw a reach: where to (above `height`), with which hand, how fast, for how long."""
    plan, traits = me.plan, me.traits
    x, y, z = _target(draws, config, near, height, plan)
    x, y = own_side(x, y, others, plan)
    side = wrap(math.atan2(y - plan[pl.START_Y], x - plan[pl.START_X]) - plan[pl.START_YAW])
    right = 0.5 + (traits[pl.RIGHT_HANDED] - 0.5) * math.exp(-((side / 0.2) ** 2))
    right = min(max(right - side / 0.4, 0.0), 1.0)
    used = (0.0, 1.0) if draws[4] < right else (1.0, 0.0)
    if draws[5] < config.two_hands_probability and abs(side) < 0.6:
        used = (1.0, 1.0)
    sudden = draws[6] < config.sudden_probability
    peak = config.sudden_speed_m_s if sudden else between(draws[7], config.hand_speed_m_s)
    hold = 0.15 + 0.2 * draws[8] if sudden else between(draws[8], config.hold_s)
    fidget = (0.035 * draws[9] * draws[9], 0.6 + 0.8 * draws[10])
    plan[pl.OUT_AT] = 0.05 if sudden else 0.1 + 0.5 * draws[11]
    return plan_reach(
        (x, y, z), used, peak, hold, fidget, plan, traits, me.bones, me.frame, me.size,
        me.q, me.p, me.r,
    )  # fmt: skip


@numba.njit(**LEAN)
def start_lift(draws: Floats, config: Numbers, me: Worker) -> float:
    """Draw a lift: where the load stands and how long bending, raising and holding take."""
    me.plan[pl.OUT_AT] = 0.1 + 0.4 * draws[11]
    times = (between(draws[1], config.lift_s), between(draws[2], config.lift_s), 0.3 + draws[3])
    z = between(draws[4], config.load_z_m)
    ahead = 0.38 + 0.08 * draws[5]
    return plan_lift(
        ahead, z, times, me.plan, me.traits, me.bones, me.frame, me.size, me.q, me.p, me.r
    )
