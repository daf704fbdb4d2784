"""Walking along a path, with acceleration, deceleration and footsteps.

Cadence and step length follow 68 walking trials of the CMU motion-capture database at 0.8 to 2 m/s:
cadence = 96.2 v^0.468 steps/min, step length = 0.345 + 0.286 v m.
"""

import math
from typing import NamedTuple

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ANKLE_X, LEG, STAND_Z
from hrc_env.motion.curves import hump, min_jerk, move_point, ramp, shift, wrap
from hrc_env.motion.feet import FLAT_S
from hrc_env.motion.holding import hold_load
from hrc_env.motion.paths import average_heading, locate_on_path
from hrc_env.motion.points import FloorPose
from hrc_env.motion.posture import (
    RELAXED_ELBOW,
    RELAXED_PITCH,
    STANCE_HALF_WIDTH_M,
    TOE_OUT_RAD,
    hang,
    stand,
)
from hrc_env.motion.state import MAX_STEPS, Worker

CADENCE_PER_MIN = 96.2
"""Cadence at 1 m/s in the fit above [steps/min]."""
CADENCE_POWER = 0.468
"""Exponent of the speed in the fit above."""
SLOWEST_M_S = 0.65
"""Minimum speed for the cadence [m/s]; slower walks have the cadence of this speed."""
LEG_M = 0.8685772217237624
"""Leg length for which the fit holds [m]; step periods scale with the root of the leg length."""
SWING_SHARE = 0.80
"""Swing time as a fraction of the period of a step, at 1 m/s."""
SWING_FAST_SHARE = 0.02
"""Increase of `SWING_SHARE` from 1 m/s to `FASTEST_M_S`."""
FASTEST_M_S = 1.8
"""Speed at which `SWING_FAST_SHARE` is reached [m/s]."""
MID_STANCE = 0.46
"""Time from landing until the root passes over the footprint, in periods of a step."""
EARLIER = 0.31
"""Time by which a runner passes over a footprint earlier than a walker, in periods of a step."""
RUN_WIDER_M = 0.015
"""Increase of half the step width in a run, with which a heel clears the other shank [m].

The value is an estimate.
"""
WALK_HALF_WIDTH_M = 0.04
"""Half the step width at full speed [m]; measured widths are 5 to 9 cm."""
SHIFT_S = 0.28
"""Time to shift the weight before the first step [s]."""
TURN_S = 0.5
"""Duration of a turn by an angle of zero [s]."""
TURN_RATE = 1.7
"""Angular speed that defines the increase of a turn's duration with its angle [rad/s]."""
SIDE_STEP_M = 0.5
"""Path length up to which workers take small steps without turning [m].

The value is an estimate.
"""
CORNER_M_S2 = 1.6
"""Maximum lateral acceleration in a corner [m/s^2]. The value is an estimate."""
NORMAL_M_S = 1.3
"""Speed at which the relative pace in the amplitudes below is 1 [m/s]."""
BOB_M = 0.0095
"""Constant part of the amplitude of the pelvis's vertical motion [m].

Measured peak-to-peak amplitudes are 2 to 4 cm.
"""
BOB_PACE_M = 0.0035
"""Part of the amplitude of the pelvis's vertical motion that is proportional to the pace [m]."""
BENT_M = 0.026
"""Part of the lowering of the pelvis that is proportional to the pace [m].

The value is an estimate.
"""
BENT_FAST_M = 0.10
"""Part of the lowering of the pelvis that grows with the square of the pace above 1 [m].

The value is an estimate.
"""
SWING_SLOW_RAD = 0.05
"""Constant part of the amplitude of the upper arm's swing [rad]."""
SWING_FAST_RAD = 0.104
"""Part of the amplitude of the arm swing that is proportional to the cube of the pace [rad]."""
FULL_SWING = 1.1
"""Relative pace beyond which the arm swing does not grow."""
ELBOW_SWING = 0.73
"""Bend of the elbow, as a fraction of the arm swing."""
LOADED_TWIST = 0.4
"""Fraction of the trunk's twist that remains with a load."""
LURCH_S = 1.4
"""Duration of a stumble [s]. The value is an estimate."""


class Pace(NamedTuple):
    """Parameters of walking along a path."""

    follow: float
    """Orientation on the path: 1 to face along it, 0 to keep the initial heading."""
    speed_m_s: float
    """Top speed [m/s]."""
    step_s: float
    """Period of a step [s]; 0 for the natural cadence at this speed."""


