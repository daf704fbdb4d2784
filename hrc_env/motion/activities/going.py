"""Going somewhere: walking, turning, with a cart, stumbling, a few quick steps back."""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.planning import between, in_reach, shoulders
from hrc_env.motion.anatomy import LEG, STAND_Z
from hrc_env.motion.curves import min_jerk
from hrc_env.motion.holding import GRIPS, drop_load, grip_load, place_load
from hrc_env.motion.paths import lay_path
from hrc_env.motion.posture import lean
from hrc_env.motion.state import Pair, Place, Worker
from hrc_env.motion.walk import plan_pace, plan_walk, root, speed, walk
from hrc_env.worker.props import prop_index

CART, WHEELBARROW = prop_index("cart"), prop_index("wheelbarrow")
CART_AHEAD_M, WHEELBARROW_AHEAD_LEGS = 0.47, 0.26
"""Handles ahead of the root: [m]; and in lengths of the leg while the wheelbarrow is level."""
PUSHING_SHARE, STOOPED_M, CART_LEAN = 0.99, 0.4, 0.06
"""Arms push stretched to this share, then trunks lean: 1 brings shoulders so far [m]; always."""
WHEEL_AHEAD_M, WHEEL_UP_M, STANDS_RAD = 1.2, 0.17, 0.2
"""A wheelbarrow's axle in its frame [m], and how far it tips back onto its legs."""
KNUCKLES_SHARE, BEND = 0.97, 1.3
"""Handles are carried as high as this share of the pelvis; the bow to take them; judgement."""
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
    start = (me.start_x, me.start_y, me.start_yaw)
    end = (place[0], place[1], place[2])
    return plan_walk(start, via, end, speed_m_s, me)


@kernel(makes_arrays=True)
def start_turn(place: Place, me: Worker) -> float:
    """Plan to turn on the spot to the place's yaw; returns how long it takes [s]."""
    here = (me.start_x, me.start_y)
    lay_path(here, np.empty((0, 3)), here, me)
    pace = (0.0, TURN_M_S, TURN_PERIOD_S)
    return plan_pace(pace, place[2], me)


@kernel(makes_arrays=True)
def start_step_back(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to step straight back without looking; returns how long it takes [s]."""
    x, y, yaw = me.start_x, me.start_y, me.start_yaw
    way = between(draws[0], 0.30, 0.75)
    me.end_x, me.end_y = x - math.cos(yaw) * way, y - math.sin(yaw) * way
    lay_path((x, y), np.empty((0, 3)), (me.end_x, me.end_y), me)
    pace = (0.0, BACK_M_S, BACK_PERIOD_S)
    return plan_pace(pace, yaw, me)


@kernel
def start_stumble(draws: Floats, place: Place, via: Floats, speed_m_s: float, me: Worker) -> float:
    """Plan a walk to the place in which a foot catches; returns how long it takes [s]."""
    lasts = start_walk(place, via, speed_m_s, me)
    count = me.step_count
    if me.follow == 0.0 or count < 6:
        return lasts
    step = 2 + int(draws[0] * (count - 5))
    me.trip_at = me.step_start + step * me.step_period + 0.35 * me.step_swing
    me.trip = between(draws[1], 0.7, 1.0)
    yaw = me.prints[step, 2]
    caught = CAUGHT_LEGS * me.size[LEG]
    me.prints[step, 0] -= caught * math.cos(yaw)
    me.prints[step, 1] -= caught * math.sin(yaw)
    return lasts


@kernel
def start_push(place: Place, via: Floats, speed_m_s: float, prop: int, me: Worker) -> float:
    """Plan to push a cart or wheelbarrow to the place; returns how long it takes [s]."""
    drop_load(me)
    me.load_prop = prop
    for i in range(6):
        me.load_grip[i] = GRIPS[prop, i // 3, i % 3]
    me.load_used[0] = me.load_used[1] = 1.0
    lasts = start_walk(place, via, speed_m_s, me)
    me.taken_s = TAKE_S + (LIFT_S if prop == WHEELBARROW else 0.0)
    _to_handles(prop, me)
    me.lasts = lasts + 2.0 * me.taken_s
    return me.lasts


@kernel
def _to_handles(prop: int, me: Worker) -> None:
    """Plan how far ahead the handles are, how far they are raised, and how far the trunk leans."""
    forward, aside, up = shoulders(me)
    across, high = me.load_grip[1] - aside, me.load_grip[2]
    if prop == WHEELBARROW:
        handles = KNUCKLES_SHARE * me.size[STAND_Z] - high
        me.tipped = math.asin(min(max(handles / WHEEL_AHEAD_M, 0.0), 0.24))
        me.load_at[0] = WHEELBARROW_AHEAD_LEGS * me.size[LEG]
    else:
        me.tipped, me.load_at[0] = 0.0, CART_AHEAD_M
    ahead, raised = _tipped(-me.tipped, high)
    reach = forward + in_reach(PUSHING_SHARE, across, up - high - raised, me)
    me.stoop = max(me.load_at[0] + ahead - reach, 0.0) / STOOPED_M


@kernel
def push(t: float, clock_s: float, me: Worker) -> None:
    """The control vector, but for the feet, of someone who takes a handle, pushes and lets go."""
    q = me.q
    going = t - me.taken_s
    walk(going, clock_s, me)
    near_end = min(t, me.lasts - t)
    held, effort = min_jerk(near_end / TAKE_S), speed(going, me)
    stooped = me.stoop * max(1.0 - effort, 0.0)
    q[c.PELVIS_PITCH] += 0.05 * effort
    q[c.SPINE_FLEX] += 0.10 * effort
    x, y, yaw = root(going, me)
    place_load(x, y, yaw, 0.0, me)
    if me.load_prop == WHEELBARROW:
        low = 1.0 - min_jerk((near_end - TAKE_S) / LIFT_S)
        lean((BEND * low + stooped * (1.0 - low)) * held, 0.1, 0.0, me)
        _tip(STANDS_RAD * low - me.tipped * (1.0 - low), yaw, me)
    else:
        lean((CART_LEAN + stooped) * held, 0.0, 0.0, me)
    grip_load(held * (2.0 - held), me)  # before the bent trunk takes them to the knees


@kernel
def _tip(back_rad: float, yaw: float, me: Worker) -> None:
    """Tip the wheelbarrow back about its axle, handles down."""
    q = me.q
    ahead, up = _tipped(back_rad, 0.0)
    q[c.PROP_POSE] += math.cos(yaw) * ahead
    q[c.PROP_POSE + 1] += math.sin(yaw) * ahead
    q[c.PROP_POSE + 2] += up
    q[c.PROP_POSE + 4] -= back_rad


@kernel
def _tipped(back_rad: float, z: float) -> Pair:
    """How far ahead and up a point goes at height z over the wheelbarrow's origin."""
    cos, sin = math.cos(back_rad), math.sin(back_rad)
    above = z - WHEEL_UP_M
    return WHEEL_AHEAD_M * (1.0 - cos) - above * sin, -WHEEL_AHEAD_M * sin - above * (1.0 - cos)
