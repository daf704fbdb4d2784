"""Relaxed standing, and leaning of the trunk towards the targets of the hands."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Vector3
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ARM, FOREARM_GRIP, LEFT, SIDE_STRIDE, STAND_Z, UPPER_ARM
from hrc_env.motion.curves import move_point, shift, wrap
from hrc_env.motion.kinematics import ARM_KNEE, pose
from hrc_env.motion.points import Point, Sides
from hrc_env.motion.state import Worker

STANCE_HALF_WIDTH_M = 0.10
"""Half the distance between the ankles in standing [m], with the feet below the shoulders."""
TOE_OUT_RAD = 0.12
"""Outward turn of the feet in standing and walking [rad], about 7 degrees."""
SWAY_HZ = (0.11, 0.17, 0.29, 0.41, 0.23)
"""Frequencies of a standing person's sway [Hz], estimates without a common period."""
SHIFT_M = 0.018
"""Amplitude of the lateral weight shift [m]. The value is an estimate."""
RELAXED_PITCH = 0.02
"""Forward rotation of a hanging upper arm [rad]. The value is an estimate."""
RELAXED_ELBOW = 0.38
"""Bend of the elbow of a hanging arm [rad]. The value is an estimate."""
RELAXED_OUT = 0.26
"""Abduction of a hanging upper arm from the trunk [rad]. The value is an estimate."""
HAND_OUT_M = 0.05
"""Lateral distance of a hanging hand from its elbow [m], with which it clears broad hips.

The value is an estimate.
"""
MOST_LEAN = 1.3
"""Maximum lean, as defined in `lean`; a person would take a step instead of leaning further."""
NECK_SHARE = 0.70
"""Height of the eyes above the pelvis, divided by the pelvis height, in the worker models."""
HEAD_SHARE = 0.75
"""Fraction of a gaze shift that the head contributes (Freedman & Sparks 1997: 70-80 %)."""
MOST_YAW_RAD = 1.2
"""Maximum yaw of the head relative to the chest [rad].

The value is an estimate of the comfortable range.
"""
MOST_DOWN_RAD = 0.75
"""Maximum downward pitch of the head relative to the chest [rad].

The value is an estimate of the comfortable range.
"""
MOST_UP_RAD = 0.75
"""Maximum upward pitch of the head relative to the chest [rad].

The value is an estimate of the comfortable range.
"""


@kernel
def sway(clock_s: float, i: int, worker: Worker) -> float:
    """Return a slow sine wave in [-1, 1] with a phase of the worker.

    Args:
        clock_s: time since the episode began [s].
        i: index into `SWAY_HZ`.
        worker: record with the phases.
    """
    return math.sin(2.0 * math.pi * (SWAY_HZ[i] * clock_s + worker.phases[i]))


@kernel
def hang(side: int, pitch: float, elbow: float, worker: Worker) -> None:
    """Set the hand offset of a hanging arm.

    Args:
        side: 0 left, 1 right.
        pitch: forward rotation of the upper arm from the vertical [rad].
        elbow: bend of the elbow [rad].
        worker: record of the worker; its `q` is changed.
    """
    q = worker.q
    sign = 1.0 - 2.0 * side
    fore = worker.lengths[FOREARM_GRIP]
    upper = worker.lengths[ARM] - fore
    at = c.HAND_OFFSET + 3 * side
    cos, sin = math.cos(pitch), math.sin(pitch)
    both_cos, both_sin = math.cos(pitch + elbow), math.sin(pitch + elbow)
    q[at] = sin * upper + both_sin * fore
    q[at + 1] = sign * (RELAXED_OUT * upper + HAND_OUT_M)
    q[at + 2] = -(cos * upper * (1.0 - 0.5 * RELAXED_OUT * RELAXED_OUT) + both_cos * fore)


