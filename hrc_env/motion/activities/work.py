"""Work in place: lower the body, take a tool from the belt, work, and reverse these movements."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.motion import controls as c
from hrc_env.motion.activities.strokes import apply_stroke
from hrc_env.motion.anatomy import ANKLE_Z, LEG, STAND_SHARE, STAND_Z, THIGH_LENGTH
from hrc_env.motion.curves import min_jerk, shift
from hrc_env.motion.feet import raise_heel
from hrc_env.motion.holding import GRIPS, TWO_HANDED, grip
from hrc_env.motion.posture import lean, locate_from_root, look_at
from hrc_env.motion.state import Worker

_X, _Y, _STRIDE_SHARE = 0, 1, 3
"""Columns of a footprint: world x and y [m], and step length as a fraction of a full stride."""
_SHORT_STEP_SHARE = 0.3
"""Length of the steps that widen a stance, as a fraction of a full stride.

The value is an estimate.
"""
GAZE_LEAD_S = 0.25
"""Time by which eyes and head lead the hand [s] (Land & Hayhoe 2001: up to half a second)."""
BELT_AHEAD_M = 0.10
"""Distance of a tool on the belt ahead of the pelvis [m]. The value is an estimate."""
BELT_SIDE_M = 0.29
"""Lateral distance of a tool on the belt from the pelvis [m]. The value is an estimate."""
BELT_UP_M = 0.06
"""Height of a tool on the belt above the pelvis [m]. The value is an estimate."""
BELT_PITCH_RAD = 1.3
"""Pitch of a tool on the belt [rad]. The value is an estimate."""
BELLY_AHEAD_M = 0.34
"""Distance from the pelvis at which the hand without a tool passes ahead of it [m].

The hand passes the body on its way to the floor.
"""
BELLY_SIDE_M = 0.06
"""Lateral distance from the pelvis at which the hand without a tool passes it [m]."""
BELLY_UP_M = 0.22
"""Height above the pelvis at which the hand without a tool passes it [m]."""
EARLY_SHARE = 0.55
"""Time at which the hands arrive, as a fraction of the time to lower the body.

The value is an estimate.
"""
JOIN_AT = 0.3
"""Fraction of the path to the work at which the second hand joins a tool.

The value is an estimate.
"""
DRAWN_SHARE = 0.6
"""Time at which a tape held in both hands is pulled out, as a fraction of the time to reach out.

The value is an estimate.
"""
ELBOWS_RAD = 0.25
"""Outward turn of the elbows at work [rad]. The value is an estimate."""
LOW_ELBOWS_RAD = 0.4
"""Outward turn of the elbows at floor height [rad]. The value is an estimate."""
RISE = 0.5
"""Forward bulge of a hand's path to high work, divided by the height of the work."""
OVER_KNEE_M = 0.22
"""Bulge of a hand's path over the knees to low work [m]."""
LOW_M = 0.6
"""Height below which work is considered low [m]."""
KNEE_M = 0.055
"""Height of the knee joint in kneeling [m]."""
HAUNCH_SHARE = 0.46
"""Height of the pelvis in a full squat, as a fraction of its height in standing."""
KNEEL_HEEL_RAD = 1.2
"""Pitch of the rear foot in kneeling, with the heel up [rad]. The value is an estimate."""
HAUNCH_HEEL_RAD = 0.55
"""Pitch of both feet in a full squat, with the heels up [rad]. The value is an estimate."""
FRONT_LEG = 0.38
"""Forward step of a kneeling worker's front foot from its stance, in leg lengths."""
REAR_LEG = -0.72
"""Forward step of a kneeling worker's rear foot from its stance, in leg lengths."""
STEP_AT_S = 0.08
"""Time of the first step that widens a stance [s]."""
STEP_PERIOD_S = 0.42
"""Period of the steps that widen a stance [s]."""
STEP_SWING_S = 0.38
"""Swing time of a step that widens a stance [s]."""


