"""Who is where when: nobody begins what meets somebody on theirs, so everybody stays clear."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.motion import state as st
from hrc_env.motion.activities.falling import fallen_root
from hrc_env.motion.activities.playing import clip_root
from hrc_env.motion.curves import placed
from hrc_env.motion.paths import along
from hrc_env.motion.state import Pair, Triple, Worker, Workers
from hrc_env.motion.walk import travelled

APART_M = 0.80
"""Roots keep so far from each other [m]: two half widths of people with arms, and some."""
AHEAD_M, HANDS_M = 0.48, 0.76
"""Who works has hands and head so far ahead [m]; others' roots keep so far from there."""
PUSHING_M, CLIP_M, FALL_M = (1.0, 0.95), (0.01, 1.15), (0.01, 1.3)
"""The same of who pushes a cart, of who plays a clip: an arm's length more to any side, and of who
falls: head and feet of who lies are so far from their pelvis, and half a body."""
BEHIND_M, SHANK_M = 0.40, 0.66
"""Who kneels has a shank so far behind [m]; others' roots keep so far from there."""
LOOK_S = 0.12
"""Meetings are looked for in steps of this length [s]; at 2.8 m/s to each other 0.3 m."""


@kernel
def goes(activity: int) -> bool:
    """Whether it moves along a path."""
    return activity in st.GOING or activity in (st.PUSH, st.RUN)


@kernel
def ahead_of(activity: int) -> Pair:
    """How far ahead of the root hands or cart are, and how near others may come to there [m]."""
    if activity == st.PUSH:
        return PUSHING_M
    if activity == st.CLIP:
        return CLIP_M
    if activity == st.FALL:
        return FALL_M
    if activity in st.IDLE or goes(activity):
        return 0.0, 0.0
    return AHEAD_M, HANDS_M


@kernel
def root_at(t: float, me: Worker) -> Pair:
    """Where someone's root is on the floor at time t of their activity, and after it."""
    if goes(me.activity):
        return along(travelled(t - me.taken_s, me), me)
    if me.activity == st.CLIP:
        return clip_root(t, me)
    if me.activity == st.FALL:
        return fallen_root(t, me)
    return me.start_x, me.start_y


@kernel
def gap_to(x: float, y: float, t: float, me: Worker) -> float:
    """How much farther a root at (x, y) is than it must be from someone's body and hands [m]."""
    ox, oy = root_at(t, me)
    gap = math.hypot(x - ox, y - oy) - APART_M
    ahead, apart = ahead_of(me.activity)
    if ahead > 0.0:
        nx, ny = (ox, oy) if not goes(me.activity) else root_at(t + 0.1, me)
        yaw = me.start_yaw
        if math.hypot(nx - ox, ny - oy) > 0.01:
            yaw = math.atan2(ny - oy, nx - ox)
        hx, hy = placed(ox, oy, yaw, ahead, 0.0)
        gap = min(gap, math.hypot(x - hx, y - hy) - apart)
        if st.KNEELING <= me.activity <= st.POINT and me.kneel > 0.0:
            hx, hy = placed(ox, oy, yaw, -BEHIND_M, 0.0)
            gap = min(gap, math.hypot(x - hx, y - hy) - SHANK_M)
    return gap


@kernel
def meets(w: int, workers: Workers) -> Triple:
    """When worker w first comes too near to another, from now [s] (-1: never), and x, y."""
    found, fx, fy = -1.0, 0.0, 0.0
    me = workers[w]
    for k in range(len(workers)):
        other = workers[k]
        if k == w or not other.present:
            continue
        left = me.duration_s - me.time_s
        if goes(other.activity) or other.activity == st.CLIP:
            left = max(left, other.duration_s - other.time_s)
        allowed, n = 0.0, int(left / LOOK_S) + 1
        for i in range(n + 1):
            t = i * LOOK_S
            if found >= 0.0 and t >= found:
                break
            x, y = root_at(me.time_s + t, me)
            gap = gap_to(x, y, other.time_s + t, other)
            ox, oy = root_at(other.time_s + t, other)
            if ahead_of(me.activity)[0] > 0.0:
                gap = min(gap, gap_to(ox, oy, me.time_s + t, me))
            if i == 0:
                allowed = min(gap - 0.02, 0.0)
            if gap < allowed:
                found, fx, fy = t, ox, oy
                break
            allowed = min(max(allowed, gap - 0.02), 0.0)
    return found, fx, fy