@kernel
def stand(x: float, y: float, yaw: float, clock_s: float, worker: Worker) -> None:
    """Compute the control vector of relaxed standing with sway and gaze shifts, except the feet.

    Args:
        x: world x of the root [m].
        y: world y of the root [m].
        yaw: heading [rad].
        clock_s: time since the episode began [s].
        worker: record of the worker; its `q` is written.
    """
    q = worker.q
    first, second, third = (
        sway(clock_s, 0, worker),
        sway(clock_s, 1, worker),
        sway(clock_s, 2, worker),
    )
    fourth, fifth = sway(clock_s, 3, worker), sway(clock_s, 4, worker)
    side_shift, ahead = SHIFT_M * (0.7 * first + 0.3 * third), 0.006 * fourth
    q[c.ROOT_X], q[c.ROOT_Y] = move_point(x, y, yaw, ahead, side_shift)
    q[c.HEADING], q[c.PELVIS_Z] = yaw, worker.lengths[STAND_Z]
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
        hang(side, RELAXED_PITCH + wave, RELAXED_ELBOW + wave, worker)
        q[c.HAND_SHARE + side] = 0.0
    q[c.HAND_TARGET : c.HAND_TARGET + 6] = q[c.PROP] = 0.0


@kernel
def lean(amount: float, squat: float, twist: float, worker: Worker) -> None:
    """Bend the trunk forward while the pelvis moves back, and twist it.

    Args:
        amount: lean, from 0 (upright) to 1 (a deep bow) and beyond.
        squat: fraction of the lean that is achieved by bending the knees.
        twist: twist of the trunk to the left [rad].
        worker: record of the worker; its `q` is changed.
    """
    q = worker.q
    shift(q, c.ROOT_X, q[c.HEADING], -(0.07 + 0.10 * squat) * amount, 0.0)
    q[c.PELVIS_Z] -= (0.03 + 0.28 * squat) * amount
    q[c.PELVIS_PITCH] += (0.62 - 0.12 * squat) * amount
    q[c.SPINE_FLEX] += (0.72 - 0.25 * squat) * amount
    q[c.HEAD_PITCH] -= 0.45 * amount
    q[c.PELVIS_YAW] += 0.35 * twist
    q[c.SPINE_TWIST] += 0.65 * twist


@kernel
def measure_overreach(worker: Worker) -> float:
    """Return the greatest distance of a hand's target beyond the reach of the arm [m]."""
    used = Sides(worker.q[c.HAND_SHARE], worker.q[c.HAND_SHARE + 1])
    far = find_farthest(UPPER_ARM, worker.q[c.HAND_TARGET :], used, worker)
    return max(far - ARM_KNEE * worker.lengths[ARM], -1.0)


@kernel
def find_farthest(segment: int, goals: Floats, used: Sides, worker: Worker) -> float:
    """Pose the body and return the greatest distance of a segment from its goal [m].

    Args:
        segment: segment of an arm, counted from the first of its side.
        goals: points in the world (6,), left and right [m].
        used: 1 for each arm that is considered, else 0; -1 is returned if neither is.
        worker: record with the control vector.
    """
    pose(worker)
    far = -1.0
    for side in range(2):
        at, d = LEFT + SIDE_STRIDE * side + segment, 0.0
        for i in range(3):
            d += (goals[3 * side + i] - worker.p[at, i]) ** 2
        if used[side] > 0.0:
            far = max(far, math.sqrt(d))
    return far


@kernel
def locate_ahead(ahead: float, left: float, height: float, worker: Worker) -> Vector3:
    """Return the world position of a point relative to the worker's pose before the activity.

    Args:
        ahead: distance along the heading [m].
        left: distance to the left [m].
        height: height above the floor [m].
        worker: record with the start pose.
    """
    x, y = move_point(worker.start_x, worker.start_y, worker.start_yaw, ahead, left)
    return Vector3(x, y, height)


@kernel
def locate_from_root(ahead: float, left: float, worker: Worker) -> Point:
    """Return the world position of a floor point relative to the root in the control vector.

    Args:
        ahead: distance along the heading [m].
        left: distance to the left [m].
        worker: record with the control vector.
    """
    q = worker.q
    return move_point(q[c.ROOT_X], q[c.ROOT_Y], q[c.HEADING], ahead, left)


@kernel
def look_at(x: float, y: float, z: float, share: float, worker: Worker) -> None:
    """Turn the head towards a point in the world; all other columns must have been set before.

    Args:
        x: world x of the point [m].
        y: world y of the point [m].
        z: world z of the point [m].
        share: fraction of the full turn.
        worker: record of the worker; its `q` is changed.
    """
    q = worker.q
    if share <= 0.0:
        return
    tilt = q[c.PELVIS_PITCH] + q[c.SPINE_FLEX]
    heading = q[c.HEADING] + q[c.PELVIS_YAW]
    tall = NECK_SHARE * worker.lengths[STAND_Z]
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