@kernel
def get_down(down: float, worker: Worker) -> None:
    """Lower a standing body to a degree from 0 to 1, and raise its heels."""
    q = worker.q
    shift(q, c.ROOT_X, q[c.HEADING], worker.ahead * down, 0.0)
    kneel, crouch = worker.kneel * down, worker.crouch * down
    if kneel > 0.0:
        over = worker.lengths[STAND_Z] - worker.lengths[ANKLE_Z] - STAND_SHARE * worker.lengths[LEG]
        low = KNEE_M + worker.lengths[THIGH_LENGTH] + over
        q[c.PELVIS_Z] += kneel * (low - worker.lengths[STAND_Z])
        q[c.PELVIS_PITCH] += 0.06 * kneel
        raise_heel(worker.step_first, KNEEL_HEEL_RAD * kneel * kneel, worker)
    if crouch > 0.0:
        q[c.PELVIS_Z] -= crouch * (1.0 - HAUNCH_SHARE) * worker.lengths[STAND_Z]
        q[c.PELVIS_PITCH] += 0.25 * crouch
        q[c.SPINE_FLEX] += 0.40 * crouch
        for side in range(2):
            raise_heel(side, HAUNCH_HEEL_RAD * crouch, worker)


@kernel
def step_into(
    first: int, first_m: float, second_m: float, outward_m: float, worker: Worker
) -> None:
    """Plan a step of one foot, then optionally a step of the other foot.

    Each foot moves from its footprint in `worker.stance`; displacements are relative to the initial
    heading.

    Args:
        first: foot of the first step, 0 left, 1 right.
        first_m: forward displacement of the first foot [m]; negative for a backward step.
        second_m: forward displacement of the other foot [m]; 0 for no step.
        outward_m: displacement of each foot away from the body's midline [m].
        worker: record into which step times and both footprints in the world frame are written.
    """
    cos, sin = math.cos(worker.start_yaw), math.sin(worker.start_yaw)
    worker.step_start, worker.step_period = STEP_AT_S, STEP_PERIOD_S
    worker.step_swing = STEP_SWING_S
    worker.step_first, worker.step_count = first, 1 if second_m == 0.0 else 2
    for step in range(2):
        side = (first + step) % 2
        sign = 1.0 - 2.0 * side  # 1 on the left, -1 on the right
        forward_m, left_m = (second_m if step else first_m), sign * outward_m
        stance, footprint = worker.stance[side], worker.footprints[step]
        for column in range(len(footprint)):
            footprint[column] = stance[column]
        footprint[_X] += cos * forward_m - sin * left_m
        footprint[_Y] += sin * forward_m + cos * left_m
        footprint[_STRIDE_SHARE] = _SHORT_STEP_SHARE


@kernel
def extend(down: float, out: float, worker: Worker) -> None:
    """Lower a standing body, and move the tool from the belt to the work.

    Args:
        down: degree to which the body is lowered, from 0 to 1.
        out: degree to which the hands have reached out, from 0 to 1.
        worker: record with the plan; its `q` is changed.
    """
    q, at = worker.q, c.PROP_POSE
    get_down(down, worker)
    q[at], q[at + 1] = locate_from_root(
        BELT_AHEAD_M, (1.0 - 2.0 * worker.side) * BELT_SIDE_M, worker
    )
    q[at + 2] = q[c.PELVIS_Z] + BELT_UP_M
    q[at + 3], q[at + 4], q[at + 5] = q[c.HEADING], BELT_PITCH_RAD, 0.0
    lean(worker.lean * out, worker.squat, worker.twist * out, worker)
    for i in range(6):
        q[at + i] += out * (worker.tool_pose[i] - q[at + i])
    _bulge_way(at, worker.tool_pose[2], out, worker)


