"""Falling during a walk: a foot is caught, and hands, knees and trunk come down to the floor.

The worker lies on the floor, and gets up via hands and knees and one foot. `POSES` are
interpolated by the monotone cubic of Fritsch & Butland (1984, doi:10.1137/0905021), which does
not overshoot.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.planning import scale_draw
from hrc_env.motion.anatomy import ANKLE_Z, BALL_X, BALL_Z, LEG
from hrc_env.motion.curves import min_jerk, move_point
from hrc_env.motion.feet import raise_heel
from hrc_env.motion.floorplan import FloorGrid, read_slack
from hrc_env.motion.paths import locate_on_path
from hrc_env.motion.points import Point
from hrc_env.motion.posture import STANCE_HALF_WIDTH_M, TOE_OUT_RAD, stand
from hrc_env.motion.state import MAX_STEPS, Worker
from hrc_env.motion.walk import (
    LEG_M,
    WALK_HALF_WIDTH_M,
    locate_root,
    measure_travel,
    plan_walk,
    walk,
    write_footprint,
)

_STEPS_BEFORE, _STEPS_AFTER = 2, 3
"""Minimum numbers of steps of a walk before and after the step in which a foot is caught."""
_LAST_STEPS = 2
"""Number of footprints after that of the caught foot that are added for standing up again."""
PELVIS_X, PELVIS_Z, PITCH, ROLL, FLEX, NOD, TURN, GRASP, ELBOWS, KNEES = range(10)
"""Columns of `PLACES` for the trunk.

They are: distance of the pelvis ahead of the stumble and its height, for a leg of length `LEG_M`
[m]; pitch of the pelvis [rad]; degree of lying on a side (0 to 1); flexion of the spine [rad];
pitch and yaw of the head [rad]; degrees to which the hands follow their targets, and to which
elbows and knees point outwards (0 to 1).
"""
HANDS = 10
"""First of three columns per hand: ahead, outwards, height [m].

The hand on the side of the rising foot comes first.
"""
FEET = 16
"""First of five columns per foot: those of the rising foot, then those of the other foot.

