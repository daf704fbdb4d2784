"""Prediction of workers' positions, to avoid activities in which two workers come too close."""

import math
from typing import NamedTuple

from hrc_env.core.declared import Records1
from hrc_env.core.kernels import kernel
from hrc_env.motion import state as st
from hrc_env.motion.activities.falling import predict_fallen_root
from hrc_env.motion.activities.playing import predict_clip_root
from hrc_env.motion.curves import move_point
from hrc_env.motion.paths import locate_on_path
from hrc_env.motion.points import Point
from hrc_env.motion.state import Worker
from hrc_env.motion.walk import measure_travel

APART_M = 0.80
"""Minimum distance between two roots [m], the width of a person with arms plus a reserve."""
AHEAD_M = 0.48
"""Distance of the hands and head of a working person ahead of the root [m]."""
HANDS_M = 0.76
"""Minimum distance of another worker's root from the hands of a working person [m]."""
FALL_APART_M = 1.3
"""Minimum distance of another worker's root from the root of a falling worker [m]."""


class HandsClearance(NamedTuple):
    """Disc ahead of a worker from which other workers keep away."""

    ahead: float
    """Distance of the disc's centre ahead of the root [m]; 0 for no disc."""
    apart: float
    """Minimum distance of another worker's root from the centre [m]."""


class Meeting(NamedTuple):
    """Time and position at which a worker first comes too close to another."""

    time_s: float
    """Time from now [s]; negative (-1) if there is no such moment."""
    x: float
    """World x of the other worker's root at that time [m]."""
    y: float
    """World y of the other worker's root at that time [m]."""


PUSHING = HandsClearance(1.0, 0.95)
"""Clearance of a worker that pushes a cart."""
PLAYING = HandsClearance(0.01, 1.15)
"""Clearance of a worker that plays a clip, which includes an arm's length on all sides."""
FALLING = HandsClearance(0.01, FALL_APART_M)
"""Clearance of a falling worker: distance from pelvis to head or feet, plus half a body."""
BEHIND_M = 0.40
"""Distance of a kneeling worker's shank behind the root [m]."""
SHANK_M = 0.66
"""Minimum distance of another worker's root from a kneeling worker's shank [m]."""
LOOK_S = 0.12
"""Time step of the search for meetings [s], 0.3 m at a closing speed of 2.8 m/s."""


@kernel
def is_on_path(activity: int) -> bool:
    """Return whether an activity moves along a path."""
    return activity in st.GOING or activity in (st.PUSH, st.RUN)


@kernel
def get_hands_clearance(activity: int) -> HandsClearance:
    """Return the disc, ahead of a worker in an activity, that other workers avoid."""
    if activity == st.PUSH:
        return PUSHING
    if activity == st.CLIP:
        return PLAYING
    if activity == st.FALL:
        return FALLING
    if activity in st.IDLE or is_on_path(activity):
        return HandsClearance(0.0, 0.0)
    return HandsClearance(AHEAD_M, HANDS_M)


@kernel
def predict_root(t: float, worker: Worker) -> Point:
    """Predict the position of a worker's root at time t of the activity, also after its end."""
    if is_on_path(worker.activity):
        return locate_on_path(measure_travel(t - worker.grasp_s, worker), worker)
    if worker.activity == st.CLIP:
        return predict_clip_root(t, worker)
    if worker.activity == st.FALL:
        return predict_fallen_root(t, worker)
    return Point(worker.start_x, worker.start_y)


@kernel
def measure_gap(x: float, y: float, t: float, worker: Worker) -> float:
    """Return the distance of another worker's root from a worker, minus the minimum distance [m].

    Args:
        x: world x of the other root [m].
        y: world y of the other root [m].
        t: time since the worker's activity began [s].
        worker: record of the worker.
    """
    ox, oy = predict_root(t, worker)
    gap = math.hypot(x - ox, y - oy) - APART_M
    ahead, apart = get_hands_clearance(worker.activity)
    if ahead > 0.0:
        yaw = worker.start_yaw
        if is_on_path(worker.activity):
            later = predict_root(t + 0.1, worker)
            if math.hypot(later.x - ox, later.y - oy) > 0.01:
                yaw = math.atan2(later.y - oy, later.x - ox)
        hx, hy = move_point(ox, oy, yaw, ahead, 0.0)
        gap = min(gap, math.hypot(x - hx, y - hy) - apart)
        if st.KNEELING <= worker.activity <= st.POINT and worker.kneel > 0.0:
            hx, hy = move_point(ox, oy, yaw, -BEHIND_M, 0.0)
            gap = min(gap, math.hypot(x - hx, y - hy) - SHANK_M)
    return gap


@kernel
def find_meeting(w: int, workers: Records1[Worker]) -> Meeting:
    """Predict when and where worker w first comes too close to another worker."""
    time_s, met_x, met_y = -1.0, 0.0, 0.0
    worker = workers[w]
    for k in range(len(workers)):
        other = workers[k]
        if k == w or not other.is_present:
            continue
        left = worker.duration_s - worker.time_s
        if is_on_path(other.activity) or other.activity == st.CLIP:
            left = max(left, other.duration_s - other.time_s)
        allowed, n = 0.0, int(left / LOOK_S) + 1
        for i in range(n + 1):
            t = i * LOOK_S
            if time_s >= 0.0 and t >= time_s:
                break
            x, y = predict_root(worker.time_s + t, worker)
            gap = measure_gap(x, y, other.time_s + t, other)
            ox, oy = predict_root(other.time_s + t, other)
            if get_hands_clearance(worker.activity).ahead > 0.0:
                gap = min(gap, measure_gap(ox, oy, worker.time_s + t, worker))
            if i == 0:
                allowed = min(gap - 0.02, 0.0)
            if gap < allowed:
                time_s, met_x, met_y = t, ox, oy
                break
            allowed = min(max(allowed, gap - 0.02), 0.0)
    return Meeting(time_s, met_x, met_y)
