"""Work in place: get down to it, take a tool from the belt, work, and all of it backwards."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.motion import controls as c
from hrc_env.motion.activities.strokes import stroke
from hrc_env.motion.anatomy import ANKLE_Z, LEG, STAND_SHARE, STAND_Z, THIGH_LENGTH
from hrc_env.motion.curves import min_jerk, shift
from hrc_env.motion.feet import raise_heel
from hrc_env.motion.holding import GRIPS, TWO_HANDED, grip
from hrc_env.motion.posture import from_root, lean, look_at
from hrc_env.motion.state import Worker

GAZE_LEAD_S = 0.25
"""Eyes and head set off before the hand (Land & Hayhoe 2001: about half a second at most)."""
BELT_AHEAD_M, BELT_SIDE_M, BELT_UP_M, BELT_PITCH_RAD = 0.10, 0.29, 0.06, 1.3
"""Where a tool hangs, from the pelvis [m], and how it points; judgement."""
BELLY_AHEAD_M, BELLY_SIDE_M, BELLY_UP_M = 0.34, 0.06, 0.22
"""Where the other hand is on its way down to the floor, from the pelvis [m]; judgement."""
EARLY_SHARE, JOIN_AT, DRAWN_SHARE = 0.55, 0.3, 0.6
"""Share of getting down in which hands come before the body; shares of the way at which a second
hand comes to a tool, and what both draw out is out; judgement."""
ELBOWS_RAD, LOW_ELBOWS_RAD = 0.25, 0.4
"""How far elbows are turned outwards at work, and at floor height; judgement."""
RISE, OVER_KNEE_M, LOW_M = 0.5, 0.22, 0.6
"""Hands go up by this share of the height, and over the knees to work below LOW_M [m]."""
KNEE_M, HAUNCH_SHARE = 0.055, 0.46
"""Height of a kneeling knee's joint [m]; of the pelvis on the haunches, beside standing."""
KNEEL_HEEL_RAD, HAUNCH_HEEL_RAD = 1.2, 0.55
"""How far the heel goes up of a kneeling foot, of both on the haunches; judgement."""
FRONT_LEG, REAR_LEG = 0.38, -0.72
"""Kneeling feet ahead of where they stood, in lengths of the leg; from the two shanks' lie."""
STEP_S = (0.08, 0.42, 0.38)
"""First lift-off, period and swing of the steps that widen a stance [s]."""


@kernel
def get_down(down: float, me: Worker) -> None:
    """Lower a standing body by the share `down`, heels included; the feet's steps are planned."""
    q = me.q
    shift(q, c.ROOT_X, q[c.HEADING], me.ahead * down, 0.0)
    kneel, crouch = me.kneel * down, me.crouch * down
    if kneel > 0.0:
        over = me.size[STAND_Z] - me.size[ANKLE_Z] - STAND_SHARE * me.size[LEG]
        low = KNEE_M + me.size[THIGH_LENGTH] + over
        q[c.PELVIS_Z] += kneel * (low - me.size[STAND_Z])
        q[c.PELVIS_PITCH] += 0.06 * kneel
        raise_heel(me.step_first, KNEEL_HEEL_RAD * kneel * kneel, me)
    if crouch > 0.0:
        q[c.PELVIS_Z] -= crouch * (1.0 - HAUNCH_SHARE) * me.size[STAND_Z]
        q[c.PELVIS_PITCH] += 0.25 * crouch
        q[c.SPINE_FLEX] += 0.40 * crouch
        for side in range(2):
            raise_heel(side, HAUNCH_HEEL_RAD * crouch, me)


@kernel
def step_into(first: int, ahead: float, other: float, out: float, me: Worker) -> None:
    """Plan a step of foot `first` forward, one of the other (unless 0), both `out` [m] sideways."""
    cos, sin = math.cos(me.start_yaw), math.sin(me.start_yaw)
    me.step_start, me.step_period, me.step_swing = STEP_S
    me.step_first, me.step_count = first, 1 if other == 0.0 else 2
    for k in range(2):
        side = (first + k) % 2
        forward, left = (other if k else ahead), (1.0 - 2.0 * side) * out
        for i in range(5):
            me.prints[k, i] = me.stance[side, i]
        me.prints[k, 0] += cos * forward - sin * left
        me.prints[k, 1] += sin * forward + cos * left
        me.prints[k, 3] = 0.3


