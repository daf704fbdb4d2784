"""Reaching and lifting, with the hands at targets and the trunk leaning as far as necessary."""

import math
from typing import NamedTuple

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Vector3
from hrc_env.motion import controls as c
from hrc_env.motion.activities.work import GAZE_LEAD_S
from hrc_env.motion.anatomy import ARM, HAND, LEFT, SIDE_STRIDE, UPPER_ARM
from hrc_env.motion.curves import hump, min_jerk, shift
from hrc_env.motion.kinematics import ARM_KNEE
from hrc_env.motion.points import Sides
from hrc_env.motion.posture import (
    MOST_LEAN,
    find_farthest,
    lean,
    locate_ahead,
    measure_overreach,
    stand,
)
from hrc_env.motion.state import Worker

SPARE_LEAN = 0.04
"""Additional lean beyond the minimum, to compensate for the sway of a standing body."""
CARRY_FORWARD_M = 0.36
"""Distance of a lifted load ahead of the root [m]. The value is an estimate."""
CARRY_Z_M = 1.05
"""Height of a lifted load [m]. The value is an estimate."""
LOAD_HALF_WIDTH_M = 0.20
"""Half the width of a lifted load [m]. The value is an estimate."""


class LiftTimes(NamedTuple):
    """Durations of the phases of lifting a load and putting it back."""

    bend_s: float
    """Time to bend down, and time to straighten up [s]."""
    raise_s: float
    """Time to raise the load, and time to lower it [s]."""
    carry_s: float
    """Time for which the load is held up [s]."""


@kernel
def _turn_head(share: float, worker: Worker) -> None:
    """Turn the head towards the work, by the fraction `share` of the full turn."""
    worker.q[c.HEAD_YAW] += share * (worker.gaze_yaw - worker.q[c.HEAD_YAW])
    worker.q[c.HEAD_PITCH] += share * worker.gaze_pitch


@kernel
def _extend(out: float, worker: Worker) -> None:
    """Set hands and trunk to the fraction `out` of a reach."""
    q = worker.q
    lean(worker.lean * out, worker.squat, worker.twist * out, worker)
    for i in range(6):
        q[c.HAND_TARGET + i] = worker.target[i]
    q[c.HAND_SHARE] = out * worker.hands_used[0]
    q[c.HAND_SHARE + 1] = out * worker.hands_used[1]


@kernel
def reach(t: float, worker: Worker) -> None:
    """Add a reach to the pose of a standing worker: reach out, work at the target, withdraw.

    Args:
        t: time since the reach began [s].
        worker: record with the plan; its `q`, a relaxed stance, is changed.
    """
    q = worker.q
    there = worker.out_at + worker.out_s
    leave = there + worker.hold_s
    out = min_jerk((t - worker.out_at) / worker.out_s)
    out -= min_jerk((t - leave) / worker.back_s)
    _extend(out, worker)
    looking = min_jerk((t - worker.out_at + GAZE_LEAD_S) / 0.6) - min_jerk((t - leave) / 0.7)
    _turn_head(looking, worker)
    busy = worker.fidget_m * hump((t - there) / worker.hold_s)
    if busy > 0.0:
        beat = 2.0 * math.pi * worker.fidget_hz * (t - there)
        for side in range(2):
            q[c.HAND_TARGET + 3 * side] += busy * math.sin(beat + side)
            q[c.HAND_TARGET + 3 * side + 1] += busy * math.cos(0.7 * beat)
            q[c.HAND_TARGET + 3 * side + 2] += 0.5 * busy * math.sin(1.3 * beat + 2.0 * side)


@kernel
def lift(t: float, worker: Worker) -> None:
    """Add a lift to the pose of a standing worker: raise a load, hold it, put it back.

    Args:
        t: time since the lift began [s].
        worker: record with the plan; its `q`, a relaxed stance, is changed.
    """
    q = worker.q
    grip = worker.out_at + worker.out_s
    rise = grip + worker.hold_s
    lower = rise + worker.raise_s + worker.carry_s
    leave = lower + worker.raise_s + worker.hold_s
    down = min_jerk((t - worker.out_at) / worker.out_s)
    up = min_jerk((t - rise) / worker.raise_s) - min_jerk((t - lower) / worker.raise_s)
    away = min_jerk((t - leave) / worker.back_s)
    lean(worker.lean * (down - up - away), worker.squat, 0.0, worker)
    _turn_head(down - 0.6 * up - away, worker)
    for i in range(6):
        q[c.HAND_TARGET + i] = worker.target[i] + up * (worker.raised[i] - worker.target[i])
    for side in range(2):
        shift(q, c.HAND_TARGET + 3 * side, worker.start_yaw, 0.06 * hump(up), 0.0)
        q[c.HAND_SHARE + side] = down - away


