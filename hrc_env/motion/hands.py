"""Reaching and lifting: hands go to targets, the trunk follows as far as it must."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.motion import controls as c
from hrc_env.motion.activities.work import GAZE_LEAD_S
from hrc_env.motion.anatomy import ARM, HAND, LEFT, SIDE_STRIDE, UPPER_ARM
from hrc_env.motion.curves import hump, min_jerk, shift
from hrc_env.motion.kinematics import ARM_KNEE
from hrc_env.motion.posture import MOST_LEAN, beyond, farthest, from_here, lean, stand
from hrc_env.motion.state import Pair, Triple, Worker

SPARE_LEAN = 0.04
"""Lean beyond the least, because the sway of a standing body may take as much away."""
CARRY_FORWARD_M, CARRY_Z_M, LOAD_HALF_WIDTH_M = 0.36, 1.05, 0.20
"""A load held up: ahead of the root, its height, half its width [m]; judgement."""


@kernel
def _look(share: float, me: Worker) -> None:
    """Turn the head to the work."""
    me.q[c.HEAD_YAW] += share * (me.gaze_yaw - me.q[c.HEAD_YAW])
    me.q[c.HEAD_PITCH] += share * me.gaze_pitch


@kernel
def _extend(out: float, me: Worker) -> None:
    """Hands and trunk at share `out` of a reach."""
    q = me.q
    lean(me.lean * out, me.squat, me.twist * out, me)
    for i in range(6):
        q[c.HAND_TARGET + i] = me.target[i]
    q[c.HAND_SHARE] = out * me.used[0]
    q[c.HAND_SHARE + 1] = out * me.used[1]


@kernel
def reach(t: float, me: Worker) -> None:
    """Let a standing q reach out, work there, and take the hands back."""
    q = me.q
    there = me.out_at + me.out_s
    leave = there + me.hold_s
    out = min_jerk((t - me.out_at) / me.out_s)
    out -= min_jerk((t - leave) / me.back_s)
    _extend(out, me)
    looking = min_jerk((t - me.out_at + GAZE_LEAD_S) / 0.6) - min_jerk((t - leave) / 0.7)
    _look(looking, me)
    busy = me.fidget_m * hump((t - there) / me.hold_s)
    if busy > 0.0:
        beat = 2.0 * math.pi * me.fidget_hz * (t - there)
        for side in range(2):
            q[c.HAND_TARGET + 3 * side] += busy * math.sin(beat + side)
            q[c.HAND_TARGET + 3 * side + 1] += busy * math.cos(0.7 * beat)
            q[c.HAND_TARGET + 3 * side + 2] += 0.5 * busy * math.sin(1.3 * beat + 2.0 * side)


@kernel
def lift(t: float, me: Worker) -> None:
    """Let a standing q pick a load up, hold it, and put it back."""
    q = me.q
    grip = me.out_at + me.out_s
    rise = grip + me.hold_s
    lower = rise + me.raise_s + me.carry_s
    leave = lower + me.raise_s + me.hold_s
    down = min_jerk((t - me.out_at) / me.out_s)
    up = min_jerk((t - rise) / me.raise_s) - min_jerk((t - lower) / me.raise_s)
    away = min_jerk((t - leave) / me.back_s)
    lean(me.lean * (down - up - away), me.squat, 0.0, me)
    _look(down - 0.6 * up - away, me)
    for i in range(6):
        q[c.HAND_TARGET + i] = me.target[i] + up * (me.raised[i] - me.target[i])
    for side in range(2):
        shift(q, c.HAND_TARGET + 3 * side, me.start_yaw, 0.06 * hump(up), 0.0)
        q[c.HAND_SHARE + side] = down - away


@kernel
def _settle_lean(me: Worker) -> None:
    """Smallest lean that brings the targets within reach; else the targets come nearer."""
    p = me.p
    low, high, me.lean = 0.0, MOST_LEAN, 0.0
    for attempt in range(12):
        stand(me.start_x, me.start_y, me.start_yaw, 0.0, me)
        _extend(1.0, me)
        far = beyond(me)
        if attempt == 0 and far <= 0.0:
            return
        if far > 0.0:  # at first from `low` itself
            low = me.lean
        else:
            high = me.lean
        me.lean = 0.5 * (low + high)
    me.lean = high + SPARE_LEAN
    if high < MOST_LEAN:
        return
    for side in range(2):
        upper = LEFT + SIDE_STRIDE * side + UPPER_ARM
        target, squared = me.target[3 * side : 3 * side + 3], 0.0
        for i in range(3):
            squared += (target[i] - p[upper, i]) ** 2
        nearer = min(1.0, ARM_KNEE * me.size[ARM] / math.sqrt(squared))
        for i in range(3):
            target[i] = p[upper, i] + nearer * (target[i] - p[upper, i])


@kernel
def plan_reach(
    target: Triple, used: Pair, peak_m_s: float, hold_s: float, fidget: Pair, me: Worker
) -> float:
    """Plan to reach a world point with the used hands; returns the duration [s]."""
    yaw = me.start_yaw
    cos, sin = math.cos(yaw), math.sin(yaw)
    dx, dy = target[0] - me.start_x, target[1] - me.start_y
    ahead, left = cos * dx + sin * dy, -sin * dx + cos * dy
    apart = 0.12 if used[0] > 0.0 and used[1] > 0.0 else 0.0
    for side in range(2):
        at = me.target[3 * side :]
        at[0], at[1], at[2] = from_here((ahead, left + (1.0 - 2.0 * side) * apart, target[2]), me)
    me.used[0], me.used[1] = used
    azimuth = math.atan2(left, max(ahead, 0.2))
    stretch = min(max((math.hypot(ahead, left) - 0.4) / 0.35, 0.0), 1.0)
    me.twist = 0.6 * azimuth + 0.3 * stretch * (used[1] - used[0])
    me.squat = min(max((0.95 - target[2]) / 0.5, 0.0), 1.0)
    me.gaze_yaw = 0.5 * azimuth - 0.5 * me.twist
    me.gaze_pitch = 0.25 + 0.4 * min(max(1.4 - target[2], -0.3), 0.6)
    _settle_lean(me)
    stand(me.start_x, me.start_y, me.start_yaw, 0.0, me)
    way = max(0.1, farthest(HAND, me.target, used, me))
    me.out_s = max(1.875 * way / peak_m_s, 0.3)
    me.back_s = max(1.875 * way / min(peak_m_s, 1.2), 0.45)
    me.hold_s = hold_s
    me.fidget_m, me.fidget_hz = fidget
    return me.out_at + me.out_s + hold_s + me.back_s + 0.05


@kernel
def plan_lift(ahead: float, z: float, times: Triple, me: Worker) -> float:
    """Plan to lift a load `ahead` of the feet at height z; times: bend, raise, carry [s]."""
    for side in range(2):
        left = (1.0 - 2.0 * side) * LOAD_HALF_WIDTH_M
        at, up = me.target[3 * side :], me.raised[3 * side :]
        at[0], at[1], at[2] = from_here((ahead, left, z), me)
        up[0], up[1], up[2] = from_here((CARRY_FORWARD_M, left, CARRY_Z_M), me)
    me.twist, me.gaze_yaw, me.gaze_pitch = 0.0, 0.0, 0.25
    me.squat = me.squat_share
    me.used[0], me.used[1] = 1.0, 1.0
    _settle_lean(me)
    me.out_s, me.raise_s, me.carry_s = times
    me.back_s, me.hold_s = times[0], 0.3
    raising = 2.0 * (me.hold_s + me.raise_s) + me.carry_s
    return me.out_at + me.out_s + raising + me.back_s + 0.05
