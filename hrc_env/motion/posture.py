"""Standing at ease, and the one way in which trunks go to where hands are wanted."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ARM, FOREARM_GRIP, LEFT, SIDE_STRIDE, STAND_Z, UPPER_ARM
from hrc_env.motion.curves import placed, shift, wrap
from hrc_env.motion.kinematics import ARM_KNEE, pose
from hrc_env.motion.state import Pair, Triple, Worker

STANCE_HALF_WIDTH_M = 0.10
"""Ankles' distance from the middle when standing [m]; shoulder-wide for the baked bodies."""
TOE_OUT_RAD = 0.12
"""Feet turn out by about 7 degrees, standing and walking."""
SWAY_HZ, SHIFT_M = (0.11, 0.17, 0.29, 0.41, 0.23), 0.018
"""Rates of a standing person's sway, incommensurable; weight shifts by so much [m]; judgement."""
RELAXED_PITCH, RELAXED_ELBOW, RELAXED_OUT, HAND_OUT_M = 0.02, 0.38, 0.26, 0.05
"""Hanging arms: upper arm forward, elbow bent, upper arm away from the trunk [rad], and the hand
farther out than the elbow [m]: beside broad hips, too; judgement."""
MOST_LEAN = 1.3
"""Lean beyond which a person would step instead."""
NECK_SHARE, HEAD_SHARE = 0.70, 0.75
"""Height of the eyes above the pelvis as a share of the pelvis's, from the baked bodies; the head's
share of a turn of gaze, the eyes do the rest (Freedman & Sparks 1997: 70-80 %)."""
MOST_YAW_RAD, MOST_DOWN_RAD, MOST_UP_RAD = 1.2, 0.75, 0.75
"""How far neck and head turn from the chest; comfortable ranges, judgement."""


@kernel
def sway(clock_s: float, i: int, me: Worker) -> float:
    """A slow wave of the worker's own, between -1 and 1."""
    return math.sin(2.0 * math.pi * (SWAY_HZ[i] * clock_s + me.phases[i]))


@kernel
def hang(side: int, pitch: float, elbow: float, me: Worker) -> None:
    """Let an arm hang: upper arm `pitch` forward of the vertical, elbow bent by `elbow`."""
    q = me.q
    sign = 1.0 - 2.0 * side
    fore = me.size[FOREARM_GRIP]
    upper = me.size[ARM] - fore
    at = c.HAND_OFFSET + 3 * side
    cos, sin = math.cos(pitch), math.sin(pitch)
    both_cos, both_sin = math.cos(pitch + elbow), math.sin(pitch + elbow)
    q[at] = sin * upper + both_sin * fore
    q[at + 1] = sign * (RELAXED_OUT * upper + HAND_OUT_M)
    q[at + 2] = -(cos * upper * (1.0 - 0.5 * RELAXED_OUT * RELAXED_OUT) + both_cos * fore)


@kernel
def stand(x: float, y: float, yaw: float, clock_s: float, me: Worker) -> None:
    """Fill every column but the feet: at ease at (x, y), shifting weight, looking about."""
    q = me.q
    first, second, third = sway(clock_s, 0, me), sway(clock_s, 1, me), sway(clock_s, 2, me)
    fourth, fifth = sway(clock_s, 3, me), sway(clock_s, 4, me)
    side_shift, ahead = SHIFT_M * (0.7 * first + 0.3 * third), 0.006 * fourth
    q[c.ROOT_X], q[c.ROOT_Y] = placed(x, y, yaw, ahead, side_shift)
    q[c.HEADING], q[c.PELVIS_Z] = yaw, me.size[STAND_Z]
    q[c.PELVIS_PITCH] = 0.02 + 0.01 * fourth
    q[c.PELVIS_ROLL] = 1.2 * side_shift
    q[c.PELVIS_YAW] = 0.03 * second
    q[c.SPINE_FLEX] = 0.04 + 0.015 * third
    q[c.SPINE_SIDE] = -1.5 * side_shift
    q[c.SPINE_TWIST] = 0.04 * fifth
    q[c.HEAD_PITCH] = 0.06 + 0.05 * second
    q[c.HEAD_YAW] = 0.12 * fifth + 0.08 * third
    q[c.SWIVEL], q[c.SWIVEL + 1] = 0.1, 0.1
    for side in range(2):
        wave = 0.04 * (third if side else fourth)
        hang(side, RELAXED_PITCH + wave, RELAXED_ELBOW + wave, me)
        q[c.HAND_SHARE + side] = 0.0
    q[c.HAND_TARGET : c.HAND_TARGET + 6] = q[c.PROP] = 0.0