SIDE_STEP_PACE = Pace(0.0, 0.2, 0.52)
"""Pace of side steps. The values are estimates."""


@kernel
def measure_travel(t: float, worker: Worker) -> float:
    """Return the distance along the path at time t [m]."""
    u, rise = t - worker.depart, worker.ramp
    slow = worker.travel_s - rise
    return worker.top_m_s * rise * (ramp(u / rise) - ramp((u - slow) / rise))


@kernel
def measure_speed(t: float, worker: Worker) -> float:
    """Return the speed along the path at time t [m/s]."""
    u, rise = t - worker.depart, worker.ramp
    slow = worker.travel_s - rise
    a, b = min(max(u / rise, 0.0), 1.0), min(max((u - slow) / rise, 0.0), 1.0)
    return worker.top_m_s * (a * a * (3.0 - 2.0 * a) - b * b * (3.0 - 2.0 * b))


@kernel
def locate_root(t: float, worker: Worker) -> FloorPose:
    """Return the pose of the walker's root at time t, with an unwrapped heading."""
    s = measure_travel(t, worker)
    x, y = locate_on_path(s, worker)
    turning = min_jerk(t / worker.turn_in_s)
    yaw = worker.start_yaw - worker.turn_in * turning
    if worker.follow > 0.0:
        yaw += average_heading(min(s, worker.length), worker) - average_heading(0.0, worker)
    turned = min_jerk((t - worker.turn_out_at) / worker.turn_out_s)
    return FloorPose(x, y, yaw + worker.turn_out * turned)


@kernel
def walk(t: float, clock_s: float, worker: Worker) -> None:
    """Compute the control vector of a walker, except for the feet.

    Args:
        t: time since the walk began [s].
        clock_s: time since the episode began [s].
        worker: record with the plan; its `q` is written.
    """
    q = worker.q
    x, y, yaw = locate_root(t, worker)
    stand(x, y, yaw, clock_s, worker)
    period, last = worker.step_period, worker.step_count - 1.0
    phase = (t - worker.step_start) / period
    lead = 1.0 - 2.0 * worker.step_first
    aloft = worker.step_swing / period
    going = min_jerk((phase + 0.4) / 0.8) - min_jerk((phase - last) / 0.9)
    pace = measure_speed(t, worker) / NORMAL_M_S
    over = -lead * math.cos(math.pi * (phase - 0.5 * aloft)) * going
    left_ahead = lead * math.cos(math.pi * (phase - aloft)) * pace
    both_down = math.cos(2.0 * math.pi * (phase - 0.5 * (1.0 + aloft)))
    shift(q, c.ROOT_X, yaw, 0.0, (0.028 - 0.008 * min(pace, 1.0)) * over)
    bob = BOB_M * going + BOB_PACE_M * pace
    hurry = max(pace * math.sqrt(LEG_M / worker.lengths[LEG]) - 1.0, 0.0)
    q[c.PELVIS_Z] -= 0.006 * going + BENT_M * pace + BENT_FAST_M * hurry * hurry
    q[c.PELVIS_Z] -= bob * both_down
    q[c.PELVIS_PITCH] += 0.03 * pace
    q[c.PELVIS_ROLL] += 0.04 * over
    q[c.PELVIS_YAW] -= 0.075 * left_ahead
    q[c.SPINE_FLEX] += 0.03 * pace
    q[c.SPINE_SIDE] -= 0.05 * over
    q[c.SPINE_TWIST] += 0.19 * left_ahead
    ahead = locate_root(t + 0.5, worker).yaw
    q[c.HEAD_YAW] += 0.8 * min(max(ahead - yaw, -0.8), 0.8) - 0.5 * 0.115 * left_ahead
    for side in range(2):
        swing = -(1.0 - 2.0 * side) * left_ahead
        swing *= SWING_SLOW_RAD + SWING_FAST_RAD * min(pace, FULL_SWING) ** 3
        upper, elbow = RELAXED_PITCH - 0.06 * pace, RELAXED_ELBOW + 0.10 * pace
        hang(side, upper + swing, elbow + ELBOW_SWING * swing, worker)
    if worker.trip > 0.0:
        _lurch(t - worker.trip_at, worker.trip, worker)
    if worker.load_prop > 0.0:
        q[c.SPINE_TWIST] *= LOADED_TWIST
        hold_load(x, y, yaw, q[c.PELVIS_Z] - worker.lengths[STAND_Z], worker)


