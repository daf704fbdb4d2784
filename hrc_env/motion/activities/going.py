"""Going somewhere: walking, turning, with a cart, stumbling, a few quick steps back."""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.planning import between, in_reach, shoulders
from hrc_env.motion.anatomy import LEG, STAND_Z
from hrc_env.motion.curves import min_jerk, placed, shift
from hrc_env.motion.holding import grip_load, place_load, take_load
from hrc_env.motion.paths import lay_path
from hrc_env.motion.posture import lean
from hrc_env.motion.state import Pair, Worker
from hrc_env.motion.walk import plan_pace, plan_walk, root, speed, walk
from hrc_env.worker.props import PROP_NAMES

CART, WHEELBARROW = PROP_NAMES.index("cart"), PROP_NAMES.index("wheelbarrow")
CART_AHEAD_M, WHEELBARROW_AHEAD_LEGS = 0.47, 0.26
"""Handles ahead of the root: a cart's [m]; a level wheelbarrow's in lengths of the leg."""
PUSHING_SHARE, STOOPED_M, CART_LEAN = 0.99, 0.4, 0.06
"""Arms push stretched to this share, then trunks lean: 1 brings shoulders so far [m]; always."""
WHEEL_AHEAD_M, WHEEL_UP_M, STANDS_RAD = 1.2, 0.17, 0.2
"""A wheelbarrow's axle in its frame [m], and how far it tips back onto its legs."""
KNUCKLES_SHARE, BEND = 0.97, 1.3
"""Handles are carried as high as this share of the pelvis; the bow to take them; judgement."""
TAKE_S, LIFT_S = 0.7, 0.5
"""For the hands to go to the handles; to lift a wheelbarrow by them [s]."""
STEP_BACK_PACE, TURN_PACE = (0.0, 0.62, 0.42), (0.0, 0.2, 0.36)
"""Of `plan_pace`: quick steps back; turning without one foot stepping on the other; judgement."""
CAUGHT_LEGS = 0.115
"""How much too short the step is in which a foot catches, in lengths of the leg; judgement."""


@kernel(makes_arrays=True)
def start_turn(yaw: float, me: Worker) -> float:
    """Plan to turn on the spot to a yaw; returns how long it takes [s]."""
    here = (me.start_x, me.start_y)
    lay_path(here, np.empty((0, 3)), here, me)
    return plan_pace(TURN_PACE, yaw, me)


@kernel(makes_arrays=True)
def start_step_back(draws: Floats, height: float, me: Worker) -> float:
    """Plan to step straight back without looking; returns how long it takes [s]."""
    x, y, yaw = me.start_x, me.start_y, me.start_yaw
    end = placed(x, y, yaw, -between(draws[0], 0.30, 0.75), 0.0)
    lay_path((x, y), np.empty((0, 3)), end, me)
    return plan_pace(STEP_BACK_PACE, yaw, me)


@kernel
def start_stumble(draws: Floats, end_yaw: float, speed_m_s: float, me: Worker) -> float:
    """Plan a walk in which a foot catches; returns how long it takes [s]."""
    lasts = plan_walk(end_yaw, speed_m_s, me)
    count = me.step_count
    if me.follow == 0.0 or count < 6:
        return lasts
    step = 2 + int(draws[0] * (count - 5))
    me.trip_at = me.step_start + step * me.step_period + 0.35 * me.step_swing
    me.trip = between(draws[1], 0.7, 1.0)
    shift(me.prints[step], 0, me.prints[step, 2], -CAUGHT_LEGS * me.size[LEG], 0.0)
    return lasts


@kernel
def start_push(end_yaw: float, speed_m_s: float, prop: int, me: Worker) -> float:
    """Plan to push a cart or wheelbarrow; returns how long it takes [s]."""
    take_load(prop, me)
    lasts = plan_walk(end_yaw, speed_m_s, me)
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
        tipped = STANDS_RAD * low - me.tipped * (1.0 - low)  # back about its axle, handles down
        ahead, up = _tipped(tipped, 0.0)
        shift(q, c.PROP_POSE, yaw, ahead, 0.0)
        q[c.PROP_POSE + 2] += up
        q[c.PROP_POSE + 4] -= tipped
    else:
        lean((CART_LEAN + stooped) * held, 0.0, 0.0, me)
    grip_load(held * (2.0 - held), me)  # before the bent trunk takes them to the knees


@kernel
def _tipped(back_rad: float, z: float) -> Pair:
    """How far ahead and up a point goes at height z over the wheelbarrow's origin."""
    cos, sin = math.cos(back_rad), math.sin(back_rad)
    above = z - WHEEL_UP_M
    return WHEEL_AHEAD_M * (1.0 - cos) - above * sin, -WHEEL_AHEAD_M * sin - above * (1.0 - cos)
