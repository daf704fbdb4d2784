"""Locomotion other than normal walking: turns, stumbles, steps back, and pushing a cart."""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.planning import locate_shoulders, measure_reach, scale_draw
from hrc_env.motion.anatomy import LEG, STAND_Z
from hrc_env.motion.curves import min_jerk, move_point, shift
from hrc_env.motion.holding import grip_load, place_load, take_load
from hrc_env.motion.paths import lay_path
from hrc_env.motion.points import Point, SagittalShift
from hrc_env.motion.posture import lean
from hrc_env.motion.state import Worker
from hrc_env.motion.walk import Pace, locate_root, measure_speed, plan_pace, plan_walk, walk
from hrc_env.worker.props import PROP_NAMES

CART = PROP_NAMES.index("cart")
WHEELBARROW = PROP_NAMES.index("wheelbarrow")
CART_AHEAD_M = 0.47
"""Distance of a cart's handles ahead of the root [m]."""
WHEELBARROW_AHEAD_LEGS = 0.26
"""Distance of a level wheelbarrow's handles ahead of the root, in leg lengths."""
PUSHING_SHARE = 0.99
"""Extension of the arms during pushing, as a fraction of their length."""
STOOPED_M = 0.4
"""Forward displacement of the shoulders at a lean of 1 [m]."""
CART_LEAN = 0.06
"""Minimum lean while a cart is pushed, as defined in `posture.lean`."""
WHEEL_AHEAD_M = 1.2
"""Distance of a wheelbarrow's axle ahead of its origin [m]."""
WHEEL_UP_M = 0.17
"""Height of a wheelbarrow's axle above its origin [m]."""
STANDS_RAD = 0.2
"""Pitch of a wheelbarrow that stands on its legs [rad]."""
KNUCKLES_SHARE = 0.97
"""Height of a wheelbarrow's raised handles, as a fraction of pelvis height."""
BEND = 1.3
"""Lean with which the handles of a wheelbarrow are grasped. The value is an estimate."""
TAKE_S = 0.7
"""Time for the hands to reach the handles [s]."""
LIFT_S = 0.5
"""Time to lift a wheelbarrow by its handles [s]."""
STEP_BACK_PACE = Pace(0.0, 0.62, 0.42)
"""Pace of quick steps back. The values are estimates."""
TURN_PACE = Pace(0.0, 0.2, 0.36)
"""Pace of turning on the spot, sufficiently slow to prevent collisions of the feet.

The values are estimates.
"""
CAUGHT_LEGS = 0.115
"""Shortening of the step in which a foot is caught, in leg lengths. The value is an estimate."""


@kernel(makes_arrays=True)
def start_turn(yaw: float, worker: Worker) -> float:
    """Plan to turn on the spot to a heading [rad], and return the duration [s]."""
    here = Point(worker.start_x, worker.start_y)
    lay_path(here, np.empty((0, 3)), here, worker)
    return plan_pace(TURN_PACE, yaw, worker)