They are: position of the ball of the foot ahead, outwards, and above that of a standing foot [m];
pitch of the foot and of the toes [rad].
"""
FREED = 26
"""Column of the degree to which the feet have left their footprints (0 to 1)."""
RISEN = 27
"""First of two columns: degree to which each foot has reached its final footprint (0 to 1)."""
_PUSHED, _STEM = (1.42, 0.38, 0.12), (1.42, 0.36, 0.14)
POSES = np.array([
    # time, pelvis x z, pitch, roll, flex, nod, turn, grasp, elbows, knees, hands, feet, shares
    (0.00, 0.00, 0.92, 0.10, 0, 0.05, 0.00, 0.0, 0, 0.4, 0.0, 0.9, 0.25, 0.95, 0.9, 0.25, 0.9,
     0.0, 0.08, 0.0, 0.0, 0.0, 0.0, 0.08, 0.0, 0.0, 0.0, 0, 0, 0),
    (0.32, 0.36, 0.80, 0.55, 0, 0.30, -0.35, 0.0, 1, 0.4, 0.0, 1.08, 0.22, 0.86, 1.02, 0.25, 0.76,
     0.0, 0.08, 0.0, 0.7, 0.0, 0.0, 0.08, 0.0, 0.7, 0.0, 0, 0, 0),
    (0.64, 0.60, 0.50, 1.10, 0, 0.15, -0.50, 0.1, 1, 0.6, 0.2, 1.34, 0.26, 0.14, 1.28, 0.28, 0.14,
     0.0, 0.08, 0.0, 1.25, 0.0, 0.0, 0.08, 0.0, 1.25, 0.0, 0, 0, 0),
    (0.82, 0.74, 0.25, 1.38, 0.4, 0.05, -0.50, 0.5, 1, 0.9, 0.8, 1.40, 0.34, 0.11, 1.36, 0.34, 0.11,
     -0.02, 0.12, 0.16, 1.9, 1.2, -0.02, 0.12, 0.18, 1.9, 1.2, 0.5, 0, 0),
    (1.00, 0.86, 0.05, 1.52, 1, -0.05, -0.42, 0.9, 1, 1.0, 1.0, *_PUSHED, *_PUSHED,
     -0.09, 0.13, 0.01, 2.6, 2.6, -0.09, 0.13, 0.01, 2.6, 2.6, 1, 0, 0),
    (1.40, 0.86, 0.05, 1.52, 1, -0.05, -0.42, 0.9, 1, 1.0, 1.0, *_PUSHED, *_PUSHED,
     -0.09, 0.13, 0.01, 2.6, 2.6, -0.09, 0.13, 0.01, 2.6, 2.6, 1, 0, 0),
    (2.30, 0.87, 0.28, 1.25, 0, -0.10, -0.35, 0.1, 1, 0.9, 0.9, *_PUSHED, *_PUSHED,
     0.15, 0.14, 0.03, 1.9, 1.0, 0.12, 0.14, 0.03, 1.9, 1.0, 1, 0, 0),
    (3.00, 0.84, 0.51, 1.30, 0, 0.10, -0.30, 0.0, 1, 0.8, 0.1, *_STEM, *_STEM,
     0.42, 0.12, 0.0, 1.3, 0.1, 0.42, 0.12, 0.0, 1.3, 0.1, 1, 0, 0),
    (3.20, 0.83, 0.51, 1.28, 0, 0.10, -0.30, 0.0, 1, 0.8, 0.1, *_STEM, *_STEM,
     0.42, 0.12, 0.0, 1.3, 0.0, 0.42, 0.12, 0.0, 1.3, 0.0, 1, 0, 0),
    (3.80, 0.80, 0.51, 0.70, 0, 0.30, -0.10, 0.0, 1, 0.4, 0.1, 1.40, 0.24, 0.62, 1.22, 0.34, 0.30,
     0.95, 0.13, 0.10, 0.6, 0.0, 0.42, 0.12, 0.0, 1.3, 0.0, 1, 0, 0),
    (4.30, 0.86, 0.51, 0.30, 0, 0.20, 0.00, 0.0, 1, 0.3, 0.0, 1.38, 0.22, 0.70, 1.05, 0.36, 0.62,
     1.30, 0.12, 0.0, 0.0, 0.0, 0.42, 0.12, 0.0, 1.3, 0.0, 1, 1, 0),
    (5.00, 1.10, 0.80, 0.40, 0, 0.25, -0.05, 0.0, 0.5, 0.2, 0.0, 1.42, 0.22, 0.84, 1.15, 0.36, 0.74,
     1.30, 0.12, 0.0, 0.0, 0.0, 0.85, 0.12, 0.10, 0.8, 0.0, 1, 1, 0.3),
    (5.70, 1.22, 0.957, 0.02, 0, 0.05, 0.05, 0.0, 0, 0.2, 0.0, 1.42, 0.22, 0.84, 1.2, 0.36, 0.74,
     1.30, 0.12, 0.0, 0.0, 0.0, 1.30, 0.12, 0.0, 0.0, 0.0, 1, 1, 1),
])  # fmt: skip
"""Key poses of a fall, with the time [s] in the first column before those of `PLACES`."""
TIMES_S = POSES[:, 0].copy()
"""Times of the key poses [s]."""
PLACES = POSES[:, 1:].copy()
"""Key poses without their times."""
LIES_S = 1.2
"""Time in `POSES` at which the worker lies on the floor [s]."""
STANDS_S = 5.7
"""Time in `POSES` at which the worker stands again [s]."""
THROWN_S = 0.32
"""Time of the transition from walking to falling [s]."""
ERECT_S = 0.7
"""Time of the transition from the last key pose to standing [s]."""
CAUGHT_AT = 0.7
"""Completed fraction of the swing at which the foot is caught. The value is an estimate."""
CAUGHT_LEGS = 0.14
"""Distance by which the caught foot lands ahead of the other, in leg lengths.