@kernel
def lean(amount: float, squat: float, twist: float, me: Worker) -> None:
    """Bend the trunk forward (1: a deep bow), the pelvis going back, knees by `squat`, and turn."""
    q = me.q
    shift(q, c.ROOT_X, q[c.HEADING], -(0.07 + 0.10 * squat) * amount, 0.0)
    q[c.PELVIS_Z] -= (0.03 + 0.28 * squat) * amount
    q[c.PELVIS_PITCH] += (0.62 - 0.12 * squat) * amount
    q[c.SPINE_FLEX] += (0.72 - 0.25 * squat) * amount
    q[c.HEAD_PITCH] -= 0.45 * amount
    q[c.PELVIS_YAW] += 0.35 * twist
    q[c.SPINE_TWIST] += 0.65 * twist


@kernel
def beyond(me: Worker) -> float:
    """How far the targets in q lie beyond what the used arms reach from this posture [m]."""
    used = (me.q[c.HAND_SHARE], me.q[c.HAND_SHARE + 1])
    far = farthest(UPPER_ARM, me.q[c.HAND_TARGET :], used, me)
    return max(far - ARM_KNEE * me.size[ARM], -1.0)


@kernel
def farthest(segment: int, goals: Floats, used: Pair, me: Worker) -> float:
    """From a segment of the used arms, posed as q says, to the farther goal (6,) [m]; -1: none."""
    pose(me)
    far = -1.0
    for side in range(2):
        at, d = LEFT + SIDE_STRIDE * side + segment, 0.0
        for i in range(3):
            d += (goals[3 * side + i] - me.p[at, i]) ** 2
        if used[side] > 0.0:
            far = max(far, math.sqrt(d))
    return far


@kernel
def from_here(at: Triple, me: Worker) -> Triple:
    """A point ahead, left [m] of where the worker stands, at a height, in the world."""
    x, y = placed(me.start_x, me.start_y, me.start_yaw, at[0], at[1])
    return x, y, at[2]


@kernel
def from_root(ahead: float, left: float, me: Worker) -> Pair:
    """A point of the floor so far ahead and left of the root [m], as q has it."""
    q = me.q
    return placed(q[c.ROOT_X], q[c.ROOT_Y], q[c.HEADING], ahead, left)


@kernel
def look_at(x: float, y: float, z: float, share: float, me: Worker) -> None:
    """Turn the head to a point of the world, by a share; everything but the head stands in q."""
    q = me.q
    if share <= 0.0:
        return
    tilt = q[c.PELVIS_PITCH] + q[c.SPINE_FLEX]
    heading = q[c.HEADING] + q[c.PELVIS_YAW]
    tall = NECK_SHARE * me.size[STAND_Z]
    ahead = math.sin(0.6 * tilt) * tall
    dx = x - q[c.ROOT_X] - math.cos(heading) * ahead
    dy = y - q[c.ROOT_Y] - math.sin(heading) * ahead
    dz = z - q[c.PELVIS_Z] - math.cos(0.6 * tilt) * tall
    yaw = wrap(math.atan2(dy, dx) - heading - q[c.SPINE_TWIST])
    down = math.atan2(-dz, math.hypot(dx, dy)) - tilt
    limit = MOST_DOWN_RAD if down > 0.0 else MOST_UP_RAD
    yaw = MOST_YAW_RAD * math.tanh(HEAD_SHARE * yaw / MOST_YAW_RAD)
    down = limit * math.tanh(HEAD_SHARE * down / limit)
    q[c.HEAD_YAW] += share * (yaw - q[c.HEAD_YAW])
    q[c.HEAD_PITCH] += share * (down - q[c.HEAD_PITCH])