@kernel
def extend(down: float, out: float, me: Worker) -> None:
    """A standing body's q at a share of getting down, and of reaching out to the work from there,
    with the tool from the belt."""
    q, at = me.q, c.PROP_POSE
    get_down(down, me)
    q[at], q[at + 1] = from_root(BELT_AHEAD_M, (1.0 - 2.0 * me.side) * BELT_SIDE_M, me)
    q[at + 2] = q[c.PELVIS_Z] + BELT_UP_M
    q[at + 3], q[at + 4], q[at + 5] = q[c.HEADING], BELT_PITCH_RAD, 0.0
    lean(me.lean * out, me.squat, me.twist * out, me)
    for i in range(6):
        q[at + i] += out * (me.tool_pose[i] - q[at + i])
    _round(at, me.tool_pose[2], out, me)


@kernel
def _round(at: int, goal_z: float, out: float, me: Worker) -> None:
    """Send q[at:], on its way out to a height, round shoulder or knee."""
    q = me.q
    high = RISE * max(goal_z - q[c.PELVIS_Z] - 0.3, 0.0)
    bulge = max(high, OVER_KNEE_M if goal_z < LOW_M else 0.0) * 4.0 * out * (1.0 - out)
    shift(q, at, q[c.HEADING], bulge, 0.0)
    q[at + 2] += bulge if goal_z < LOW_M else 0.0


@kernel
def hands_on(out: float, taken: float, early: float, me: Worker) -> None:
    """Send the tool's hand to the tool, the other to its target; both before the body (`early`)."""
    q, side, tool = me.q, me.side, me.tool
    other, both = 1 - side, TWO_HANDED[tool]
    low = me.tool_pose[2] < LOW_M and not both
    for hand in range(2):
        at = c.HAND_TARGET + 3 * hand
        if hand == side or both:
            of = hand if both else 1
            grip(hand, GRIPS[tool, of, 0], GRIPS[tool, of, 1], GRIPS[tool, of, 2], me)
        else:
            for i in range(3):
                q[at + i] += me.target[3 * other + i]
            if low:
                _from_belly(hand, at, 1.0 - out, me)
            _round(at, me.target[3 * other + 2], out, me)
    for hand in range(2):
        q[c.SWIVEL + hand] += LOW_ELBOWS_RAD * early if low else ELBOWS_RAD * out
    q[c.HAND_SHARE + side] = max(taken, early) if low else taken
    joined = early if low else out
    if both and taken != out:
        joined = min_jerk((out - JOIN_AT) / (1.0 - JOIN_AT))
    q[c.HAND_SHARE + other] = joined * me.used[other]


@kernel
def _from_belly(hand: int, at: int, share: float, me: Worker) -> None:
    """Bring the target q[at:] of a hand back to before the belly by a share: over the thighs."""
    q, goal = me.q, me.target[3 * hand : 3 * hand + 3]
    x, y = from_root(BELLY_AHEAD_M, (1.0 - 2.0 * hand) * BELLY_SIDE_M, me)
    q[at] += share * (x - goal[0])
    q[at + 1] += share * (y - goal[1])
    q[at + 2] += share * (q[c.PELVIS_Z] + BELLY_UP_M - goal[2])


@kernel
def work(t: float, me: Worker) -> None:
    """Let a standing q work in place with a tool, or empty hands."""
    near_end = min(t, me.lasts - t)
    down = min_jerk(near_end / me.settle_s)
    since = near_end - me.out_at - me.take_s
    out = min_jerk(since / me.out_s)
    taken = min_jerk(1.0 + since / me.take_s) if me.take_s > 0.0 else out
    extend(down, out, me)
    working = t - me.out_at - me.take_s - me.out_s
    if out < 1.0:
        working = 0.0 if working < 0.0 else me.hold_s
    stroke(working, me)
    hands_on(out, taken, min_jerk(near_end / (EARLY_SHARE * me.settle_s)), me)
    drawn = DRAWN_SHARE * me.out_s if TWO_HANDED[me.tool] else 0.0
    me.q[c.PROP] = me.tool if since >= drawn else 0.0
    looking = min_jerk((since + GAZE_LEAD_S) / 0.6)
    look_at(me.gaze[0], me.gaze[1], me.gaze[2], looking, me)
