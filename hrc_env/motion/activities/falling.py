"""Falling: a walker's foot is caught, hands go out, knees, hands and trunk come to the floor.

They lie there, and get up over hands and knees and one foot. What is between two of POSES is a
monotone cubic of Fritsch & Butland (1984, doi:10.1137/0905021): nothing is overshot.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.planning import between
from hrc_env.motion.anatomy import ANKLE_Z, BALL_X, BALL_Z, LEG
from hrc_env.motion.curves import min_jerk, placed
from hrc_env.motion.feet import raise_heel
from hrc_env.motion.floorplan import slack_at
from hrc_env.motion.paths import along
from hrc_env.motion.posture import STANCE_HALF_WIDTH_M, TOE_OUT_RAD, stand
from hrc_env.motion.state import MAX_STEPS, Pair, Worker
from hrc_env.motion.walk import (
    LEG_M,
    WALK_HALF_WIDTH_M,
    footprint,
    plan_walk,
    root,
    travelled,
    walk,
)

(PELVIS_X, PELVIS_Z, PITCH, ROLL, FLEX, NOD, TURN, GRASP, ELBOWS, KNEES) = range(10)
HANDS, FEET, FREED, RISEN = 10, 16, 26, 27
"""Columns of POSES. Pelvis ahead of where they stumble and its height, its pitch, the share of
lying on a side, the spine, the head; share of the hands' places; elbows and knees outwards; ahead,
outwards and height of the hand on the side of the foot that gets up first, and of the other; the
same of the balls of the feet above a standing foot's, pitch of foot and of toes; shares of the feet
that have left their prints, of each that stands where they get up. Lengths of a leg of LEG_M."""
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
TIMES_S, PLACES = POSES[:, 0].copy(), POSES[:, 1:].copy()
LIES_S, STANDS_S = 1.2, 5.7
"""At which of these times they lie, and stand again."""
THROWN_S, ERECT_S = 0.32, 0.7
"""In which a walk becomes a fall, and the last pose one who stands [s]."""
CAUGHT_AT, CAUGHT_LEGS = 0.7, 0.14
"""Share of the caught foot's swing; how far before the other it comes down, in lengths of the leg;
judgement."""
RISES_AT, TALL = 1.22, 1.7
"""How far from where they stumble they stand again, and their head, hands or both are; the same
lengths as in POSES."""
TURNS_RAD = (0.0, 0.35, -0.35, 0.7, -0.7)
"""Ways to fall, from where they go, that are tried for room."""
QUICKEST, SLOWEST, MOST_ROLL_RAD = 1.15, 0.9, 0.9
"""Between these shares of the times of POSES people go down; how far they lie on a side at most."""


@kernel
def _slope(k: int, column: int) -> float:
    """Rate of a column at pose k."""
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
def _posed(at: float, column: int) -> float:
    """A column of POSES at one of their times."""
    k = 0
    while k < PLACES.shape[0] - 2 and TIMES_S[k + 1] <= at:
        k += 1
    lasts = TIMES_S[k + 1] - TIMES_S[k]
    u = min(max((at - TIMES_S[k]) / lasts, 0.0), 1.0)
    a, b = PLACES[k, column], PLACES[k + 1, column]
    p, r = _slope(k, column) * lasts, _slope(k + 1, column) * lasts
    return a + u * (p + u * (3.0 * (b - a) - 2.0 * p - r + u * (2.0 * (a - b) + p + r)))


@kernel
def _moment(since: float, me: Worker) -> float:
    """Which of the times of POSES it is so long after the foot was caught."""
    down = me.fall_pace * since
    return min(down, LIES_S) + max(since - LIES_S / me.fall_pace - me.lie_s, 0.0)


@kernel
def fall(t: float, clock_s: float, me: Worker) -> None:
    """Let the feet in q, and all of it, become those of who falls and gets up again."""
    at = _moment(t - me.trip_at, me)
    if at <= LIES_S:
        walk(t, clock_s, me)
    else:
        stand(me.end_x, me.end_y, me.end_yaw, clock_s, me)
    if at <= 0.0:
        return
    share = min_jerk(at / THROWN_S) * min_jerk((STANDS_S - at) / ERECT_S)
    me.fallen, me.rolled = share, me.lie_roll * _posed(at, ROLL)
    me.elbows_out, me.knees_out = _posed(at, ELBOWS), _posed(at, KNEES)
    _trunk(at, share, me)
    for side in range(2):
        of = 0 if side == me.front else 1
        sign, scale = 1.0 - 2.0 * side, me.size[LEG] / LEG_M
        hand, goal = HANDS + 3 * of, c.HAND_TARGET + 3 * side
        ahead, out = scale * _posed(at, hand), sign * scale * _posed(at, hand + 1)
        me.q[goal], me.q[goal + 1] = placed(me.fall_x, me.fall_y, me.fall_yaw, ahead, out)
        me.q[goal + 2] = scale * _posed(at, hand + 2)
        me.q[c.HAND_SHARE + side] = _posed(at, GRASP)
        _foot(at, side, FEET + 5 * of, sign, me)


@kernel
def _trunk(at: float, share: float, me: Worker) -> None:
    """Let a share of what stands in q become the root, the pelvis, the spine and the head."""
    q, scale = me.q, me.size[LEG] / LEG_M
    side = 1.0 - 2.0 * me.front
    x, y = placed(me.fall_x, me.fall_y, me.fall_yaw, scale * _posed(at, PELVIS_X), 0.0)
    q[c.ROOT_X] += share * (x - q[c.ROOT_X])
    q[c.ROOT_Y] += share * (y - q[c.ROOT_Y])
    q[c.HEADING] += share * (me.fall_yaw - q[c.HEADING])
    for column in range(c.PELVIS_ROLL, c.HEAD_YAW + 1):
        q[column] *= 1.0 - share
    q[c.PELVIS_Z] += share * (scale * _posed(at, PELVIS_Z) - q[c.PELVIS_Z])
    q[c.PELVIS_PITCH] += share * (_posed(at, PITCH) - q[c.PELVIS_PITCH])
    q[c.SPINE_FLEX] += share * _posed(at, FLEX)
    q[c.HEAD_PITCH] += share * _posed(at, NOD)
    q[c.HEAD_YAW] += share * side * _posed(at, TURN)


@kernel
def _foot(at: float, side: int, column: int, sign: float, me: Worker) -> None:
    """Let the foot in q, on its print, go on its ball, away, and to where they get up."""
    q, ankle = me.q, c.ANKLE + 6 * side
    scale, length, low = me.size[LEG] / LEG_M, me.size[BALL_X], me.size[BALL_Z]
    pitch, toes = _posed(at, column + 3), _posed(at, column + 4)
    freed, risen = _posed(at, FREED), _posed(at, RISEN + (column - FEET) // 5)
    raise_heel(side, pitch, me)
    ahead, out = scale * _posed(at, column), sign * scale * _posed(at, column + 1)
    x, y = placed(me.fall_x, me.fall_y, me.fall_yaw, ahead, out)
    last = me.prints[me.step_count + (me.step_count + me.step_first + side) % 2]
    end_x, end_y = placed(last[0], last[1], last[2], length, 0.0)
    x, y, yaw = x + risen * (end_x - x), y + risen * (end_y - y), me.fall_yaw + sign * TOE_OUT_RAD
    cos, sin = math.cos(pitch), math.sin(pitch)
    x, y = placed(x, y, yaw, -length * cos - low * sin, 0.0)
    z = me.size[ANKLE_Z] + low + scale * _posed(at, column + 2) + length * sin - low * cos
    for i, goal in enumerate((x, y, z, yaw, pitch, toes)):
        q[ankle + i] += freed * (goal - q[ankle + i])


@kernel
def plan_fall(
    draws: Floats, end_yaw: float, pace_m_s: float, lie_s: float, slack: Floats, origin: Floats,
    me: Worker,
) -> float:  # fmt: skip
    """Plan to fall on the way along the path that is laid; how long it takes [s], -1: no room."""
    plan_walk(end_yaw, pace_m_s, me)
    n = me.step_count - 5
    if me.follow == 0.0 or n < 1 or me.step_count > MAX_STEPS - 2:
        return -1.0
    me.fall_pace, me.lie_s = between(draws[1], SLOWEST, QUICKEST), lie_s
    me.lie_roll = MOST_ROLL_RAD * (2.0 * draws[2] - 1.0)
    me.front = 1 if draws[3] < 0.5 else 0
    first = int(draws[0] * n)
    for k in range(n):
        for turn in TURNS_RAD:
            if _stumbles(2 + (first + k) % n, turn, slack, origin, me):
                me.lasts = me.trip_at + LIES_S / me.fall_pace + lie_s + STANDS_S - LIES_S
                return me.lasts
    return -1.0


@kernel
def _stumbles(step: int, turn: float, slack: Floats, origin: Floats, me: Worker) -> bool:
    """Plan to fall in that step, turned from the way; whether there is room for it."""
    scale, side = me.size[LEG] / LEG_M, (step + me.step_first) % 2
    sign, stands = 1.0 - 2.0 * side, me.prints[step - 1]
    trip_at = me.step_start + step * me.step_period + CAUGHT_AT * me.step_swing
    _, _, yaw = root(trip_at, me)
    ahead, over = CAUGHT_LEGS * me.size[LEG], sign * WALK_HALF_WIDTH_M
    x, y = placed(stands[0], stands[1], yaw, 0.5 * ahead + me.size[BALL_X], over)
    for k in range(9):
        px, py = placed(x, y, yaw + turn, 0.125 * k * TALL * scale, 0.0)
        if slack_at(px, py, slack, origin) < 0.0:
            return False
    me.trip_at, me.fall_x, me.fall_y, me.fall_yaw = trip_at, x, y, yaw + turn
    caught = me.prints[step]
    caught[0], caught[1] = placed(stands[0], stands[1], yaw, ahead, 2.0 * over)
    caught[2], caught[3] = yaw + sign * TOE_OUT_RAD, 0.4 * caught[3]
    me.step_count = step + 1
    me.end_x, me.end_y = placed(x, y, me.fall_yaw, RISES_AT * scale, 0.0)
    me.end_yaw = me.fall_yaw
    for side in range(2):
        last = me.prints[me.step_count + (me.step_count + me.step_first + side) % 2]
        footprint(side, me.end_x, me.end_y, me.end_yaw, STANCE_HALF_WIDTH_M, last, me)
    return True


@kernel
def fallen_root(t: float, me: Worker) -> Pair:
    """About where the root of someone who falls is on the floor at time t, and after."""
    at = _moment(t - me.trip_at, me)
    if at <= 0.0:
        return along(travelled(t, me), me)
    ahead = me.size[LEG] / LEG_M * _posed(at, PELVIS_X)
    return placed(me.fall_x, me.fall_y, me.fall_yaw, ahead, 0.0)
