"""Going somewhere: walking, turning, with a cart, stumbling, a few quick steps back."""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.planning import between, in_reach, shoulders
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.motion.anatomy import LEG, STAND_Z
from hrc_env.motion.curves import min_jerk
from hrc_env.motion.holding import GRIPS, drop_load, grip_load, place_load
from hrc_env.motion.paths import lay_path
from hrc_env.motion.posture import lean
from hrc_env.motion.walk import plan_pace, plan_walk, root, speed, walk
from hrc_env.worker.props import prop_index

CART, WHEELBARROW = prop_index("cart"), prop_index("wheelbarrow")
CART_AHEAD_M, WHEELBARROW_AHEAD_LEGS = 0.47, 0.26
"""Handles ahead of the root: [m], arms bent before the belly; and in lengths of the leg while the
wheelbarrow is level, arms hanging before the thighs, which bend between them; judgement."""
PUSHING_SHARE, STOOPED_M, CART_LEAN = 0.99, 0.4, 0.06
"""Arms push stretched to this share; where they are too short for that, the trunk leans: a lean of
1 brings the shoulders so far forward [m]; how far everybody leans to a cart; judgement."""
WHEEL_AHEAD_M, WHEEL_UP_M, STANDS_RAD = 1.2, 0.17, 0.2
"""A wheelbarrow's axle in its frame [m], and how far it tips back onto its legs."""
KNUCKLES_SHARE, BEND = 0.97, 1.3
"""Handles are carried as high as this share of the pelvis, by arms that hang almost straight;
how far the trunk bends to take them; judgement."""
TAKE_S, LIFT_S = 0.7, 0.5
"""For the hands to go to the handles; to lift a wheelbarrow by them [s]."""
BACK_M_S, BACK_PERIOD_S = 0.62, 0.42
"""Quick steps back: speed and time of a step; judgement."""
TURN_M_S, TURN_PERIOD_S = 0.2, 0.36
"""Turning on the spot: steps so short that no foot steps on the other; judgement."""
CAUGHT_LEGS = 0.115
"""How much too short the step is in which a foot catches, in lengths of the leg; judgement."""


@kernel
def start_walk(place: Place, via: Floats, speed_m_s: float, me: Worker) -> float:
    """Plan to walk to the place by way of a point; returns how long it takes [s]."""
    plan = me.plan
    start = (plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW])
    end = (place[0], place[1], place[2])
    return plan_walk(start, via, end, speed_m_s, plan, me.prints, me.stance, me.size)


@kernel(makes_arrays=True)
def start_turn(place: Place, me: Worker) -> float:
    """Plan to turn on the spot to the place's yaw; returns how long it takes [s]."""
    plan = me.plan
    here = (plan[pl.START_X], plan[pl.START_Y])
    lay_path(here, np.empty((0, 3)), here, plan)
    pace = (0.0, TURN_M_S, TURN_PERIOD_S)
    return plan_pace(pace, place[2], plan, me.prints, me.stance, me.size)


