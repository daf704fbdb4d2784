"""Plans of work in place: with tools, pointing, a lunge, with both hands at floor height.

`plan_...` returns how fast hands may go to the work [m/s], for `planning.finish`.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion.activities import planning as to
from hrc_env.motion.activities import strokes
from hrc_env.motion.activities.planning import CALM_M_S, between, dominant
from hrc_env.motion.activities.work import LOW_M
from hrc_env.motion.anatomy import ARM, STAND_Z
from hrc_env.motion.curves import placed
from hrc_env.motion.state import Worker
from hrc_env.worker.props import PROP_NAMES

HAMMER, DRILL, HAND_SAW, TAPE = map(PROP_NAMES.index, ("hammer", "drill", "saw", "tape_measure"))
HEAD_M, FACE_M = 0.25, 0.05
"""From the fist to the hammer's head along the handle, and to its face [m]; `props`."""
LIGHT_HZ, LIGHT_M, LOW_SHARE = 5.6, 0.060, 0.7
"""Light taps: to and fro by 6 cm, at most 1.1 m/s; size of blows at floor height; judgement."""
WALL_M, OVERHEAD_M = 1.2, 1.7
"""From these heights on nails go into a wall, not downwards; people work above their head [m]."""
BIT_M, BIT_UP_M, THRUST_M = 0.22, 0.09, 0.04
"""Tip of the bit: ahead of the fist and above it (`props`); how far it goes in: a screw [m]."""
SCREWS, SCREW_PITCH_M, FIST_M, ASKEW_RAD = 4, 0.15, (0.467, 0.127), -0.25 * math.pi
"""Of who screws beside what a robot holds: how many, how far below each other, where the fist is
ahead and left of the feet [m], how far the drill is turned from where the worker looks."""
CUT_RAD = 0.6
"""How steeply the blade goes into the board [rad]; 45 to 60 degrees to it is usual, judgement."""
SHOULDER_SHARE, SHOULDER_M = 1.50, 0.19
"""Height of the shoulder in heights of the pelvis, and its distance from the middle [m]."""
POINT_M_S, AHEAD_ARMS = 1.5, (1.2, 1.5)
"""Peak speed of a pointing hand [m/s]; where one lunges to, in lengths of the arm; judgement."""


@kernel
def plan_hammer(draws: Floats, height: float, me: Worker) -> float:
    """Plan to drive nails at the height."""
    side, sign = to.begin(draws[0], me)
    z = height if height > 0.0 else between(draws[1], 0.85, 1.4)
    aside = to.get_ready(z, side, 1 - side, 0.16, me)
    if z < WALL_M:
        ahead, turn = (0.62 if z < LOW_M else 0.72), (0.0, 0.5 * math.pi, 0.0)
        at = (ahead - HEAD_M, aside + 0.06 * sign, z + FACE_M + 0.02)
    else:
        ahead, turn = 0.68, (0.0, 0.0, 0.0)
        at = (ahead - FACE_M, 0.06 * sign, z - HEAD_M)
    to.put_tool(HAMMER, side, at, turn, me)
    to.put_other((ahead - 0.02, aside - 0.09 * sign, z + 0.05 if z < WALL_M else z - 0.05), me)
    to.look_to((ahead, aside, z), me)
    light = draws[2] < 0.4
    size = LIGHT_M if light else between(draws[3], 0.16, 0.22)
    if z < LOW_M:
        size *= LOW_SHARE
    rate = LIGHT_HZ if light else between(draws[4], 1.9, 2.2)
    to.strokes(strokes.STRIKE, size, rate, between(draws[5], 1.6, 3.2), 2 + int(3.0 * draws[6]), me)
    me.wander_m = 0.08 * sign
    return CALM_M_S


@kernel
def plan_drill(draws: Floats, height: float, me: Worker) -> float:
    """Plan to drill at the height."""
    side, sign = to.begin(draws[0], me)
    z = height if height > 0.0 else between(draws[1], 1.1, 1.4)
    overhead = z >= OVERHEAD_M
    aside = to.get_ready(z, side, 1 - side, 0.10 if overhead else 0.18, me)
    if overhead:
        ahead, turn = 0.34, (0.0, -0.5 * math.pi, 0.0)
        at, beside = (ahead + BIT_UP_M, 0.10 * sign, z - BIT_M - THRUST_M), (ahead, z - 0.04)
    else:
        ahead, turn = 0.70, (0.0, 0.0, 0.0)
        at = (ahead - BIT_M - THRUST_M, aside + 0.05 * sign, z - BIT_UP_M)
        beside = (ahead - 0.04, z - 0.02)
    to.put_tool(DRILL, side, at, turn, me)
    to.put_other((beside[0], aside - (0.22 if overhead else 0.12) * sign, beside[1]), me)
    to.look_to((ahead, aside, z), me)
    kind, burst_s = strokes.PRESS if overhead else strokes.BORE, between(draws[2], 1.5, 1.8)
    to.strokes(kind, THRUST_M, 0.0, burst_s, 2 + int(3.0 * draws[3]), me)
    me.wander_m = 0.12 * sign
    return CALM_M_S


