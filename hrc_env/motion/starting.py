"""Starting an activity by its number, whatever start functions it has (`activities`)."""

import math
from collections.abc import Callable

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.climb import start_climb
from hrc_env.motion.activities.crouching import plan_kneel, plan_squat
from hrc_env.motion.activities.drill import OVERHEAD_M, plan_drill
from hrc_env.motion.activities.going import (
    start_push,
    start_step_back,
    start_stumble,
    start_walk,
)
from hrc_env.motion.activities.hammer import plan_hammer
from hrc_env.motion.activities.loads import (
    finish_lift,
    plan_hand_over,
    plan_pick_up,
    plan_receive,
    plan_set_down,
)
from hrc_env.motion.activities.look_round import start_look_round
from hrc_env.motion.activities.lunge import plan_lunge
from hrc_env.motion.activities.measure import plan_measure
from hrc_env.motion.activities.planning import between, finish
from hrc_env.motion.activities.point import plan_point
from hrc_env.motion.activities.saw import plan_saw
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.motion.config import Numbers
from hrc_env.motion.curves import wrap
from hrc_env.motion.feet import feet
from hrc_env.motion.hands import plan_lift, plan_reach

BODY_M = 0.36
"""Hands reach no nearer to their own root than this [m]."""
OWN_SIDE_M = 0.30
"""Hands keep so far from the middle between their worker and another [m]."""


def start_going(
    activity: int, draws: Floats, place: Place, via: Floats, pace_m_s: float, prop: int, me: Worker
) -> float:
    """Start to walk, carry, push or stumble to a place past corners via (n, 3); how long [s]."""
    if activity == pl.PUSH:
        return start_push(place, via, pace_m_s, prop, me)
    if activity == pl.STUMBLE:
        return start_stumble(draws, place, via, pace_m_s, me)
    return start_walk(place, via, pace_m_s, me)


WORK: dict[int, Callable[[Floats, Place, Worker], float]] = {
    pl.HAMMER: plan_hammer, pl.DRILL: plan_drill, pl.OVERHEAD: plan_drill, pl.SAW: plan_saw,
    pl.MEASURE: plan_measure, pl.POINT: plan_point, pl.SQUATTING: plan_squat,
    pl.KNEELING: plan_kneel, pl.LUNGE: plan_lunge,
}  # fmt: skip
"""What plans work in place, for `finish`."""
HERE: dict[int, Callable[[Floats, Place, Worker], float]] = {
    pl.LOOK_ROUND: start_look_round, pl.CLIMB: start_climb, pl.STEP_BACK: start_step_back,
}  # fmt: skip
"""What starts the rest."""
LIFTS: dict[int, Callable[[Floats, Place, Worker], float]] = {
    pl.SET_DOWN: plan_set_down, pl.HAND_OVER: plan_hand_over, pl.RECEIVE: plan_receive,
}  # fmt: skip
"""What plans the way of a load, for `finish_lift`."""


def start_here(
    activity: int, draws: Floats, place: Place, near: bool, others: Floats, prop: int,
    config: Numbers, me: Worker,
) -> float:  # fmt: skip
    """Start an activity where the worker stands; how long it takes [s], 0 of standing.

    Python picks what is compiled, each by itself and when it is first wanted: a kernel that calls
    all of them would be compiled with all of them, a minute.

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
    feet(0.0, me.plan, me.prints, me.stance, me.size, me.q)
    if activity == pl.REACH:
        return start_reach(draws, config, near, place[3], others, me)
    if activity == pl.LIFT:
        return start_lift(draws, config, me)
    if activity == pl.PICK_UP:
        return finish_lift(plan_pick_up(draws, place, prop, bool(draws[8] < 0.5), me), me)
    if activity in LIFTS:
        return finish_lift(LIFTS[activity](draws, place, me), me)
    if activity in WORK:
        return finish(WORK[activity](draws, _at_its_height(activity, place), me), me)
    return HERE[activity](draws, place, me) if activity in HERE else 0.0


def _at_its_height(activity: int, place: Place) -> Place:
    """The place, below the head for drilling and above it for drilling overhead."""
    x, y, yaw, height = place
    if activity == pl.DRILL:
        height = min(height, OVERHEAD_M - 0.1)
    elif activity == pl.OVERHEAD:
        height = max(height, OVERHEAD_M + 0.1)
    return x, y, yaw, height


@kernel
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


@kernel
def _target(
    draws: Floats, config: Numbers, near: bool, height: float, plan: Floats
) -> tuple[float, float, float]:
    """A world point for the hands: in the robot's workspace, or ahead of the worker."""
    z = between(draws[3], *config.target_z_m)
    x, y = plan[pl.START_X], plan[pl.START_Y]
    if not near:
        z = max(z, height)
        ahead, left = 0.36 + 0.3 * draws[1], 0.7 * (draws[2] - 0.5)
        cos, sin = math.cos(plan[pl.START_YAW]), math.sin(plan[pl.START_YAW])
        return x + cos * ahead - sin * left, y + sin * ahead + cos * left, z
    bx, by = config.robot_xy_m
    own = math.hypot(x - bx, y - by)
    low, high = config.target_radius_m
    radius = between(draws[1], min(low, own - BODY_M), min(high, own - BODY_M))
    azimuth = math.atan2(y - by, x - bx) + config.target_spread_rad * (2.0 * draws[2] - 1.0)
    return bx + radius * math.cos(azimuth), by + radius * math.sin(azimuth), z


@kernel
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
    peak = config.sudden_speed_m_s if sudden else between(draws[7], *config.hand_speed_m_s)
    hold = 0.15 + 0.2 * draws[8] if sudden else between(draws[8], *config.hold_s)
    fidget = (0.035 * draws[9] * draws[9], 0.6 + 0.8 * draws[10])
    plan[pl.OUT_AT] = 0.05 if sudden else 0.1 + 0.5 * draws[11]
    return plan_reach(
        (x, y, z), used, peak, hold, fidget, plan, traits, me.bones, me.frame, me.size,
        me.q, me.p, me.r,
    )  # fmt: skip


@kernel
def start_lift(draws: Floats, config: Numbers, me: Worker) -> float:
    """Draw a lift: where the load stands and how long bending, raising and holding take."""
    me.plan[pl.OUT_AT] = 0.1 + 0.4 * draws[11]
    times = (between(draws[1], *config.lift_s), between(draws[2], *config.lift_s), 0.3 + draws[3])
    z = between(draws[4], *config.load_z_m)
    ahead = 0.38 + 0.08 * draws[5]
    return plan_lift(
        ahead, z, times, me.plan, me.traits, me.bones, me.frame, me.size, me.q, me.p, me.r
    )
