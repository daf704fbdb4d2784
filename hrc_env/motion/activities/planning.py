"""Planning of work in place: where tool and hands go, how far the trunk, for how long."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.motion import controls as c
from hrc_env.motion.activities.strokes import PAUSE_S, stroke
from hrc_env.motion.activities.work import FRONT_LEG, REAR_LEG, extend, hands_on, step_into
from hrc_env.motion.anatomy import (
    ARM,
    CHEST,
    CLAVICLE,
    HAND,
    LEFT,
    LEG,
    SIDE_STRIDE,
    STAND_Z,
    UPPER_ARM,
)
from hrc_env.motion.feet import feet
from hrc_env.motion.holding import TWO_HANDED
from hrc_env.motion.kinematics import pose
from hrc_env.motion.posture import MOST_LEAN, beyond, stand
from hrc_env.motion.state import Worker

Triple = tuple[float, float, float]

TAKE_S = 0.55
"""For a hand to go to the belt [s]."""
KNEEL_S, CROUCH_S = 1.5, 1.1
"""To get down on a knee, on the haunches [s]; judgement."""
KNEEL_STEPS_S = (0.15, 0.62, 0.60)
"""First lift-off, period and swing of the steps onto a knee [s], slow or the knee would jerk."""
STEP_S = 0.9
"""To step into a stance [s]."""
CALM_M_S = 1.1
"""Peak speed of hands that go to their work [m/s]; calm manual work."""
KNEE_ASIDE_M = 0.17
"""Aside of the middle: where the other leg is not in the way [m]."""
SPARE_M = 0.03
"""Arms keep this much in hand when the trunk has settled [m]: bodies sway."""
TO_SHOULDER = (*range(1, CHEST + 1), LEFT + CLAVICLE, LEFT + UPPER_ARM)
"""The segments from the pelvis on, each the child of the one before."""
SLUMP_M = 0.01
"""How far a standing trunk brings the shoulders forward [m]."""
FAR = 1e3
"""A time by which every step is done [s]."""


@kernel
def between(draw: float, low: float, high: float) -> float:
    """A uniform draw in [0, 1) stretched to (low, high)."""
    return low + draw * (high - low)


@kernel
def dominant(draw: float, me: Worker) -> int:
    """The side that holds the tool: 1 right."""
    return 1 if draw < 0.5 + (me.right_handed - 0.5) * 1.25 else 0


@kernel
def blank(me: Worker) -> None:
    """A plan without steps and work of its own; what is carried stays."""
    me.lean = me.twist = me.squat = me.kneel = me.crouch = me.ahead = 0.0
    me.hold_s = me.take_s = me.wander_m = me.stroke_m = me.stroke_hz = me.burst_s = 0.0
    me.tool = me.side = me.stroke = 0
    me.target[:] = 0.0
    me.used[:] = 0.0
    me.hidden = False
    me.undo_at = me.step_count = 0.0
    me.step_start, me.step_period, me.step_swing = 0.0, 1.0, 0.5
    me.settle_s = 0.1
    me.out_at = 0.1


@kernel
def kneel_down(side: int, me: Worker) -> None:
    """Plan to kneel on the knee of that side."""
    leg = me.size[LEG]
    me.kneel, me.ahead = 1.0, -0.08
    me.settle_s, me.out_at = KNEEL_S, 0.4
    step_into(side, REAR_LEG * leg, FRONT_LEG * leg, 0.02, me)
    me.step_start, me.step_period, me.step_swing = KNEEL_STEPS_S


@kernel
def before_knee(me: Worker) -> float:
    """How far to the left the hands work of one who kneels: before the knee that is down [m]."""
    kneeling = me.kneel > 0.0
    return KNEE_ASIDE_M * (1.0 - 2.0 * me.step_first) if kneeling else 0.0


@kernel
def step_ahead(side: int, ahead: float, me: Worker) -> None:
    """Plan to work with the foot of that side a little ahead."""
    step_into(side, ahead, 0.0, 0.02, me)
    me.ahead, me.settle_s = 0.45 * ahead, STEP_S


@kernel
def world(ahead: float, left: float, z: float, me: Worker) -> Triple:
    """A point of the frame in which the worker stands."""
    cos, sin = math.cos(me.start_yaw), math.sin(me.start_yaw)
    return (
        me.start_x + cos * ahead - sin * left,
        me.start_y + sin * ahead + cos * left,
        z,
    )


@kernel
def shoulders(me: Worker) -> Triple:
    """Where the shoulders' joints of one who stands are: ahead of the root, aside, height [m]."""
    bones = me.bones
    ahead, aside, up = SLUMP_M, 0.0, me.size[STAND_Z]
    for segment in TO_SHOULDER:
        ahead += bones[segment, 0]
        aside += bones[segment, 1]
        up += bones[segment, 2]
    return ahead, aside, up


@kernel
def in_reach(share: float, one: float, other: float, me: Worker) -> float:
    """How far arms, stretched by a share, reach along an axis if so far along the others [m]."""
    reach = share * me.size[ARM]
    return math.sqrt(max(reach * reach - one * one - other * other, 0.0))


