"""Who is where when: nobody begins what meets somebody on theirs.

Everybody's motion is a closed form of time until the activity ends, and then they stay where it
ended; a worker who begins something makes sure to keep clear of all of that, so it stays clear.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.recorded import clip_root
from hrc_env.motion.paths import along
from hrc_env.motion.walk import travelled

APART_M = 0.80
"""Roots keep so far from each other [m]: two half widths of people with arms, and some."""
AHEAD_M, HANDS_M = 0.48, 0.76
"""Who works has hands and head so far ahead [m]; others' roots keep so far from there."""
CART_M, CART_APART_M = 1.0, 0.95
"""The same of who pushes a cart."""
CLIP_M, CLIP_APART_M = 0.01, 1.15
"""The same of who plays a clip and may reach to any side: an arm's length more than APART_M."""
LOOK_S = 0.12
"""Meetings are looked for in steps of this length [s]; at 2.8 m/s to each other 0.3 m."""


@kernel
def goes(activity: int) -> bool:
    """Whether it moves along a path."""
    return activity == pl.WALK or pl.TURN <= activity <= pl.STEP_BACK


@kernel
def ahead_of(activity: int) -> tuple[float, float]:
    """How far ahead of the root someone is in the way with what, and how near one may go [m]."""
    if activity == pl.PUSH:
        return CART_M, CART_APART_M
    if activity == pl.CLIP:
        return CLIP_M, CLIP_APART_M
    if activity == pl.STAND or activity == pl.LOOK_ROUND or goes(activity):
        return 0.0, 0.0
    return AHEAD_M, HANDS_M


@kernel
def root_at(activity: int, t: float, plan: Floats) -> tuple[float, float]:
    """Where someone's root is on the floor at time t of an activity, and after it."""
    if goes(activity):
        return along(travelled(t - plan[pl.TAKEN_S], plan), plan)
    if activity == pl.CLIP:
        return clip_root(t, plan)
    return plan[pl.START_X], plan[pl.START_Y]


@kernel
def gap_to(x: float, y: float, activity: int, t: float, plan: Floats) -> float:
    """How much farther a root at (x, y) is than it must be from someone's body and hands [m]."""
    ox, oy = root_at(activity, t, plan)
    gap = math.hypot(x - ox, y - oy) - APART_M
    ahead, apart = ahead_of(activity)
    if ahead > 0.0:
        nx, ny = (ox, oy) if not goes(activity) else root_at(activity, t + 0.1, plan)
        yaw = plan[pl.START_YAW]
        if math.hypot(nx - ox, ny - oy) > 0.01:
            yaw = math.atan2(ny - oy, nx - ox)
        hx, hy = ox + ahead * math.cos(yaw), oy + ahead * math.sin(yaw)
        gap = min(gap, math.hypot(x - hx, y - hy) - apart)
    return gap


@kernel
def meets(
    w: int, activity: Ints, time_s: Floats, duration_s: Floats, plan: Floats, present: Floats
) -> tuple[float, float, float]:
    """When and where worker w first comes too near to another of (W, ...) workers.

    Who is too near now may stay so, but comes no nearer.

    Returns:
        Time from now [s], and the other's x, y [m]; time -1: nobody.
    """
    found, fx, fy = -1.0, 0.0, 0.0
    for k in range(activity.shape[0]):
        if k == w or present[k] == 0.0:
            continue
        left = max(duration_s[w] - time_s[w], duration_s[k] - time_s[k])
        if not goes(activity[k]):
            left = duration_s[w] - time_s[w]
        allowed, n = 0.0, int(left / LOOK_S) + 1
        for i in range(n + 1):
            t = i * LOOK_S
            if found >= 0.0 and t >= found:
                break
            x, y = root_at(activity[w], time_s[w] + t, plan[w])
            gap = gap_to(x, y, activity[k], time_s[k] + t, plan[k])
            ox, oy = root_at(activity[k], time_s[k] + t, plan[k])
            if ahead_of(activity[w])[0] > 0.0:
                gap = min(gap, gap_to(ox, oy, activity[w], time_s[w] + t, plan[w]))
            if i == 0:
                allowed = min(gap - 0.02, 0.0)
            if gap < allowed:
                found, fx, fy = t, ox, oy
                break
            allowed = min(max(allowed, gap - 0.02), 0.0)
    return found, fx, fy