@kernel(makes_arrays=True)
def start_step_back(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to step straight back with an unchanged heading.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: unused; part of the interface of start functions.
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    x, y, yaw = worker.start_x, worker.start_y, worker.start_yaw
    end = move_point(x, y, yaw, -scale_draw(draws[0], 0.30, 0.75), 0.0)
    lay_path(Point(x, y), np.empty((0, 3)), end, worker)
    return plan_pace(STEP_BACK_PACE, yaw, worker)


@kernel
def start_stumble(draws: Floats, end_yaw: float, speed_m_s: float, worker: Worker) -> float:
    """Plan a walk along the worker's path in which a foot is caught.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        end_yaw: heading at the end [rad].
        speed_m_s: top speed [m/s].
        worker: record with the path; the plan is written into it.

    Returns:
        The duration [s].
    """
    duration_s = plan_walk(end_yaw, speed_m_s, worker)
    count = worker.step_count
    if worker.follow == 0.0 or count < 6:
        return duration_s
    step = 2 + int(draws[0] * (count - 5))
    worker.trip_at = worker.step_start + step * worker.step_period + 0.35 * worker.step_swing
    worker.trip = scale_draw(draws[1], 0.7, 1.0)
    shift(
        worker.footprints[step],
        0,
        worker.footprints[step, 2],
        -CAUGHT_LEGS * worker.lengths[LEG],
        0.0,
    )
    return duration_s


@kernel
def start_push(end_yaw: float, speed_m_s: float, prop: int, worker: Worker) -> float:
    """Plan to push a cart or wheelbarrow along the worker's path.

    Args:
        end_yaw: heading at the end [rad].
        speed_m_s: top speed [m/s].
        prop: kind of the cart or wheelbarrow, an index into `PROPS`.
        worker: record with the path; the plan is written into it.

    Returns:
        The duration [s].
    """
    take_load(prop, worker)
    duration_s = plan_walk(end_yaw, speed_m_s, worker)
    worker.grasp_s = TAKE_S + (LIFT_S if prop == WHEELBARROW else 0.0)
    _plan_handles(prop, worker)
    worker.total_s = duration_s + 2.0 * worker.grasp_s
    return worker.total_s


@kernel
def _plan_handles(prop: int, worker: Worker) -> None:
    """Plan the position of the handles, and the lean of the trunk towards them."""
    forward, aside, up = locate_shoulders(worker)
    across, high = worker.load_grip[1] - aside, worker.load_grip[2]
    if prop == WHEELBARROW:
        handles = KNUCKLES_SHARE * worker.lengths[STAND_Z] - high
        worker.tilt = math.asin(min(max(handles / WHEEL_AHEAD_M, 0.0), 0.24))
        worker.load_at[0] = WHEELBARROW_AHEAD_LEGS * worker.lengths[LEG]
    else:
        worker.tilt, worker.load_at[0] = 0.0, CART_AHEAD_M
    ahead, raised = _tilt_point(-worker.tilt, high)
    reach = forward + measure_reach(PUSHING_SHARE, across, up - high - raised, worker)
    worker.stoop = max(worker.load_at[0] + ahead - reach, 0.0) / STOOPED_M


@kernel
def push(t: float, clock_s: float, worker: Worker) -> None:
    """Compute the control vector of grasping, pushing and releasing a cart, except for the feet.

    Args:
        t: time since the activity began [s].
        clock_s: time since the episode began [s].
        worker: record with the plan; its `q` is written.
    """
    q = worker.q
    going = t - worker.grasp_s
    walk(going, clock_s, worker)
    near_end = min(t, worker.total_s - t)
    held, effort = min_jerk(near_end / TAKE_S), measure_speed(going, worker)
    stooped = worker.stoop * max(1.0 - effort, 0.0)
    q[c.PELVIS_PITCH] += 0.05 * effort
    q[c.SPINE_FLEX] += 0.10 * effort
    x, y, yaw = locate_root(going, worker)
    place_load(x, y, yaw, 0.0, worker)
    if worker.load_prop == WHEELBARROW:
        low = 1.0 - min_jerk((near_end - TAKE_S) / LIFT_S)
        lean((BEND * low + stooped * (1.0 - low)) * held, 0.1, 0.0, worker)
        tipped = STANDS_RAD * low - worker.tilt * (1.0 - low)  # about its axle, handles down
        ahead, up = _tilt_point(tipped, 0.0)
        shift(q, c.PROP_POSE, yaw, ahead, 0.0)
        q[c.PROP_POSE + 2] += up
        q[c.PROP_POSE + 4] -= tipped
    else:
        lean((CART_LEAN + stooped) * held, 0.0, 0.0, worker)
    grip_load(held * (2.0 - held), worker)  # before the bent trunk lowers them to the knees


@kernel
def _tilt_point(back_rad: float, z: float) -> SagittalShift:
    """Return the displacement of a point of a wheelbarrow that is tilted back.

    Args:
        back_rad: angle of the tilt [rad].
        z: height of the point above the wheelbarrow's origin [m].
    """
    cos, sin = math.cos(back_rad), math.sin(back_rad)
    above = z - WHEEL_UP_M
    ahead = WHEEL_AHEAD_M * (1.0 - cos) - above * sin
    return SagittalShift(ahead, -WHEEL_AHEAD_M * sin - above * (1.0 - cos))
