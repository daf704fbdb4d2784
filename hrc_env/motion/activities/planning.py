"""Plans of work in place: poses of tool and hands, lean of the trunk, and durations."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Vector3
from hrc_env.motion import anatomy as an
from hrc_env.motion import controls as c
from hrc_env.motion.activities.strokes import PAUSE_S, apply_stroke
from hrc_env.motion.activities.work import (
    FRONT_LEG,
    LOW_M,
    REAR_LEG,
    extend,
    place_hands,
    step_into,
)
from hrc_env.motion.feet import place_feet
from hrc_env.motion.holding import TWO_HANDED
from hrc_env.motion.points import Sides
from hrc_env.motion.posture import MOST_LEAN, find_farthest, locate_ahead, measure_overreach, stand
from hrc_env.motion.state import Worker

TAKE_S = 0.55
"""Time to take a tool from the belt [s]. The value is an estimate."""
STEP_S = 0.9
"""Time to step into a stance [s]. The value is an estimate."""
KNEEL_S = 1.5
"""Time to kneel down on one knee [s]. The value is an estimate."""
CROUCH_S = 1.1
"""Time to squat down [s]. The value is an estimate."""
KNEEL_STEP_AT_S = 0.15
"""Time of the first lift-off in kneeling down [s]."""
KNEEL_PERIOD_S = 0.62
"""Period of the steps in kneeling down [s], sufficiently long to avoid jerks of the knee."""
KNEEL_SWING_S = 0.60
"""Swing time of a foot in kneeling down [s]."""
CALM_M_S = 1.1
"""Peak speed of hands on their way to the work [m/s], typical of calm manual work."""
KNEE_ASIDE_M = 0.17
"""Lateral offset of a kneeling worker's hands, towards the lowered knee [m]."""
SPARE_M = 0.03
"""Reserve in the reach of the arms for the sway of the body [m]."""
SLUMP_M = 0.01
"""Forward displacement of the shoulders when standing [m]."""
TO_SHOULDER = (*range(1, an.CHEST + 1), an.LEFT + an.CLAVICLE, an.LEFT + an.UPPER_ARM)
"""Segments from the pelvis to the left shoulder, each of which is a child of the previous one."""
FAR = 1e3
"""Value of a time after all steps [s]."""


@kernel
def scale_draw(draw: float, low: float, high: float) -> float:
    """Scale a random number in [0, 1) to [low, high)."""
    return low + draw * (high - low)


@kernel
def choose_hand(draw: float, worker: Worker) -> int:
    """Choose the hand for the tool, 0 left or 1 right, by a random number in [0, 1)."""
    return 1 if draw < 0.5 + (worker.right_handed - 0.5) * 1.25 else 0


@kernel
def clear_plan(worker: Worker) -> None:
    """Clear the plan of steps and work, but keep that of a carried load."""
    worker.lean = worker.twist = worker.squat = worker.kneel = worker.crouch = worker.ahead = 0.0
    worker.hold_s = worker.take_s = worker.wander_m = worker.down_m = worker.stroke_m = (
        worker.stroke_hz
    ) = worker.burst_s = 0.0
    worker.tool = worker.side = worker.stroke = 0
    worker.target[:] = worker.hands_used[:] = 0.0
    worker.is_hidden = False
    worker.undo_at, worker.step_count = 0.0, 0
    worker.step_start, worker.step_period, worker.step_swing = 0.0, 1.0, 0.5
    worker.settle_s = worker.out_at = 0.1


@kernel
def begin_plan(draw: float, worker: Worker) -> int:
    """Clear the plan, and choose the hand for the tool by a random number in [0, 1).

    Returns:
        The hand: 0 left, 1 right.
    """
    clear_plan(worker)
    return choose_hand(draw, worker)


@kernel
def plan_kneeling(side: int, worker: Worker) -> None:
    """Plan to kneel on the knee of a side: 0 left, 1 right."""
    leg = worker.lengths[an.LEG]
    worker.kneel, worker.ahead = 1.0, -0.08
    worker.settle_s, worker.out_at = KNEEL_S, 0.4
    step_into(side, REAR_LEG * leg, FRONT_LEG * leg, 0.02, worker)
    worker.step_start, worker.step_period = KNEEL_STEP_AT_S, KNEEL_PERIOD_S
    worker.step_swing = KNEEL_SWING_S