@kernel
def _lurch(t: float, trip: float, worker: Worker) -> None:
    """Add a stumble, in which the trunk pitches forward with the arms out, and recovers.

    Args:
        t: time since the foot was caught [s].
        trip: severity of the stumble in [0, 1].
        worker: record of the worker; its `q` is changed.
    """
    q = worker.q
    scale = worker.lengths[LEG] / LEG_M
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
def plan_walk(end_yaw: float, wanted_m_s: float, worker: Worker) -> float:
    """Plan to walk along the worker's path.

    Args:
        end_yaw: heading at the end [rad].
        wanted_m_s: desired top speed [m/s]; it is reduced for sharp corners.
        worker: record with the path; the plan is written into it.

    Returns:
        The duration [s].
    """
    if worker.length <= SIDE_STEP_M:
        return plan_pace(SIDE_STEP_PACE, end_yaw, worker)
    bend = math.sqrt(CORNER_M_S2 / max(worker.sharpest, 1e-6))
    speed_m_s = min(wanted_m_s, max(bend, SLOWEST_M_S))
    return plan_pace(Pace(1.0, speed_m_s, 0.0), end_yaw, worker)


@kernel
def plan_pace(pace: Pace, end_yaw: float, worker: Worker) -> float:
    """Plan speed, turns and steps along the worker's path.

    Args:
        pace: orientation, top speed and period of a step.
        end_yaw: heading at the end [rad].
        worker: record with the path; the plan is written into it.

    Returns:
        The duration [s].
    """
    worker.follow, period = pace.follow, pace.step_s
    worker.flight_s = 0.0
    plan_way(pace.speed_m_s, 0.45 + 0.4 * pace.speed_m_s, end_yaw, worker)
    if period == 0.0:
        period = 60.0 / (CADENCE_PER_MIN * max(worker.top_m_s, SLOWEST_M_S) ** CADENCE_POWER)
        period *= math.sqrt(worker.lengths[LEG] / LEG_M)
    fast = min(max((worker.top_m_s - 1.0) / (FASTEST_M_S - 1.0), 0.0), 1.0)
    worker.step_period = period
    worker.step_swing = (SWING_SHARE + SWING_FAST_SHARE * fast) * period
    return plan_steps(0, worker)


@kernel
def plan_way(wanted_m_s: float, ramp_s: float, end_yaw: float, worker: Worker) -> None:
    """Plan the speed along the worker's path, the turns at its ends and the first foot.

    Args:
        wanted_m_s: desired top speed [m/s]; it is reduced for a short path.
        ramp_s: time to accelerate to the top speed [s].
        end_yaw: heading at the end [rad].
        worker: record with the path; the plan is written into it.
    """
    worker.undo_at = worker.trip = worker.grasp_s = 0.0
    worker.ramp = ramp_s
    worker.top_m_s = min(wanted_m_s, worker.length / worker.ramp)
    worker.travel_s = worker.length / worker.top_m_s + worker.ramp
    _plan_turns(end_yaw, worker)
    worker.step_start = SHIFT_S
    worker.step_first = _choose_first_foot(worker)


@kernel
def brake(t: float, worker: Worker) -> float:
    """Replan a walk to stop on the path as soon as possible after time t.

    Feet in the air land as planned.

    Returns:
        The new duration [s], or -1 if the walker is about to arrive and continues.
    """
    t -= worker.grasp_s
    going = max(t - worker.depart, worker.ramp)
    if worker.follow == 0.0 or going + worker.ramp >= worker.travel_s:
        return -1.0
    worker.travel_s = going + worker.ramp
    worker.turn_out, worker.turn_out_s = 0.0, 1.0
    worker.turn_out_at = worker.depart + worker.travel_s - 1.0
    end = locate_root(worker.depart + worker.travel_s + 1.0, worker)
    worker.end_x, worker.end_y, worker.end_yaw = end.x, end.y, end.yaw
    lifted = math.floor((t - worker.step_start) / worker.step_period) + 1
    duration_s = plan_steps(max(int(lifted), 0), worker)
    worker.total_s = duration_s + 2.0 * worker.grasp_s
    return worker.total_s