@kernel
def _bulge_way(at: int, goal_z: float, out: float, worker: Worker) -> None:
    """Add a bulge around shoulder or knee to the path of a point in the control vector.

    Args:
        at: column of the point's x.
        goal_z: height of the point's goal [m].
        out: completed fraction of the path.
        worker: record of the worker; its `q` is changed.
    """
    q = worker.q
    high = RISE * max(goal_z - q[c.PELVIS_Z] - 0.3, 0.0)
    bulge = max(high, OVER_KNEE_M if goal_z < LOW_M else 0.0) * 4.0 * out * (1.0 - out)
    shift(q, at, q[c.HEADING], bulge, 0.0)
    q[at + 2] += bulge if goal_z < LOW_M else 0.0


@kernel
def place_hands(out: float, taken: float, early: float, worker: Worker) -> None:
    """Set the targets of the hand with the tool and of the other hand.

    Args:
        out: completed fraction of the path of the tool from the belt to the work.
        taken: weight with which the hand follows the tool, from 0 to 1.
        early: weight of the hands' targets while the body is lowered, from 0 to 1.
        worker: record with the plan; its `q` is changed.
    """
    q, side, tool = worker.q, worker.side, worker.tool
    other, both = 1 - side, TWO_HANDED[tool]
    low = worker.tool_pose[2] < LOW_M and not both
    for hand in range(2):
        at = c.HAND_TARGET + 3 * hand
        if hand == side or both:
            grip_row = hand if both else 1
            grip(
                hand,
                GRIPS[tool, grip_row, 0],
                GRIPS[tool, grip_row, 1],
                GRIPS[tool, grip_row, 2],
                worker,
            )
        else:
            for i in range(3):
                q[at + i] += worker.target[3 * other + i]
            if low:
                _pass_belly(hand, at, 1.0 - out, worker)
            _bulge_way(at, worker.target[3 * other + 2], out, worker)
    for hand in range(2):
        q[c.SWIVEL + hand] += LOW_ELBOWS_RAD * early if low else ELBOWS_RAD * out
    q[c.HAND_SHARE + side] = max(taken, early) if low else taken
    joined = early if low else out
    if both and taken != out:
        joined = min_jerk((out - JOIN_AT) / (1.0 - JOIN_AT))
    q[c.HAND_SHARE + other] = joined * worker.hands_used[other]


@kernel
def _pass_belly(hand: int, at: int, share: float, worker: Worker) -> None:
    """Move the target of a hand back over the thighs to a point in front of the belly.

    Args:
        hand: 0 left, 1 right.
        at: column of the target's x.
        share: fraction of the full movement.
        worker: record of the worker; its `q` is changed.
    """
    q, goal = worker.q, worker.target[3 * hand : 3 * hand + 3]
    x, y = locate_from_root(BELLY_AHEAD_M, (1.0 - 2.0 * hand) * BELLY_SIDE_M, worker)
    q[at] += share * (x - goal[0])
    q[at + 1] += share * (y - goal[1])
    q[at + 2] += share * (q[c.PELVIS_Z] + BELLY_UP_M - goal[2])


@kernel
def work(t: float, worker: Worker) -> None:
    """Add work in place, with a tool or with empty hands, to the pose of a standing worker.

    Args:
        t: time since the activity began [s].
        worker: record with the plan; its `q`, a relaxed stance, is changed.
    """
    near_end = min(t, worker.total_s - t)
    down = min_jerk(near_end / worker.settle_s)
    since = near_end - worker.out_at - worker.take_s
    out = min_jerk(since / worker.out_s)
    taken = min_jerk(1.0 + since / worker.take_s) if worker.take_s > 0.0 else out
    extend(down, out, worker)
    working = t - worker.out_at - worker.take_s - worker.out_s
    if out < 1.0:
        working = 0.0 if working < 0.0 else worker.hold_s
    apply_stroke(working, worker)
    place_hands(out, taken, min_jerk(near_end / (EARLY_SHARE * worker.settle_s)), worker)
    drawn = DRAWN_SHARE * worker.out_s if TWO_HANDED[worker.tool] else 0.0
    worker.q[c.PROP] = worker.tool if since >= drawn else 0.0
    looking = min_jerk((since + GAZE_LEAD_S) / 0.6)
    look_at(worker.gaze[0], worker.gaze[1], worker.gaze[2], looking, worker)