@kernel
def offset_before_knee(worker: Worker) -> float:
    """Return the offset of the hands to the left [m].

    The hands of a kneeling worker work in front of the lowered knee; otherwise the offset is 0.
    """
    return KNEE_ASIDE_M * (1.0 - 2.0 * worker.step_first) if worker.kneel > 0.0 else 0.0


@kernel
def plan_step_ahead(side: int, ahead: float, worker: Worker) -> None:
    """Plan to work with the foot of a side (0 left, 1 right) set ahead by a distance [m]."""
    step_into(side, ahead, 0.0, 0.02, worker)
    worker.ahead, worker.settle_s = 0.45 * ahead, STEP_S


@kernel
def plan_stance(z: float, knee: int, foot: int, ahead: float, worker: Worker) -> float:
    """Plan to kneel for low work, and to step ahead for other work.

    Args:
        z: height of the work [m].
        knee: side of the knee that is lowered, 0 left, 1 right.
        foot: side of the foot that steps ahead, 0 left, 1 right.
        ahead: length of the step [m].
        worker: record into which the plan is written.

    Returns:
        The offset of the hands to the left [m].
    """
    if z < LOW_M:
        plan_kneeling(knee, worker)
    else:
        plan_step_ahead(foot, ahead, worker)
    return offset_before_knee(worker)


@kernel
def locate_shoulders(worker: Worker) -> Vector3:
    """Return the position of the left shoulder joint of a standing worker.

    Returns:
        The distances ahead of the root and to the left, and the height [m].
    """
    bones = worker.bones
    ahead, aside, up = SLUMP_M, 0.0, worker.lengths[an.STAND_Z]
    for segment in TO_SHOULDER:
        ahead += bones[segment, 0]
        aside += bones[segment, 1]
        up += bones[segment, 2]
    return Vector3(ahead, aside, up)


@kernel
def measure_reach(share: float, one: float, other: float, worker: Worker) -> float:
    """Return the reach of an arm along an axis, given the other coordinates of the target [m].

    Args:
        share: usable fraction of the arm's length.
        one: coordinate of the target, relative to the shoulder, along a second axis [m].
        other: coordinate of the target, relative to the shoulder, along the third axis [m].
        worker: record with the body dimensions.
    """
    reach = share * worker.lengths[an.ARM]
    return math.sqrt(max(reach * reach - one * one - other * other, 0.0))


@kernel
def plan_tool(tool: int, side: int, at: Vector3, turn: Vector3, worker: Worker) -> None:
    """Plan the pose of the tool at work.

    Args:
        tool: kind of the tool, an index into `PROPS`; 0 for empty hands.
        side: hand that holds the tool, 0 left, 1 right.
        at: position of the tool: ahead, to the left, height [m].
        turn: orientation of the tool: yaw from the heading, pitch, roll [rad].
        worker: record into which the plan is written.
    """
    worker.tool, worker.side = tool, side
    worker.take_s = TAKE_S if tool > 0 else 0.0
    pose = worker.tool_pose
    pose[0], pose[1], pose[2] = locate_ahead(at.x, at.y, at.z, worker)
    pose[3], pose[4], pose[5] = turn.x + worker.start_yaw, turn.y, turn.z
    if TWO_HANDED[tool]:
        worker.hands_used[0] = worker.hands_used[1] = 1.0


@kernel
def plan_other_hand(at: Vector3, worker: Worker) -> None:
    """Plan the target (ahead, to the left, height) of the hand without the tool [m]."""
    other = 1 - worker.side
    target = worker.target[3 * other :]
    target[0], target[1], target[2] = locate_ahead(at.x, at.y, at.z, worker)
    worker.hands_used[other] = 1.0


@kernel
def plan_gaze(at: Vector3, worker: Worker) -> None:
    """Plan the gaze of the worker at a point (ahead, to the left, height) [m]."""
    worker.gaze[0], worker.gaze[1], worker.gaze[2] = locate_ahead(at.x, at.y, at.z, worker)


