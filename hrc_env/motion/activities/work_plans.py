"""Plans of work in place with tools, of pointing, of lunges, and of low work with both hands.

The functions `plan_...` return the peak speed of the hands on their way to the work [m/s], which
is an argument of `planning.finish_plan`.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Vector3
from hrc_env.motion.activities import planning as to
from hrc_env.motion.activities import strokes
from hrc_env.motion.activities.planning import CALM_M_S, choose_hand, scale_draw
from hrc_env.motion.activities.work import LOW_M
from hrc_env.motion.anatomy import ARM, STAND_Z
from hrc_env.motion.curves import move_point
from hrc_env.motion.state import Worker
from hrc_env.worker.props import PROP_NAMES

HAMMER = PROP_NAMES.index("hammer")
DRILL = PROP_NAMES.index("drill")
HAND_SAW = PROP_NAMES.index("saw")
TAPE = PROP_NAMES.index("tape_measure")
_SCREW_STEP_M = 0.12
"""Forward step of the foot opposite to the drill when driving screws [m].

The value is an estimate.
"""
_SCREW_S = (1.0, 1.3)
"""Time to drive one screw [s]. The values are estimates."""
_GAZE_M = 0.18
"""Distances of the gaze point ahead of the fist and to its right when driving screws [m]."""
_GAZE_DOWN_M = 0.2
"""Distance of the gaze point below the first screw when driving screws [m]."""
LEVEL = Vector3(0.0, 0.0, 0.0)
"""Orientation of a tool that points straight ahead: yaw, pitch, roll [rad]."""
HEAD_M = 0.25
"""Distance from the fist to the hammer's head along the handle [m], as in `props`."""
FACE_M = 0.05
"""Distance from the handle to the hammer's striking face [m], as in `props`."""
LIGHT_HZ = 5.6
"""Frequency of light taps [Hz]. The value is an estimate; the speed is at most 1.1 m/s."""
LIGHT_M = 0.060
"""Peak-to-peak amplitude of light taps [m]. The value is an estimate."""
LOW_SHARE = 0.7
"""Size of low blows relative to other blows. The value is an estimate."""
WALL_M = 1.2
"""Height above which nails are driven horizontally into a wall instead of downwards [m]."""
OVERHEAD_M = 1.7
"""Height above which work is overhead [m]."""
BIT_M = 0.22
"""Distance of the drill bit's tip ahead of the fist [m], as in `props`."""
BIT_UP_M = 0.09
"""Height of the drill bit's tip above the fist [m], as in `props`."""
THRUST_M = 0.04
"""Depth of a hole, and length of a screw [m]."""
SCREWS = 4
"""Number of screws in the robot's workpiece."""
SCREW_PITCH_M = 0.15
"""Vertical distance between consecutive screws [m]."""
FIST_AHEAD_M = 0.467
"""Distance of the fist ahead of the feet when driving screws into the robot's workpiece [m]."""
FIST_LEFT_M = 0.127
"""Distance of the fist left of the feet when driving screws into the robot's workpiece [m]."""
ASKEW_RAD = -0.25 * math.pi
"""Yaw of the drill from the heading when driving screws into the robot's workpiece [rad]."""
CUT_RAD = 0.6
"""Pitch of the saw blade [rad]; angles of 45 to 60 degrees to the board are usual.

The value is an estimate.
"""
SHOULDER_SHARE = 1.50
"""Height of the shoulder, as a multiple of pelvis height."""
SHOULDER_M = 0.19
"""Lateral distance of the shoulder from the body's midline [m]."""
POINT_M_S = 1.5
"""Peak speed of a pointing hand [m/s]. The value is an estimate."""
NEAREST_ARMS = 1.2
"""Minimum distance of the target of a lunge, in arm lengths. The value is an estimate."""
FARTHEST_ARMS = 1.5
"""Maximum distance of the target of a lunge, in arm lengths. The value is an estimate."""