@kernel
def _find_lean(worker: Worker) -> None:
    """Find the smallest lean with the targets within reach.

    Targets out of reach at the maximum lean are moved nearer.
    """
    p = worker.p
    low, high, worker.lean = 0.0, MOST_LEAN, 0.0
    for attempt in range(12):
        stand(worker.start_x, worker.start_y, worker.start_yaw, 0.0, worker)
        _extend(1.0, worker)
        far = measure_overreach(worker)
        if attempt == 0 and far <= 0.0:
            return
        if far > 0.0:  # `low` is unchanged at the first attempt
            low = worker.lean
        else:
            high = worker.lean
        worker.lean = 0.5 * (low + high)
    worker.lean = high + SPARE_LEAN
    if high < MOST_LEAN:
        return
    for side in range(2):
        upper = LEFT + SIDE_STRIDE * side + UPPER_ARM
        target, squared = worker.target[3 * side : 3 * side + 3], 0.0
        for i in range(3):
            squared += (target[i] - p[upper, i]) ** 2
        nearer = min(1.0, ARM_KNEE * worker.lengths[ARM] / math.sqrt(squared))
        for i in range(3):
            target[i] = p[upper, i] + nearer * (target[i] - p[upper, i])


@kernel
def plan_reach(
    target: Vector3,
    used: Sides,
    peak_m_s: float,
    hold_s: float,
    fidget_m: float,
    fidget_hz: float,
    worker: Worker,
) -> float:
    """Plan a reach to a point with one hand or both hands.

    Args:
        target: point in the world [m].
        used: 1 for each hand that reaches, else 0.
        peak_m_s: peak speed of the hand [m/s].
        hold_s: time for which the hands work at the point [s].
        fidget_m: amplitude of small movements at the point [m].
        fidget_hz: frequency of small movements at the point [Hz].
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    yaw = worker.start_yaw
    cos, sin = math.cos(yaw), math.sin(yaw)
    dx, dy = target.x - worker.start_x, target.y - worker.start_y
    ahead, left = cos * dx + sin * dy, -sin * dx + cos * dy
    apart = 0.12 if used.left > 0.0 and used.right > 0.0 else 0.0
    for side in range(2):
        at = worker.target[3 * side :]
        aside = left + (1.0 - 2.0 * side) * apart
        at[0], at[1], at[2] = locate_ahead(ahead, aside, target.z, worker)
    worker.hands_used[0], worker.hands_used[1] = used.left, used.right
    azimuth = math.atan2(left, max(ahead, 0.2))
    stretch = min(max((math.hypot(ahead, left) - 0.4) / 0.35, 0.0), 1.0)
    worker.twist = 0.6 * azimuth + 0.3 * stretch * (used.right - used.left)
    worker.squat = min(max((0.95 - target.z) / 0.5, 0.0), 1.0)
    worker.gaze_yaw = 0.5 * azimuth - 0.5 * worker.twist
    worker.gaze_pitch = 0.25 + 0.4 * min(max(1.4 - target.z, -0.3), 0.6)
    _find_lean(worker)
    stand(worker.start_x, worker.start_y, worker.start_yaw, 0.0, worker)
    way = max(0.1, find_farthest(HAND, worker.target, used, worker))
    worker.out_s = max(1.875 * way / peak_m_s, 0.3)
    worker.back_s = max(1.875 * way / min(peak_m_s, 1.2), 0.45)
    worker.hold_s = hold_s
    worker.fidget_m, worker.fidget_hz = fidget_m, fidget_hz
    return worker.out_at + worker.out_s + hold_s + worker.back_s + 0.05


@kernel
def plan_lift(ahead: float, z: float, times: LiftTimes, worker: Worker) -> float:
    """Plan a lift with both hands: raise a load, hold it and put it back.

    Args:
        ahead: distance of the load ahead of the feet [m].
        z: height of the load's grips [m].
        times: times to bend, raise and hold.
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    for side in range(2):
        left = (1.0 - 2.0 * side) * LOAD_HALF_WIDTH_M
        at, up = worker.target[3 * side :], worker.raised[3 * side :]
        at[0], at[1], at[2] = locate_ahead(ahead, left, z, worker)
        up[0], up[1], up[2] = locate_ahead(CARRY_FORWARD_M, left, CARRY_Z_M, worker)
    worker.twist, worker.gaze_yaw, worker.gaze_pitch = 0.0, 0.0, 0.25
    worker.squat = worker.squat_share
    worker.hands_used[0], worker.hands_used[1] = 1.0, 1.0
    _find_lean(worker)
    worker.out_s, worker.back_s, worker.hold_s = times.bend_s, times.bend_s, 0.3
    worker.raise_s, worker.carry_s = times.raise_s, times.carry_s
    raising = 2.0 * (worker.hold_s + worker.raise_s) + worker.carry_s
    return worker.out_at + worker.out_s + raising + worker.back_s + 0.05