@kernel
def _plan_turns(end_yaw: float, worker: Worker) -> None:
    """Plan the turns at both ends of the path, and the time at which the root starts to move."""
    first, final = average_heading(0.0, worker), average_heading(worker.length, worker)
    start_yaw = worker.start_yaw
    turn = wrap(start_yaw - first) if worker.follow > 0.0 else 0.0
    worker.turn_in, worker.turn_in_s = turn, TURN_S + abs(turn) / TURN_RATE
    worker.depart = SHIFT_S + 0.10 + max(0.0, worker.turn_in_s - TURN_S - 0.45)
    arrival = worker.depart + worker.travel_s
    heading = start_yaw - turn
    heading += final - first if worker.follow > 0.0 else 0.0
    turn = wrap(end_yaw - heading)
    worker.turn_out, worker.turn_out_s = turn, TURN_S + abs(turn) / TURN_RATE
    worker.turn_out_at = max(arrival - 0.7, SHIFT_S) if worker.follow > 0.0 else SHIFT_S
    worker.end_yaw = heading + turn


@kernel
def plan_steps(first: int, worker: Worker) -> float:
    """Plan the footprints from a given step on, over which the root passes at mid-stance.

    Args:
        first: index of the first planned step.
        worker: record with speed and turns; the footprints are written into it.

    Returns:
        The time at which the last foot is flat [s].
    """
    period, start = worker.step_period, worker.step_start
    done = max(worker.depart + worker.travel_s, worker.turn_out_at + worker.turn_out_s)
    over = start + worker.step_swing + MID_STANCE * period
    count = min(max(2 + math.ceil((done - 0.12 - over) / period), first + 2), MAX_STEPS)
    worker.step_count = count
    for k in range(first, count):
        side = (k + worker.step_first) % 2
        when, share = over + k * period if k < count - 2 else done + 1.0, 0.0
        if worker.flight_s > 0.0:
            share = min(measure_speed(start + k * period, worker) / worker.top_m_s, 1.0)
            when += (worker.flight_s - EARLIER * period) * share
        x, y, yaw = locate_root(when, worker)
        narrow = min(measure_speed(when, worker) / 0.8, 1.0) * worker.follow
        half = STANCE_HALF_WIDTH_M + (WALK_HALF_WIDTH_M - STANCE_HALF_WIDTH_M) * narrow
        half += RUN_WIDER_M * share
        write_footprint(side, x, y, yaw, half, worker.footprints[k], worker)
        x, y = worker.stance[side, 0], worker.stance[side, 1]
        if k >= 2:
            x, y = worker.footprints[k - 2, 0], worker.footprints[k - 2, 1]
        stride = math.hypot(worker.footprints[k, 0] - x, worker.footprints[k, 1] - y)
        worker.footprints[k, 3] = share if worker.flight_s > 0.0 else min(stride / NORMAL_M_S, 1.1)
    return start + (count - 1) * period + worker.step_swing + FLAT_S


@kernel
def _choose_first_foot(worker: Worker) -> int:
    """Return the foot (0 left, 1 right) on the side to which the walker turns or steps."""
    x, y, yaw = locate_root(worker.depart + worker.travel_s, worker)
    dx, dy = x - worker.start_x, y - worker.start_y
    side = -dx * math.sin(worker.start_yaw) + dy * math.cos(worker.start_yaw)
    turn = -worker.turn_in if worker.follow > 0.0 else side + 0.1 * (yaw - worker.start_yaw)
    return 0 if turn >= 0.0 else 1


@kernel
def write_footprint(
    side: int, x: float, y: float, yaw: float, half_width: float, out: Floats, worker: Worker
) -> None:
    """Compute the footprint (x, y, heading, height) of a foot beside the root.

    Args:
        side: 0 left, 1 right.
        x: world x of the root [m].
        y: world y of the root [m].
        yaw: heading [rad].
        half_width: lateral distance of the ankle from the root [m].
        out: footprint (5,), which is written except for column 3.
        worker: record with the body dimensions.
    """
    sign = 1.0 - 2.0 * side
    out[0], out[1] = move_point(x, y, yaw, worker.lengths[ANKLE_X], sign * half_width)
    out[2] = yaw + sign * TOE_OUT_RAD
    out[4] = 0.0
