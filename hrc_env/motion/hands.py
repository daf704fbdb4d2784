"""Reaching and lifting: hands go to targets, the trunk follows as far as it must."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.anatomy import ARM, HAND, LEFT, SIDE_STRIDE, UPPER_ARM
from hrc_env.motion.curves import hump, min_jerk
from hrc_env.motion.kinematics import ARM_KNEE, pose
from hrc_env.motion.posture import MOST_LEAN, beyond, lean, stand

GAZE_LEAD_S = 0.25
"""Eyes and head set off before the hand (Land & Hayhoe 2001: about half a second at most)."""
SPARE_LEAN = 0.04
"""Lean beyond the least, because the sway of a standing body may take as much away."""
CARRY_FORWARD_M, CARRY_Z_M, LOAD_HALF_WIDTH_M = 0.36, 1.05, 0.20
"""A load held up: ahead of the root, its height, half its width [m]; judgement."""


@kernel
def _look(share: float, plan: Floats, q: Floats) -> None:
    """Turn the head to the work."""
    q[c.HEAD_YAW] += share * (plan[pl.GAZE_YAW] - q[c.HEAD_YAW])
    q[c.HEAD_PITCH] += share * plan[pl.GAZE_PITCH]


@kernel
def _extend(out: float, plan: Floats, q: Floats) -> None:
    """Hands and trunk at share `out` of a reach."""
    lean(plan[pl.LEAN] * out, plan[pl.SQUAT], plan[pl.TWIST] * out, q)
    for i in range(6):
        q[c.HAND_TARGET + i] = plan[pl.TARGET + i]
    q[c.HAND_SHARE] = out * plan[pl.USE_LEFT]
    q[c.HAND_SHARE + 1] = out * plan[pl.USE_RIGHT]


@kernel
def reach(t: float, plan: Floats, clock_s: float, traits: Floats, size: Floats, q: Floats) -> None:
    """The control vector of someone who reaches out, works there, and takes the hands back."""
    stand(plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW], clock_s, traits, size, q)
    there = plan[pl.OUT_AT] + plan[pl.OUT_S]
    leave = there + plan[pl.HOLD_S]
    out = min_jerk((t - plan[pl.OUT_AT]) / plan[pl.OUT_S])
    out -= min_jerk((t - leave) / plan[pl.BACK_S])
    _extend(out, plan, q)
    looking = min_jerk((t - plan[pl.OUT_AT] + GAZE_LEAD_S) / 0.6) - min_jerk((t - leave) / 0.7)
    _look(looking, plan, q)
    busy = plan[pl.FIDGET] * hump((t - there) / plan[pl.HOLD_S])
    if busy > 0.0:
        beat = 2.0 * math.pi * plan[pl.FIDGET_HZ] * (t - there)
        for side in range(2):
            q[c.HAND_TARGET + 3 * side] += busy * math.sin(beat + side)
            q[c.HAND_TARGET + 3 * side + 1] += busy * math.cos(0.7 * beat)
            q[c.HAND_TARGET + 3 * side + 2] += 0.5 * busy * math.sin(1.3 * beat + 2.0 * side)


@kernel
def lift(t: float, plan: Floats, clock_s: float, traits: Floats, size: Floats, q: Floats) -> None:
    """The control vector of someone who picks a load up, holds it, and puts it back."""
    stand(plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW], clock_s, traits, size, q)
    grip = plan[pl.OUT_AT] + plan[pl.OUT_S]
    rise = grip + plan[pl.HOLD_S]
    lower = rise + plan[pl.RAISE_S] + plan[pl.CARRY_S]
    leave = lower + plan[pl.RAISE_S] + plan[pl.HOLD_S]
    down = min_jerk((t - plan[pl.OUT_AT]) / plan[pl.OUT_S])
    up = min_jerk((t - rise) / plan[pl.RAISE_S]) - min_jerk((t - lower) / plan[pl.RAISE_S])
    away = min_jerk((t - leave) / plan[pl.BACK_S])
    lean(plan[pl.LEAN] * (down - up - away), plan[pl.SQUAT], 0.0, q)
    _look(down - 0.6 * up - away, plan, q)
    bulge = 0.06 * hump(up)
    cos, sin = math.cos(plan[pl.START_YAW]), math.sin(plan[pl.START_YAW])
    for i in range(6):
        q[c.HAND_TARGET + i] = plan[pl.TARGET + i] + up * (
            plan[pl.RAISED + i] - plan[pl.TARGET + i]
        )
    for side in range(2):
        q[c.HAND_TARGET + 3 * side] += cos * bulge
        q[c.HAND_TARGET + 3 * side + 1] += sin * bulge
        q[c.HAND_SHARE + side] = down - away


@kernel
def _settle_lean(
    plan: Floats, traits: Floats, offset: Floats, frame: Floats, size: Floats,
    q: Floats, p: Floats, r: Floats,
) -> None:  # fmt: skip
    """Smallest lean that brings the targets within reach; else the targets come nearer."""
    used = (plan[pl.USE_LEFT], plan[pl.USE_RIGHT])
    low, high = 0.0, MOST_LEAN
    plan[pl.LEAN] = 0.0
    for attempt in range(12):
        stand(plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW], 0.0, traits, size, q)
        _extend(1.0, plan, q)
        far = beyond(q, used, offset, frame, size, p, r)
        if attempt == 0 and far <= 0.0:
            return
        if attempt > 0:
            if far > 0.0:
                low = plan[pl.LEAN]
            else:
                high = plan[pl.LEAN]
        plan[pl.LEAN] = 0.5 * (low + high)
    plan[pl.LEAN] = high + SPARE_LEAN
    if high < MOST_LEAN:
        return
    for side in range(2):
        upper = LEFT + SIDE_STRIDE * side + UPPER_ARM
        at = pl.TARGET + 3 * side
        d = math.sqrt(
            (plan[at] - p[upper, 0]) ** 2
            + (plan[at + 1] - p[upper, 1]) ** 2
            + (plan[at + 2] - p[upper, 2]) ** 2
        )
        nearer = min(1.0, ARM_KNEE * size[ARM] / d)
        for i in range(3):
            plan[at + i] = p[upper, i] + nearer * (plan[at + i] - p[upper, i])


@kernel
def plan_reach(
    target: tuple[float, float, float], used: tuple[float, float], peak_m_s: float,
    hold_s: float, fidget: tuple[float, float], plan: Floats, traits: Floats,
    offset: Floats, frame: Floats, size: Floats, q: Floats, p: Floats, r: Floats,
) -> float:  # fmt: skip
    """Plan to reach a world point with the used hands; returns the duration [s]."""
    yaw = plan[pl.START_YAW]
    cos, sin = math.cos(yaw), math.sin(yaw)
    dx, dy = target[0] - plan[pl.START_X], target[1] - plan[pl.START_Y]
    ahead, left = cos * dx + sin * dy, -sin * dx + cos * dy
    apart = 0.12 if used[0] > 0.0 and used[1] > 0.0 else 0.0
    for side in range(2):
        lateral = left + (1.0 - 2.0 * side) * apart
        plan[pl.TARGET + 3 * side] = plan[pl.START_X] + cos * ahead - sin * lateral
        plan[pl.TARGET + 3 * side + 1] = plan[pl.START_Y] + sin * ahead + cos * lateral
        plan[pl.TARGET + 3 * side + 2] = target[2]
    plan[pl.USE_LEFT], plan[pl.USE_RIGHT] = used
    azimuth = math.atan2(left, max(ahead, 0.2))
    stretch = min(max((math.hypot(ahead, left) - 0.4) / 0.35, 0.0), 1.0)
    plan[pl.TWIST] = 0.6 * azimuth + 0.3 * stretch * (used[1] - used[0])
    plan[pl.SQUAT] = min(max((0.95 - target[2]) / 0.5, 0.0), 1.0)
    plan[pl.GAZE_YAW] = 0.5 * azimuth - 0.5 * plan[pl.TWIST]
    plan[pl.GAZE_PITCH] = 0.25 + 0.4 * min(max(1.4 - target[2], -0.3), 0.6)
    _settle_lean(plan, traits, offset, frame, size, q, p, r)
    way = _way(plan, traits, offset, frame, size, q, p, r)
    plan[pl.OUT_S] = max(1.875 * way / peak_m_s, 0.3)
    plan[pl.BACK_S] = max(1.875 * way / min(peak_m_s, 1.2), 0.45)
    plan[pl.HOLD_S] = hold_s
    plan[pl.FIDGET], plan[pl.FIDGET_HZ] = fidget
    return plan[pl.OUT_AT] + plan[pl.OUT_S] + hold_s + plan[pl.BACK_S] + 0.05


@kernel
def _way(
    plan: Floats, traits: Floats, offset: Floats, frame: Floats, size: Floats,
    q: Floats, p: Floats, r: Floats,
) -> float:  # fmt: skip
    """The longest way that a used hand has from hanging to its target [m]."""
    stand(plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW], 0.0, traits, size, q)
    for i in range(6):
        q[c.HAND_TARGET + i] = plan[pl.TARGET + i]
    way = 0.1
    pose(q, offset, frame, size, p, r)
    for side in range(2):
        wrist = LEFT + SIDE_STRIDE * side + HAND
        d = 0.0
        for i in range(3):
            d += (plan[pl.TARGET + 3 * side + i] - p[wrist, i]) ** 2
        if plan[pl.USE_LEFT + side] > 0.0:
            way = max(way, math.sqrt(d))
    return way


@kernel
def plan_lift(
    ahead: float, z: float, times: tuple[float, float, float], plan: Floats, traits: Floats,
    offset: Floats, frame: Floats, size: Floats, q: Floats, p: Floats, r: Floats,
) -> float:  # fmt: skip
    """Plan to lift a load `ahead` of the feet at height z; times: bend, raise, carry [s]."""
    cos, sin = math.cos(plan[pl.START_YAW]), math.sin(plan[pl.START_YAW])
    for side in range(2):
        left = (1.0 - 2.0 * side) * LOAD_HALF_WIDTH_M
        for at, forward, height in (
            (pl.TARGET, ahead, z),
            (pl.RAISED, CARRY_FORWARD_M, CARRY_Z_M),
        ):
            plan[at + 3 * side] = plan[pl.START_X] + cos * forward - sin * left
            plan[at + 3 * side + 1] = plan[pl.START_Y] + sin * forward + cos * left
            plan[at + 3 * side + 2] = height
    plan[pl.TWIST], plan[pl.GAZE_YAW], plan[pl.GAZE_PITCH] = 0.0, 0.0, 0.25
    plan[pl.SQUAT] = traits[pl.SQUAT_TRAIT]
    plan[pl.USE_LEFT], plan[pl.USE_RIGHT] = 1.0, 1.0
    _settle_lean(plan, traits, offset, frame, size, q, p, r)
    plan[pl.OUT_S], plan[pl.RAISE_S], plan[pl.CARRY_S] = times
    plan[pl.BACK_S], plan[pl.HOLD_S] = times[0], 0.3
    raising = 2.0 * (plan[pl.HOLD_S] + plan[pl.RAISE_S]) + plan[pl.CARRY_S]
    return plan[pl.OUT_AT] + plan[pl.OUT_S] + raising + plan[pl.BACK_S] + 0.05