@kernel
def plan_hammer(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to drive nails with a hammer.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the work [m]; 0 for a random height.
        worker: record into which the plan is written.

    Returns:
        The peak speed of the hands on their way to the work [m/s].
    """
    side = to.begin_plan(draws[0], worker)
    sign = 1.0 - 2.0 * side
    z = height if height > 0.0 else scale_draw(draws[1], 0.85, 1.4)
    aside = to.plan_stance(z, side, 1 - side, 0.16, worker)
    if z < WALL_M:
        ahead, turn = (0.62 if z < LOW_M else 0.72), Vector3(0.0, 0.5 * math.pi, 0.0)
        at = Vector3(ahead - HEAD_M, aside + 0.06 * sign, z + FACE_M + 0.02)
    else:
        ahead, turn = 0.68, LEVEL
        at = Vector3(ahead - FACE_M, 0.06 * sign, z - HEAD_M)
    to.plan_tool(HAMMER, side, at, turn, worker)
    beside_z = z + 0.05 if z < WALL_M else z - 0.05
    to.plan_other_hand(Vector3(ahead - 0.02, aside - 0.09 * sign, beside_z), worker)
    to.plan_gaze(Vector3(ahead, aside, z), worker)
    light = draws[2] < 0.4
    size = LIGHT_M if light else scale_draw(draws[3], 0.16, 0.22)
    if z < LOW_M:
        size *= LOW_SHARE
    rate = LIGHT_HZ if light else scale_draw(draws[4], 1.9, 2.2)
    to.plan_strokes(
        strokes.STRIKE, size, rate, scale_draw(draws[5], 1.6, 3.2), 2 + int(3.0 * draws[6]), worker
    )
    worker.wander_m = 0.08 * sign
    return CALM_M_S


@kernel
def plan_drill(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to drill holes, at a wall or overhead.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the work [m]; 0 for a random height.
        worker: record into which the plan is written.

    Returns:
        The peak speed of the hands on their way to the work [m/s].
    """
    side = to.begin_plan(draws[0], worker)
    sign = 1.0 - 2.0 * side
    z = height if height > 0.0 else scale_draw(draws[1], 1.1, 1.4)
    overhead = z >= OVERHEAD_M
    aside = to.plan_stance(z, side, 1 - side, 0.10 if overhead else 0.18, worker)
    if overhead:
        ahead, turn = 0.34, Vector3(0.0, -0.5 * math.pi, 0.0)
        at = Vector3(ahead + BIT_UP_M, 0.10 * sign, z - BIT_M - THRUST_M)
        beside = Vector3(ahead, aside - 0.22 * sign, z - 0.04)
    else:
        ahead, turn = 0.70, LEVEL
        at = Vector3(ahead - BIT_M - THRUST_M, aside + 0.05 * sign, z - BIT_UP_M)
        beside = Vector3(ahead - 0.04, aside - 0.12 * sign, z - 0.02)
    to.plan_tool(DRILL, side, at, turn, worker)
    to.plan_other_hand(beside, worker)
    to.plan_gaze(Vector3(ahead, aside, z), worker)
    kind, burst_s = strokes.PRESS if overhead else strokes.BORE, scale_draw(draws[2], 1.5, 1.8)
    to.plan_strokes(kind, THRUST_M, 0.0, burst_s, 2 + int(3.0 * draws[3]), worker)
    worker.wander_m = 0.12 * sign
    return CALM_M_S


@kernel
def plan_screw(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to drive screws into the robot's workpiece with a drill, from top to bottom.

    Positions are relative to the initial position and heading: ahead, left, height [m].

    Args:
        draws: uniform random numbers (N_START,) in [0, 1); 0 selects the hand, 2 the time for a
            screw.
        height: height of the first screw [m].
        worker: record into which the plan is written.

    Returns:
        The peak speed of the hands on their way to the work [m/s].
    """
    side = to.begin_plan(draws[0], worker)
    other_side = 1 - side
    to.plan_step_ahead(other_side, _SCREW_STEP_M, worker)
    fist = Vector3(FIST_AHEAD_M, FIST_LEFT_M, height - BIT_UP_M)
    yaw_pitch_roll = Vector3(ASKEW_RAD, 0.0, 0.0)
    to.plan_tool(DRILL, side, fist, yaw_pitch_roll, worker)
    gaze = Vector3(FIST_AHEAD_M + _GAZE_M, FIST_LEFT_M - _GAZE_M, height - _GAZE_DOWN_M)
    to.plan_gaze(gaze, worker)
    screw_s = scale_draw(draws[2], _SCREW_S[0], _SCREW_S[1])
    to.plan_strokes(
        kind=strokes.PRESS,
        size_m=THRUST_M,
        rate_hz=0.0,
        burst_s=screw_s,
        n=SCREWS,
        worker=worker,
    )
    worker.down_m = SCREW_PITCH_M
    return CALM_M_S


@kernel
def plan_saw(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to saw a board.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the work [m]; 0 for a random height.
        worker: record into which the plan is written.

    Returns:
        The peak speed of the hands on their way to the work [m/s].
    """
    side = to.begin_plan(draws[0], worker)
    sign = 1.0 - 2.0 * side
    z = height if height > 0.0 else scale_draw(draws[1], 0.75, 0.95)
    to.plan_step_ahead(1 - side, 0.26, worker)
    to.plan_tool(
        HAND_SAW, side, Vector3(0.52, 0.17 * sign, z + 0.17), Vector3(0.0, CUT_RAD, 0.0), worker
    )
    to.plan_other_hand(Vector3(0.58, -0.12 * sign, z + 0.03), worker)
    to.plan_gaze(Vector3(0.74, 0.1 * sign, z), worker)
    size, rate = scale_draw(draws[2], 0.13, 0.15), scale_draw(draws[3], 1.55, 1.75)
    burst_s = scale_draw(draws[4], 3.0, 5.0)
    to.plan_strokes(strokes.SAW, size, rate, burst_s, 1 + int(3.0 * draws[5]), worker)
    return CALM_M_S


@kernel
def plan_measure(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to measure with a tape measure.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the work [m]; 0 for a random height.
        worker: record into which the plan is written.

    Returns:
        The peak speed of the hands on their way to the work [m/s].
    """
    to.clear_plan(worker)
    z = height if height > 0.0 else scale_draw(draws[1], 0.85, 1.3)
    aside = to.plan_stance(z, 1, choose_hand(draws[0], worker), 0.12, worker)
    to.plan_tool(TAPE, 1, Vector3(0.48, aside, z + 0.04), LEVEL, worker)
    to.plan_gaze(Vector3(0.46, 0.12, z), worker)
    to.plan_strokes(
        strokes.SHIFT, 0.0, 0.0, scale_draw(draws[2], 0.8, 1.6), 2 + int(3.0 * draws[3]), worker
    )
    worker.wander_m = scale_draw(draws[4], 0.10, 0.18)
    return CALM_M_S


@kernel
def plan_point(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to point in a random direction ahead.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: unused; part of the interface of plan functions.
        worker: record into which the plan is written.

    Returns:
        The peak speed of the hand [m/s].
    """
    side = to.begin_plan(draws[0], worker)
    sign = 1.0 - 2.0 * side
    aside = sign * scale_draw(draws[1], -0.4, 0.7)
    up = scale_draw(draws[2], -0.25, 0.25)
    reach = 0.95 * worker.lengths[ARM]
    shoulder_z = SHOULDER_SHARE * worker.lengths[STAND_Z]
    x, y = move_point(0.0, SHOULDER_M * sign, aside, reach * math.cos(up), 0.0)
    at = Vector3(x, y, shoulder_z + reach * math.sin(up))
    to.plan_tool(0, side, at, LEVEL, worker)
    x, y = move_point(0.0, 0.0, aside, 10.0, 0.0)
    to.plan_gaze(Vector3(x, y, shoulder_z + 10.0 * math.tan(up)), worker)
    to.plan_strokes(
        strokes.JAB, 0.03, scale_draw(draws[3], 1.2, 1.8), scale_draw(draws[4], 0.8, 2.2), 1, worker
    )
    worker.twist = 0.35 * aside
    return POINT_M_S


@kernel
def plan_lunge(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to lunge at a point ahead with one hand.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the work [m]; 0 for a random height.
        worker: record into which the plan is written.

    Returns:
        The peak speed of the hands on their way to the work [m/s].
    """
    side = to.begin_plan(draws[0], worker)
    sign = 1.0 - 2.0 * side
    z = height if height > 0.0 else scale_draw(draws[1], 0.9, 1.3)
    to.plan_step_ahead(side, scale_draw(draws[2], 0.32, 0.42), worker)
    ahead = worker.lengths[ARM] * scale_draw(draws[3], NEAREST_ARMS, FARTHEST_ARMS)
    at = Vector3(ahead, sign * scale_draw(draws[4], -0.1, 0.25), z)
    to.plan_tool(0, side, at, LEVEL, worker)
    to.plan_gaze(at, worker)
    to.plan_strokes(strokes.STILL, 0.0, 0.0, scale_draw(draws[5], 0.0, 0.3), 1, worker)
    worker.settle_s, worker.out_at = 0.7, 0.12
    worker.step_swing = 0.40
    worker.twist = -0.35 * sign
    return scale_draw(draws[6], 1.9, 2.3)


@kernel
def plan_kneel(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to kneel and work near the floor.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the work [m]; 0 for a random height.
        worker: record into which the plan is written.

    Returns:
        The peak speed of the hands on their way to the work [m/s].
    """
    side = to.begin_plan(draws[0], worker)
    to.plan_kneeling(side, worker)
    return _plan_hands_low(0.42, draws, height, worker)


@kernel
def plan_squat(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to squat and work near the floor.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the work [m]; 0 for a random height.
        worker: record into which the plan is written.

    Returns:
        The peak speed of the hands on their way to the work [m/s].
    """
    to.clear_plan(worker)
    worker.crouch, worker.ahead, worker.settle_s = 1.0, 0.02, to.CROUCH_S
    return _plan_hands_low(0.50, draws, height, worker)


@kernel
def _plan_hands_low(ahead: float, draws: Floats, height: float, worker: Worker) -> float:
    """Plan the work of both hands near the floor.

    Args:
        ahead: distance of the work ahead of the feet [m].
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the work [m]; 0 for a random height.
        worker: record into which the plan is written.

    Returns:
        The peak speed of the hands on their way to the work [m/s].
    """
    side = choose_hand(draws[0], worker)
    sign = 1.0 - 2.0 * side
    z = height if height > 0.0 else scale_draw(draws[1], 0.12, 0.35)
    aside = to.offset_before_knee(worker)
    to.plan_tool(0, side, Vector3(ahead, aside + 0.10 * sign, z), LEVEL, worker)
    to.plan_other_hand(Vector3(ahead + 0.03, aside - 0.12 * sign, z), worker)
    to.plan_gaze(Vector3(ahead + 0.03, aside, z), worker)
    size, rate = scale_draw(draws[2], 0.02, 0.05), scale_draw(draws[3], 0.8, 1.4)
    to.plan_strokes(
        strokes.BUSY, size, rate, scale_draw(draws[4], 1.5, 3.5), 1 + int(3.0 * draws[5]), worker
    )
    worker.wander_m = 0.10
    return CALM_M_S