@kernel(makes_arrays=True)
def start_step_back(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to step straight back without looking; returns how long it takes [s]."""
    plan = me.plan
    x, y, yaw = plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW]
    way = between(draws[0], 0.30, 0.75)
    plan[pl.END_X], plan[pl.END_Y] = x - math.cos(yaw) * way, y - math.sin(yaw) * way
    lay_path((x, y), np.empty((0, 3)), (plan[pl.END_X], plan[pl.END_Y]), plan)
    pace = (0.0, BACK_M_S, BACK_PERIOD_S)
    return plan_pace(pace, yaw, plan, me.prints, me.stance, me.size)


@kernel
def start_stumble(draws: Floats, place: Place, via: Floats, speed_m_s: float, me: Worker) -> float:
    """Plan a walk to the place in which a foot catches; returns how long it takes [s]."""
    lasts = start_walk(place, via, speed_m_s, me)
    plan = me.plan
    count = int(plan[pl.STEP_COUNT])
    if plan[pl.FOLLOW] == 0.0 or count < 6:
        return lasts
    step = 2 + int(draws[0] * (count - 5))
    plan[pl.TRIP_AT] = (
        plan[pl.STEP_START] + step * plan[pl.STEP_PERIOD] + 0.35 * plan[pl.STEP_SWING]
    )
    plan[pl.TRIP] = between(draws[1], 0.7, 1.0)
    yaw = me.prints[step, 2]
    caught = CAUGHT_LEGS * me.size[LEG]
    me.prints[step, 0] -= caught * math.cos(yaw)
    me.prints[step, 1] -= caught * math.sin(yaw)
    return lasts


@kernel
def start_push(place: Place, via: Floats, speed_m_s: float, prop: int, me: Worker) -> float:
    """Plan to push a cart or wheelbarrow to the place; returns how long it takes [s]."""
    plan = me.plan
    drop_load(plan)
    plan[pl.LOAD_PROP] = prop
    for i in range(6):
        plan[pl.LOAD_GRIP + i] = GRIPS[prop, i // 3, i % 3]
    plan[pl.LOAD_USED] = plan[pl.LOAD_USED + 1] = 1.0
    lasts = start_walk(place, via, speed_m_s, me)
    plan[pl.TAKEN_S] = TAKE_S + (LIFT_S if prop == WHEELBARROW else 0.0)
    _to_handles(prop, me)
    plan[pl.LASTS] = lasts + 2.0 * plan[pl.TAKEN_S]
    return plan[pl.LASTS]


@kernel
def _to_handles(prop: int, me: Worker) -> None:
    """Plan how far ahead the handles are, how far they are raised, and how far the trunk leans."""
    plan = me.plan
    forward, aside, up = shoulders(me)
    across, high = plan[pl.LOAD_GRIP + 1] - aside, plan[pl.LOAD_GRIP + 2]
    if prop == WHEELBARROW:
        handles = KNUCKLES_SHARE * me.size[STAND_Z] - high
        plan[pl.TIPPED] = math.asin(min(max(handles / WHEEL_AHEAD_M, 0.0), 0.24))
        plan[pl.LOAD_AT] = WHEELBARROW_AHEAD_LEGS * me.size[LEG]
    else:
        plan[pl.TIPPED], plan[pl.LOAD_AT] = 0.0, CART_AHEAD_M
    ahead, raised = _tipped(-plan[pl.TIPPED], high)
    reach = forward + in_reach(PUSHING_SHARE, across, up - high - raised, me)
    plan[pl.STOOP] = max(plan[pl.LOAD_AT] + ahead - reach, 0.0) / STOOPED_M


@kernel
def push(t: float, plan: Floats, clock_s: float, traits: Floats, size: Floats, q: Floats) -> None:
    """The control vector, but for the feet, of someone who takes a handle, pushes and lets go."""
    going = t - plan[pl.TAKEN_S]
    walk(going, plan, clock_s, traits, size, q)
    near_end = min(t, plan[pl.LASTS] - t)
    held, effort = min_jerk(near_end / TAKE_S), speed(going, plan)
    stooped = plan[pl.STOOP] * max(1.0 - effort, 0.0)
    q[c.PELVIS_PITCH] += 0.05 * effort
    q[c.SPINE_FLEX] += 0.10 * effort
    x, y, yaw = root(going, plan)
    place_load(x, y, yaw, 0.0, plan, q)
    if int(plan[pl.LOAD_PROP]) == WHEELBARROW:
        low = 1.0 - min_jerk((near_end - TAKE_S) / LIFT_S)
        lean((BEND * low + stooped * (1.0 - low)) * held, 0.1, 0.0, q)
        _tip(STANDS_RAD * low - plan[pl.TIPPED] * (1.0 - low), yaw, q)
    else:
        lean((CART_LEAN + stooped) * held, 0.0, 0.0, q)
    grip_load(held * (2.0 - held), plan, q)  # before the bent trunk takes them to the knees


@kernel
def _tip(back_rad: float, yaw: float, q: Floats) -> None:
    """Tip the wheelbarrow back about its axle, handles down."""
    ahead, up = _tipped(back_rad, 0.0)
    q[c.PROP_POSE] += math.cos(yaw) * ahead
    q[c.PROP_POSE + 1] += math.sin(yaw) * ahead
    q[c.PROP_POSE + 2] += up
    q[c.PROP_POSE + 4] -= back_rad


@kernel
def _tipped(back_rad: float, z: float) -> tuple[float, float]:
    """How far ahead and up a point goes at height z over the wheelbarrow's origin."""
    cos, sin = math.cos(back_rad), math.sin(back_rad)
    above = z - WHEEL_UP_M
    return WHEEL_AHEAD_M * (1.0 - cos) - above * sin, -WHEEL_AHEAD_M * sin - above * (1.0 - cos)