The value is an estimate.
"""
RISES_AT = 1.22
"""Distance from the stumble to the final standing position, in the unit of length of `POSES`."""
TALL = 1.7
"""Maximum distance of head and hands from the stumble, in the unit of length of `POSES`."""
TURNS_RAD = (0.0, 0.35, -0.35, 0.7, -0.7)
"""Directions of a fall relative to the heading [rad], tried in turn until there is room."""
QUICKEST = 1.15
"""Maximum speed of a fall relative to `POSES`."""
SLOWEST = 0.9
"""Minimum speed of a fall relative to `POSES`."""
MOST_ROLL_RAD = 0.9
"""Maximum roll of a lying trunk to a side [rad]."""


@kernel
def _find_slope(k: int, column: int) -> float:
    """Return the rate of change of a column of `PLACES` at key pose k [1/s]."""
    if k == 0 or k == PLACES.shape[0] - 1:
        return 0.0
    before, after = TIMES_S[k] - TIMES_S[k - 1], TIMES_S[k + 1] - TIMES_S[k]
    rose = (PLACES[k, column] - PLACES[k - 1, column]) / before
    rises = (PLACES[k + 1, column] - PLACES[k, column]) / after
    if rose * rises <= 0.0:
        return 0.0
    first, second = 2.0 * after + before, after + 2.0 * before
    return (first + second) / (first / rose + second / rises)


@kernel
def _interpolate(at: float, column: int) -> float:
    """Return a column of `PLACES`, interpolated at a time of `POSES` [s]."""
    k = 0
    while k < PLACES.shape[0] - 2 and TIMES_S[k + 1] <= at:
        k += 1
    duration_s = TIMES_S[k + 1] - TIMES_S[k]
    u = min(max((at - TIMES_S[k]) / duration_s, 0.0), 1.0)
    a, b = PLACES[k, column], PLACES[k + 1, column]
    p, r = _find_slope(k, column) * duration_s, _find_slope(k + 1, column) * duration_s
    return a + u * (p + u * (3.0 * (b - a) - 2.0 * p - r + u * (2.0 * (a - b) + p + r)))


@kernel
def _to_pose_time(since: float, worker: Worker) -> float:
    """Convert the time since the foot was caught [s] to the time in `POSES` [s]."""
    down = worker.fall_pace * since
    return min(down, LIES_S) + max(since - LIES_S / worker.fall_pace - worker.lie_s, 0.0)


@kernel
def fall(t: float, clock_s: float, worker: Worker) -> None:
    """Compute the control vector of walking, falling and getting up again.

    Args:
        t: time since the activity began [s].
        clock_s: time since the episode began [s].
        worker: record with the plan; its `q`, which contains the pose of the walking feet, is
            written.
    """
    at = _to_pose_time(t - worker.trip_at, worker)
    if at <= LIES_S:
        walk(t, clock_s, worker)
    else:
        stand(worker.end_x, worker.end_y, worker.end_yaw, clock_s, worker)
    if at <= 0.0:
        return
    share = min_jerk(at / THROWN_S) * min_jerk((STANDS_S - at) / ERECT_S)
    worker.fall_share, worker.trunk_roll = share, worker.lie_roll * _interpolate(at, ROLL)
    worker.elbows_out, worker.knees_out = _interpolate(at, ELBOWS), _interpolate(at, KNEES)
    _fall_trunk(at, share, worker)
    for side in range(2):
        row = 0 if side == worker.front else 1
        sign, scale = 1.0 - 2.0 * side, worker.lengths[LEG] / LEG_M
        hand, goal = HANDS + 3 * row, c.HAND_TARGET + 3 * side
        ahead, out = scale * _interpolate(at, hand), sign * scale * _interpolate(at, hand + 1)
        worker.q[goal], worker.q[goal + 1] = move_point(
            worker.fall_x, worker.fall_y, worker.fall_yaw, ahead, out
        )
        worker.q[goal + 2] = scale * _interpolate(at, hand + 2)
        worker.q[c.HAND_SHARE + side] = _interpolate(at, GRASP)
        _fall_foot(at, side, FEET + 5 * row, sign, worker)


@kernel
def _fall_trunk(at: float, share: float, worker: Worker) -> None:
    """Blend the poses of root, pelvis, spine and head with those of the fall.

    Args:
        at: time in `POSES` [s].
        share: weight of the fall in the posture.
        worker: record of the worker; its `q` is changed.
    """
    q, scale = worker.q, worker.lengths[LEG] / LEG_M
    side = 1.0 - 2.0 * worker.front
    x, y = move_point(
        worker.fall_x, worker.fall_y, worker.fall_yaw, scale * _interpolate(at, PELVIS_X), 0.0
    )
    q[c.ROOT_X] += share * (x - q[c.ROOT_X])
    q[c.ROOT_Y] += share * (y - q[c.ROOT_Y])
    q[c.HEADING] += share * (worker.fall_yaw - q[c.HEADING])
    for column in range(c.PELVIS_ROLL, c.HEAD_YAW + 1):
        q[column] *= 1.0 - share
    q[c.PELVIS_Z] += share * (scale * _interpolate(at, PELVIS_Z) - q[c.PELVIS_Z])
    q[c.PELVIS_PITCH] += share * (_interpolate(at, PITCH) - q[c.PELVIS_PITCH])
    q[c.SPINE_FLEX] += share * _interpolate(at, FLEX)
    q[c.HEAD_PITCH] += share * _interpolate(at, NOD)
    q[c.HEAD_YAW] += share * side * _interpolate(at, TURN)


@kernel
def _fall_foot(at: float, side: int, column: int, sign: float, worker: Worker) -> None:
    """Move a foot from its footprint, with the falling body, to its final footprint.

    Args:
        at: time in `POSES` [s].
        side: 0 left, 1 right.
        column: first column of the foot in `POSES`.
        sign: 1 on the left, -1 on the right.
        worker: record of the worker; its `q` is changed.
    """
    q, ankle = worker.q, c.ANKLE + 6 * side
    scale, length, low = worker.lengths[LEG] / LEG_M, worker.lengths[BALL_X], worker.lengths[BALL_Z]
    pitch, toes = _interpolate(at, column + 3), _interpolate(at, column + 4)
    freed, risen = _interpolate(at, FREED), _interpolate(at, RISEN + (column - FEET) // 5)
    raise_heel(side, pitch, worker)
    ahead, out = scale * _interpolate(at, column), sign * scale * _interpolate(at, column + 1)
    x, y = move_point(worker.fall_x, worker.fall_y, worker.fall_yaw, ahead, out)
    last = worker.footprints[worker.step_count + (worker.step_count + worker.step_first + side) % 2]
    end_x, end_y = move_point(last[0], last[1], last[2], length, 0.0)
    x, y, yaw = (
        x + risen * (end_x - x),
        y + risen * (end_y - y),
        worker.fall_yaw + sign * TOE_OUT_RAD,
    )
    cos, sin = math.cos(pitch), math.sin(pitch)
    x, y = move_point(x, y, yaw, -length * cos - low * sin, 0.0)
    z = (
        worker.lengths[ANKLE_Z]
        + low
        + scale * _interpolate(at, column + 2)
        + length * sin
        - low * cos
    )
    for i, goal in enumerate((x, y, z, yaw, pitch, toes)):
        q[ankle + i] += freed * (goal - q[ankle + i])


@kernel
def plan_fall(
    draws: Floats, end_yaw: float, pace_m_s: float, lie_s: float, grid: FloorGrid, worker: Worker
) -> float:
    """Plan a walk along the worker's path in which the worker falls and gets up again.

    Beginning with a random step, the steps are tried cyclically, each in the directions
    `TURNS_RAD`, until the floor has room for a fall.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1); 0 to 3 select the step, the rate of the
            fall, the roll of the lying trunk, and the foot on which the worker gets up first.
        end_yaw: heading at the end of the path, in the world frame [rad].
        pace_m_s: walking speed [m/s].
        lie_s: time for which the worker lies on the floor [s].
        grid: slack on the floor.
        worker: record with the path; the plan is written into it, even if there is no room.

    Returns:
        The duration [s]; -1 if there is no room for a fall, or the path is too short or too long.
    """
    plan_walk(end_yaw, pace_m_s, worker)
    n_candidates = worker.step_count - (_STEPS_BEFORE + _STEPS_AFTER)
    is_side_stepping = worker.follow == 0.0
    has_space = worker.step_count <= MAX_STEPS - _LAST_STEPS
    if is_side_stepping or n_candidates < 1 or not has_space:
        return -1.0
    worker.fall_pace, worker.lie_s = scale_draw(draws[1], SLOWEST, QUICKEST), lie_s
    worker.lie_roll = MOST_ROLL_RAD * (2.0 * draws[2] - 1.0)
    worker.front = 1 if draws[3] < 0.5 else 0
    first = int(draws[0] * n_candidates)
    for k in range(n_candidates):
        step = _STEPS_BEFORE + (first + k) % n_candidates
        for turn_rad in TURNS_RAD:
            if _plan_stumble(step, turn_rad, grid, worker):
                down_s = LIES_S / worker.fall_pace
                # getting up takes the rest of the time in POSES
                worker.total_s = worker.trip_at + down_s + lie_s + STANDS_S - LIES_S
                return worker.total_s
    return -1.0


@kernel
def _plan_stumble(step: int, turn: float, grid: FloorGrid, worker: Worker) -> bool:
    """Plan to fall in a given step and direction, if there is room.

    Args:
        step: index of the step in which the foot is caught.
        turn: angle of the fall from the heading [rad].
        grid: slack on the floor.
        worker: record with the walk; the plan is written into it.

    Returns:
        Whether there is room.
    """
    scale, side = worker.lengths[LEG] / LEG_M, (step + worker.step_first) % 2
    sign, stands = 1.0 - 2.0 * side, worker.footprints[step - 1]
    trip_at = worker.step_start + step * worker.step_period + CAUGHT_AT * worker.step_swing
    yaw = locate_root(trip_at, worker).yaw
    ahead, over = CAUGHT_LEGS * worker.lengths[LEG], sign * WALK_HALF_WIDTH_M
    x, y = move_point(stands[0], stands[1], yaw, 0.5 * ahead + worker.lengths[BALL_X], over)
    for k in range(9):
        px, py = move_point(x, y, yaw + turn, 0.125 * k * TALL * scale, 0.0)
        if read_slack(px, py, grid) < 0.0:
            return False
    worker.trip_at, worker.fall_x, worker.fall_y, worker.fall_yaw = trip_at, x, y, yaw + turn
    caught = worker.footprints[step]
    caught[0], caught[1] = move_point(stands[0], stands[1], yaw, ahead, 2.0 * over)
    caught[2], caught[3] = yaw + sign * TOE_OUT_RAD, 0.4 * caught[3]
    worker.step_count = step + 1
    worker.end_x, worker.end_y = move_point(x, y, worker.fall_yaw, RISES_AT * scale, 0.0)
    worker.end_yaw = worker.fall_yaw
    for side in range(2):
        last = worker.footprints[
            worker.step_count + (worker.step_count + worker.step_first + side) % 2
        ]
        write_footprint(
            side, worker.end_x, worker.end_y, worker.end_yaw, STANCE_HALF_WIDTH_M, last, worker
        )
    return True


@kernel
def predict_fallen_root(t: float, worker: Worker) -> Point:
    """Predict the approximate position of the root at time t of a fall, also after its end."""
    at = _to_pose_time(t - worker.trip_at, worker)
    if at <= 0.0:
        return locate_on_path(measure_travel(t, worker), worker)
    ahead = worker.lengths[LEG] / LEG_M * _interpolate(at, PELVIS_X)
    return move_point(worker.fall_x, worker.fall_y, worker.fall_yaw, ahead, 0.0)