@kernel
def put_tool(tool: int, side: int, at: Triple, turn: Triple, me: Worker) -> None:
    """Plan where the tool is at work: ahead, left [m], height; yaw, pitch, roll."""
    me.tool, me.side = tool, side
    me.take_s = TAKE_S if tool > 0 else 0.0
    point = world(at[0], at[1], at[2], me)
    for i in range(3):
        me.tool_pose[i] = point[i]
        me.tool_pose[3 + i] = turn[i]
    me.tool_pose[3] += me.start_yaw
    if TWO_HANDED[tool]:
        me.used[0] = me.used[1] = 1.0


@kernel
def put_other(at: Triple, me: Worker) -> None:
    """Plan where the other hand works: ahead, left [m], height."""
    other = 1 - me.side
    point = world(at[0], at[1], at[2], me)
    for i in range(3):
        me.target[3 * other + i] = point[i]
    me.used[other] = 1.0


@kernel
def look_to(at: Triple, me: Worker) -> None:
    """Plan where the eyes are: ahead, left [m], height."""
    point = world(at[0], at[1], at[2], me)
    for i in range(3):
        me.gaze[i] = point[i]


@kernel
def strokes(kind: int, size_m: float, rate_hz: float, burst_s: float, n: int, me: Worker) -> None:
    """Plan n bursts of a stroke."""
    me.stroke, me.stroke_m, me.stroke_hz = kind, size_m, rate_hz
    me.burst_s, me.hold_s = burst_s, n * (burst_s + PAUSE_S)


@kernel
def at_work(me: Worker) -> None:
    """Fill q as it is in the middle of the work, before the first stroke."""
    feet(FAR, me)
    stand(me.start_x, me.start_y, me.start_yaw, 0.0, me)
    extend(1.0, 1.0, me)
    stroke(0.0, me)
    hands_on(1.0, 1.0, 1.0, me)


@kernel
def finish(peak_m_s: float, me: Worker) -> float:
    """Settle trunk and times of work whose hands, strokes and steps are planned; how long [s].

    No plan function calls it: each would be compiled with all of it once more.
    """
    side = me.side
    low = min(max((0.95 * me.size[STAND_Z] - me.tool_pose[2]) / 0.5, 0.0), 1.0)
    me.squat = 0.0 if me.kneel + me.crouch > 0.0 else 0.8 * low
    settle_lean(me)
    down_s = me.settle_s - me.out_at - me.take_s
    if me.kneel + me.crouch == 0.0:
        down_s = 0.35
    slowly = 1.7 if TWO_HANDED[me.tool] else 1.0
    me.out_s = max(1.875 * slowly * _way(side, me) / peak_m_s, down_s)
    done = me.out_at + me.take_s + me.out_s
    me.lasts = 2.0 * done + me.hold_s
    me.undo_at = 0.5 * me.lasts if me.step_count > 0.0 else 0.0
    return me.lasts


@kernel
def settle_lean(me: Worker) -> None:
    """Smallest lean that brings what the hands hold within reach; else that comes nearer."""
    low, high, me.lean = 0.0, MOST_LEAN, 0.0
    upright = _short(me)
    if upright <= 0.0:
        return
    far = upright
    for attempt in range(10):
        if attempt > 0:
            far = _short(me)
        if far > 0.0:
            low = me.lean
        else:
            high = me.lean
        me.lean = 0.5 * (low + high)
    me.lean = high
    far = _short(me)
    if far > 0.0:
        me.lean = 0.0 if upright < far else high
        _come_nearer(_short(me), me)


@kernel
def _short(me: Worker) -> float:
    """By how much an arm is too short for the work that is planned [m]."""
    at_work(me)
    used = (me.q[c.HAND_SHARE], me.q[c.HAND_SHARE + 1])
    spare = SPARE_M + 0.4 * abs(me.wander_m)
    return beyond(used, me) + spare


@kernel
def _come_nearer(far: float, me: Worker) -> None:
    """Move tool and targets towards the shoulders by what is out of reach, as `_short` says."""
    p = me.p
    x, y, z = p[CHEST, 0], p[CHEST, 1], p[CHEST, 2]
    dx, dy, dz = me.tool_pose[0] - x, me.tool_pose[1] - y, me.tool_pose[2] - z
    share = 1.15 * far / math.sqrt(dx * dx + dy * dy + dz * dz)
    other = 3 * (1 - me.side)
    for i, d in enumerate((dx, dy, dz)):
        me.tool_pose[i] -= share * d
        me.target[other + i] -= share * d


@kernel
def _way(side: int, me: Worker) -> float:
    """The longest way that a hand has from hanging, or from the belt, to its work [m]."""
    q, p = me.q, me.p
    at_work(me)
    way = 0.15
    goal = (q[c.HAND_TARGET], q[c.HAND_TARGET + 1], q[c.HAND_TARGET + 2])
    right = (q[c.HAND_TARGET + 3], q[c.HAND_TARGET + 4], q[c.HAND_TARGET + 5])
    used = (q[c.HAND_SHARE], q[c.HAND_SHARE + 1])
    stand(me.start_x, me.start_y, me.start_yaw, 0.0, me)
    extend(1.0, 0.0, me)
    pose(me)
    for hand in range(2):
        wrist = LEFT + SIDE_STRIDE * hand + HAND
        to = goal if hand == 0 else right
        d = 0.0
        for i in range(3):
            d += (to[i] - p[wrist, i]) ** 2
        if used[hand] > 0.0:
            way = max(way, math.sqrt(d) - 0.05)
    return way