@kernel
def plan_strokes(
    kind: int, size_m: float, rate_hz: float, burst_s: float, n: int, worker: Worker
) -> None:
    """Plan bursts of strokes.

    Args:
        kind: kind of stroke, one of the constants in `strokes`.
        size_m: size of a stroke [m].
        rate_hz: frequency of the strokes [Hz].
        burst_s: duration of a burst [s].
        n: number of bursts.
        worker: record into which the plan is written.
    """
    worker.stroke, worker.stroke_m, worker.stroke_hz = kind, size_m, rate_hz
    worker.burst_s, worker.hold_s = burst_s, n * (burst_s + PAUSE_S)


@kernel
def pose_at_work(worker: Worker) -> None:
    """Compute the control vector of the worker at work, before the first stroke."""
    place_feet(FAR, worker)
    stand(worker.start_x, worker.start_y, worker.start_yaw, 0.0, worker)
    extend(1.0, 1.0, worker)
    apply_stroke(0.0, worker)
    place_hands(1.0, 1.0, 1.0, worker)


@kernel
def finish_plan(peak_m_s: float, worker: Worker) -> float:
    """Complete the plan of work, given its hands, strokes and steps, by the lean and the durations.

    Plan functions do not call this kernel, because it would then be compiled again in each of them.

    Args:
        peak_m_s: peak speed of the hands on their way to the work [m/s].
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    low = min(max((0.95 * worker.lengths[an.STAND_Z] - worker.tool_pose[2]) / 0.5, 0.0), 1.0)
    is_down = worker.kneel + worker.crouch > 0.0
    worker.squat = 0.0 if is_down else 0.8 * low
    find_lean(worker)
    down_s = worker.settle_s - worker.out_at - worker.take_s if is_down else 0.35
    slowly = 1.7 if TWO_HANDED[worker.tool] else 1.0
    worker.out_s = max(1.875 * slowly * _measure_hand_way(worker) / peak_m_s, down_s)
    done = worker.out_at + worker.take_s + worker.out_s
    worker.total_s = 2.0 * done + worker.hold_s
    worker.undo_at = 0.5 * worker.total_s if worker.step_count > 0.0 else 0.0
    return worker.total_s


@kernel
def find_lean(worker: Worker) -> None:
    """Find the smallest lean with the work within reach; if there is none, move the work nearer."""
    low, high, worker.lean = 0.0, MOST_LEAN, 0.0
    upright = _measure_shortfall(worker)
    if upright <= 0.0:
        return
    for _ in range(9):
        worker.lean = 0.5 * (low + high)
        if _measure_shortfall(worker) > 0.0:
            low = worker.lean
        else:
            high = worker.lean
    worker.lean = high
    far = _measure_shortfall(worker)
    if far > 0.0:
        worker.lean = 0.0 if upright < far else high
        _move_nearer(_measure_shortfall(worker), worker)


@kernel
def _measure_shortfall(worker: Worker) -> float:
    """Return the distance by which an arm is too short for the planned work [m]."""
    pose_at_work(worker)
    return measure_overreach(worker) + (SPARE_M + 0.4 * abs(worker.wander_m))


@kernel
def _move_nearer(far: float, worker: Worker) -> None:
    """Move tool and targets towards the shoulders by a shortfall [m]."""
    p = worker.p
    pose, other = worker.tool_pose, worker.target[3 * (1 - worker.side) :]
    dx, dy, dz = (pose[0] - p[an.CHEST, 0], pose[1] - p[an.CHEST, 1], pose[2] - p[an.CHEST, 2])
    share = 1.15 * far / math.sqrt(dx * dx + dy * dy + dz * dz)
    for i, d in enumerate((dx, dy, dz)):
        pose[i] -= share * d
        other[i] -= share * d


@kernel
def _measure_hand_way(worker: Worker) -> float:
    """Return the greater of both hands' distances from initial position to target [m]."""
    pose_at_work(worker)
    used, goal = Sides(worker.q[c.HAND_SHARE], worker.q[c.HAND_SHARE + 1]), worker.goals
    for i in range(6):
        goal[i] = worker.q[c.HAND_TARGET + i]
    stand(worker.start_x, worker.start_y, worker.start_yaw, 0.0, worker)
    extend(1.0, 0.0, worker)
    return max(0.15, find_farthest(an.HAND, goal, used, worker) - 0.05)