@kernel
def plan_screw(draws: Floats, height: float, me: Worker) -> float:
    """Plan to drive screws, each below the last, the first at the height."""
    side, _ = to.begin(draws[0], me)
    to.step_ahead(1 - side, 0.12, me)
    ahead, left = FIST_M
    to.put_tool(DRILL, side, (ahead, left, height - BIT_UP_M), (ASKEW_RAD, 0.0, 0.0), me)
    to.look_to((ahead + 0.18, left - 0.18, height - 0.2), me)
    to.strokes(strokes.PRESS, THRUST_M, 0.0, between(draws[2], 1.0, 1.3), SCREWS, me)
    me.down_m = SCREW_PITCH_M
    return CALM_M_S


@kernel
def plan_saw(draws: Floats, height: float, me: Worker) -> float:
    """Plan to saw a board at the height."""
    side, sign = to.begin(draws[0], me)
    z = height if height > 0.0 else between(draws[1], 0.75, 0.95)
    to.step_ahead(1 - side, 0.26, me)
    to.put_tool(HAND_SAW, side, (0.52, 0.17 * sign, z + 0.17), (0.0, CUT_RAD, 0.0), me)
    to.put_other((0.58, -0.12 * sign, z + 0.03), me)
    to.look_to((0.74, 0.1 * sign, z), me)
    to.strokes(strokes.SAW, between(draws[2], 0.13, 0.15), between(draws[3], 1.55, 1.75),
            between(draws[4], 3.0, 5.0), 1 + int(3.0 * draws[5]), me)  # fmt: skip
    return CALM_M_S


@kernel
def plan_measure(draws: Floats, height: float, me: Worker) -> float:
    """Plan to measure at the height."""
    to.blank(me)
    z = height if height > 0.0 else between(draws[1], 0.85, 1.3)
    aside = to.get_ready(z, 1, dominant(draws[0], me), 0.12, me)
    to.put_tool(TAPE, 1, (0.48, aside, z + 0.04), (0.0, 0.0, 0.0), me)
    to.look_to((0.46, 0.12, z), me)
    to.strokes(strokes.SHIFT, 0.0, 0.0, between(draws[2], 0.8, 1.6), 2 + int(3.0 * draws[3]), me)
    me.wander_m = between(draws[4], 0.10, 0.18)
    return CALM_M_S


@kernel
def plan_point(draws: Floats, height: float, me: Worker) -> float:
    """Plan to point somewhere ahead, at its height if it has one."""
    side, sign = to.begin(draws[0], me)
    aside = sign * between(draws[1], -0.4, 0.7)
    up = between(draws[2], -0.25, 0.25)
    reach = 0.95 * me.size[ARM]
    shoulder_z = SHOULDER_SHARE * me.size[STAND_Z]
    x, y = placed(0.0, SHOULDER_M * sign, aside, reach * math.cos(up), 0.0)
    to.put_tool(0, side, (x, y, shoulder_z + reach * math.sin(up)), (0.0, 0.0, 0.0), me)
    x, y = placed(0.0, 0.0, aside, 10.0, 0.0)
    to.look_to((x, y, shoulder_z + 10.0 * math.tan(up)), me)
    to.strokes(strokes.JAB, 0.03, between(draws[3], 1.2, 1.8), between(draws[4], 0.8, 2.2), 1, me)
    me.twist = 0.35 * aside
    return POINT_M_S


@kernel
def plan_lunge(draws: Floats, height: float, me: Worker) -> float:
    """Plan to snatch at something ahead, at the height."""
    side, sign = to.begin(draws[0], me)
    z = height if height > 0.0 else between(draws[1], 0.9, 1.3)
    to.step_ahead(side, between(draws[2], 0.32, 0.42), me)
    ahead = me.size[ARM] * between(draws[3], *AHEAD_ARMS)
    at = (ahead, sign * between(draws[4], -0.1, 0.25), z)
    to.put_tool(0, side, at, (0.0, 0.0, 0.0), me)
    to.look_to(at, me)
    to.strokes(strokes.STILL, 0.0, 0.0, between(draws[5], 0.0, 0.3), 1, me)
    me.settle_s, me.out_at = 0.7, 0.12
    me.step_swing = 0.40
    me.twist = -0.35 * sign
    return between(draws[6], 1.9, 2.3)


@kernel
def plan_kneel(draws: Floats, height: float, me: Worker) -> float:
    """Plan to kneel and work low."""
    side, _ = to.begin(draws[0], me)
    to.kneel_down(side, me)
    return _hands_low(0.42, draws, height, me)


@kernel
def plan_squat(draws: Floats, height: float, me: Worker) -> float:
    """Plan to work low on the haunches."""
    to.blank(me)
    me.crouch, me.ahead, me.settle_s = 1.0, 0.02, to.CROUCH_S
    return _hands_low(0.50, draws, height, me)


@kernel
def _hands_low(ahead: float, draws: Floats, height: float, me: Worker) -> float:
    """Plan what both hands do at floor height."""
    side = dominant(draws[0], me)
    sign = 1.0 - 2.0 * side
    z = height if height > 0.0 else between(draws[1], 0.12, 0.35)
    aside = to.before_knee(me)
    to.put_tool(0, side, (ahead, aside + 0.10 * sign, z), (0.0, 0.0, 0.0), me)
    to.put_other((ahead + 0.03, aside - 0.12 * sign, z), me)
    to.look_to((ahead + 0.03, aside, z), me)
    size, rate = between(draws[2], 0.02, 0.05), between(draws[3], 0.8, 1.4)
    to.strokes(strokes.BUSY, size, rate, between(draws[4], 1.5, 3.5), 1 + int(3.0 * draws[5]), me)
    me.wander_m = 0.10
    return CALM_M_S
