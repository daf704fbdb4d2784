"""Planning of work in place: where tool and hands go, how far the trunk, for how long."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.motion import anatomy as an
from hrc_env.motion import controls as c
from hrc_env.motion.activities.strokes import PAUSE_S, stroke
from hrc_env.motion.activities.work import FRONT_LEG, LOW_M, REAR_LEG, extend, hands_on, step_into
from hrc_env.motion.feet import feet
from hrc_env.motion.holding import TWO_HANDED
from hrc_env.motion.posture import MOST_LEAN, beyond, farthest, from_here, stand
from hrc_env.motion.state import Triple, Worker

TAKE_S, STEP_S, KNEEL_S, CROUCH_S = 0.55, 0.9, 1.5, 1.1
"""To reach the belt, step into a stance, get down on a knee, on the haunches [s]; judgement."""
KNEEL_STEPS_S = (0.15, 0.62, 0.60)
"""First lift-off, period and swing of the steps onto a knee [s], slow or the knee would jerk."""
CALM_M_S = 1.1
"""Peak speed of hands that go to their work [m/s]; calm manual work."""
KNEE_ASIDE_M, SPARE_M, SLUMP_M = 0.17, 0.03, 0.01
"""Kneeling hands work so far aside of the other leg; arms keep so much in hand, for bodies sway;
a standing trunk brings shoulders so far forward [m]."""
TO_SHOULDER = (*range(1, an.CHEST + 1), an.LEFT + an.CLAVICLE, an.LEFT + an.UPPER_ARM)
"""The segments from the pelvis on, each the child of the one before."""
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
    me.hold_s = me.take_s = me.wander_m = me.down_m = me.stroke_m = me.stroke_hz = me.burst_s = 0.0
    me.tool = me.side = me.stroke = 0
    me.target[:] = me.used[:] = 0.0
    me.hidden = False
    me.undo_at = me.step_count = 0.0
    me.step_start, me.step_period, me.step_swing = 0.0, 1.0, 0.5
    me.settle_s = me.out_at = 0.1


@kernel
def begin(draw: float, me: Worker) -> tuple[int, float]:
    """A blank plan; the side that holds the tool, and 1 if that is the left one, else -1."""
    blank(me)
    side = dominant(draw, me)
    return side, 1.0 - 2.0 * side


@kernel
def kneel_down(side: int, me: Worker) -> None:
    """Plan to kneel on the knee of that side."""
    leg = me.size[an.LEG]
    me.kneel, me.ahead = 1.0, -0.08
    me.settle_s, me.out_at = KNEEL_S, 0.4
    step_into(side, REAR_LEG * leg, FRONT_LEG * leg, 0.02, me)
    me.step_start, me.step_period, me.step_swing = KNEEL_STEPS_S


@kernel
def before_knee(me: Worker) -> float:
    """How far to the left the hands work of one who kneels: before the knee that is down [m]."""
    return KNEE_ASIDE_M * (1.0 - 2.0 * me.step_first) if me.kneel > 0.0 else 0.0


@kernel
def step_ahead(side: int, ahead: float, me: Worker) -> None:
    """Plan to work with the foot of that side ahead."""
    step_into(side, ahead, 0.0, 0.02, me)
    me.ahead, me.settle_s = 0.45 * ahead, STEP_S


@kernel
def get_ready(z: float, knee: int, foot: int, ahead: float, me: Worker) -> float:
    """Plan to kneel for low work, else to step ahead; how far to the left hands work then [m]."""
    if z < LOW_M:
        kneel_down(knee, me)
    else:
        step_ahead(foot, ahead, me)
    return before_knee(me)


@kernel
def shoulders(me: Worker) -> Triple:
    """Where the shoulders' joints of one who stands are: ahead of the root, aside, height [m]."""
    bones = me.bones
    ahead, aside, up = SLUMP_M, 0.0, me.size[an.STAND_Z]
    for segment in TO_SHOULDER:
        ahead += bones[segment, 0]
        aside += bones[segment, 1]
        up += bones[segment, 2]
    return ahead, aside, up


@kernel
def in_reach(share: float, one: float, other: float, me: Worker) -> float:
    """How far arms, stretched by a share, reach along an axis if so far along the others [m]."""
    reach = share * me.size[an.ARM]
    return math.sqrt(max(reach * reach - one * one - other * other, 0.0))


@kernel
def put_tool(tool: int, side: int, at: Triple, turn: Triple, me: Worker) -> None:
    """Plan where the tool is at work: ahead, left [m], height; yaw, pitch, roll."""
    me.tool, me.side = tool, side
    me.take_s = TAKE_S if tool > 0 else 0.0
    pose = me.tool_pose
    pose[0], pose[1], pose[2] = from_here(at, me)
    pose[3], pose[4], pose[5] = turn[0] + me.start_yaw, turn[1], turn[2]
    if TWO_HANDED[tool]:
        me.used[0] = me.used[1] = 1.0


@kernel
def put_other(at: Triple, me: Worker) -> None:
    """Plan where the other hand works: ahead, left [m], height."""
    other = 1 - me.side
    target = me.target[3 * other :]
    target[0], target[1], target[2] = from_here(at, me)
    me.used[other] = 1.0


@kernel
def look_to(at: Triple, me: Worker) -> None:
    """Plan where the eyes are: ahead, left [m], height."""
    me.gaze[0], me.gaze[1], me.gaze[2] = from_here(at, me)


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
    low = min(max((0.95 * me.size[an.STAND_Z] - me.tool_pose[2]) / 0.5, 0.0), 1.0)
    is_down = me.kneel + me.crouch > 0.0
    me.squat = 0.0 if is_down else 0.8 * low
    settle_lean(me)
    down_s = me.settle_s - me.out_at - me.take_s if is_down else 0.35
    slowly = 1.7 if TWO_HANDED[me.tool] else 1.0
    me.out_s = max(1.875 * slowly * _way(me) / peak_m_s, down_s)
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
    for _ in range(9):
        me.lean = 0.5 * (low + high)
        if _short(me) > 0.0:
            low = me.lean
        else:
            high = me.lean
    me.lean = high
    far = _short(me)
    if far > 0.0:
        me.lean = 0.0 if upright < far else high
        _come_nearer(_short(me), me)


@kernel
def _short(me: Worker) -> float:
    """By how much an arm is too short for the work that is planned [m]."""
    at_work(me)
    return beyond(me) + (SPARE_M + 0.4 * abs(me.wander_m))


@kernel
def _come_nearer(far: float, me: Worker) -> None:
    """Move tool and targets towards the shoulders by what is out of reach, as `_short` says."""
    p = me.p
    pose, other = me.tool_pose, me.target[3 * (1 - me.side) :]
    dx, dy, dz = (pose[0] - p[an.CHEST, 0], pose[1] - p[an.CHEST, 1], pose[2] - p[an.CHEST, 2])
    share = 1.15 * far / math.sqrt(dx * dx + dy * dy + dz * dz)
    for i, d in enumerate((dx, dy, dz)):
        pose[i] -= share * d
        other[i] -= share * d


@kernel
def _way(me: Worker) -> float:
    """The longest way that a hand has from hanging, or from the belt, to its work [m]."""
    at_work(me)
    used, goal = (me.q[c.HAND_SHARE], me.q[c.HAND_SHARE + 1]), me.goals
    for i in range(6):
        goal[i] = me.q[c.HAND_TARGET + i]
    stand(me.start_x, me.start_y, me.start_yaw, 0.0, me)
    extend(1.0, 0.0, me)
    return max(0.15, farthest(an.HAND, goal, used, me) - 0.05)
