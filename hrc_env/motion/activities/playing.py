"""Playing of a clip, with two steps to its first pose and two steps to a stance after it.

A frame contains the columns `clip.RECORDED` of the control vector (see `pieces.Clips`).
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.pieces import Clips
from hrc_env.motion.anatomy import ANKLE_Z
from hrc_env.motion.clip import find_footprints
from hrc_env.motion.curves import min_jerk, move_point, ramp
from hrc_env.motion.feet import place_foot, raise_heel
from hrc_env.motion.points import Point
from hrc_env.motion.posture import STANCE_HALF_WIDTH_M, stand
from hrc_env.motion.state import N_ROOTS, Worker
from hrc_env.motion.walk import write_footprint

STEP_AT_S = 0.12
"""Time of the first lift-off before a clip [s]."""
PERIOD_S = 0.50
"""Period of the steps before and after a clip [s]."""
SWING_S = 0.42
"""Swing time of the steps before and after a clip [s]."""
TILT_S = 0.25
"""Time in which the standing feet change to their pitch in the clip [s]."""
PACE_S = 0.6
"""Time in which the recording accelerates to its normal rate, and decelerates from it [s]."""
SETTLE_S = STEP_AT_S + PERIOD_S + SWING_S + 0.1 + TILT_S
"""Total time of the two steps and the change of pitch [s]."""
END, BEGIN, LAST = 0, 2, 4
"""Index of the first of two footprints at the activity's end, the clip's beginning and its end."""
STRIDE_SHARE = 0.25
"""Length of the steps before and after a clip, as a fraction of a full stride."""


def start_clip(piece: int, turn_rad: float, clips: Clips, worker: Worker) -> float:
    """Plan to play a piece of a clip on the spot.

    Args:
        piece: index of the piece.
        turn_rad: heading of the clip relative to the worker's heading [rad].
        clips: pieces of all clips.
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    prints, size = worker.footprints, worker.lengths
    row = int(worker.body) * clips.n_rows + int(clips.row[piece])
    n, fps = int(clips.count[piece]), float(clips.fps[piece])
    q = clips.frames[row : row + n]
    yaw = float(worker.start_yaw) + turn_rad
    duration_s = (n - 1) / fps + PACE_S
    worker.clip_row, worker.clip_frames, worker.clip_fps = row, n, fps
    worker.clip_yaw, worker.clip_s = yaw, duration_s
    worker.step_start, worker.step_period, worker.step_swing = STEP_AT_S, PERIOD_S, SWING_S
    worker.step_first, worker.step_count, worker.undo_at = 0, 2, 0.0
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn, origin = np.array([[cos, -sin], [sin, cos]]), np.array([worker.start_x, worker.start_y])
    way = q[:, [c.ROOT_X, c.ROOT_Y]] @ turn.T + origin
    x, y, heading = float(way[-1, 0]), float(way[-1, 1]), float(yaw + q[-1, c.HEADING])
    worker.end_x, worker.end_y, worker.end_yaw = x, y, heading
    prints[: LAST + 2, 3] = STRIDE_SHARE
    for side in range(2):
        write_footprint(side, x, y, heading, STANCE_HALF_WIDTH_M, prints[END + side], worker)
        feet = find_footprints(q[[0, -1], c.N_BLENDED + 6 * side :], size)
        for at, foot_ in zip((BEGIN, LAST), feet, strict=True):
            prints[at + side, :2] = turn @ foot_[:2] + origin
            prints[at + side, 2] = foot_[3] + yaw
            prints[at + side, 4] = foot_[2] - size[ANKLE_Z]
    whole = duration_s + 2.0 * SETTLE_S
    for k, since in enumerate(np.linspace(0.0, whole, N_ROOTS) - SETTLE_S):
        worker.roots[k] = way[min(round(_to_clip_time(since, worker) * fps), n - 1)]
    return whole


@kernel
def _to_clip_time(since: float, worker: Worker) -> float:
    """Convert the time since playback began [s] to the time in the recording [s]."""
    slow = worker.clip_s - PACE_S
    return PACE_S * (ramp(since / PACE_S) - ramp((since - slow) / PACE_S))


@kernel
def play(t: float, clock_s: float, frames: Floats, worker: Worker) -> None:
    """Compute the control vector of playing a clip, including the feet.

    Args:
        t: time since the activity began [s].
        clock_s: time since the episode began [s].
        frames: frames of all clips.
        worker: record with the plan; its `q` is written.
    """
    since = t - SETTLE_S
    left = worker.clip_s - since
    if since < 0.5 * worker.clip_s:
        stand(worker.start_x, worker.start_y, worker.start_yaw, clock_s, worker)
    else:
        stand(worker.end_x, worker.end_y, worker.end_yaw, clock_s, worker)
    share = min_jerk(t / SETTLE_S) * min_jerk(1.0 + left / SETTLE_S)
    first, n = worker.clip_row, worker.clip_frames
    f = min(max(_to_clip_time(since, worker) * worker.clip_fps, 0.0), n - 1.0)
    _play_body(f, share, frames, worker)
    for side in range(2):
        pitch = c.N_BLENDED + 6 * side + 4
        if since < 0.0:
            place_foot(t, side, worker.footprints[BEGIN:], worker.stance, worker)
            tilt = min_jerk(1.0 + since / TILT_S)
            raise_heel(side, frames[first, pitch] * tilt, worker)
        elif left < 0.0:
            place_foot(
                -left - TILT_S, side, worker.footprints[END:], worker.footprints[LAST:], worker
            )
            tilt = min_jerk(1.0 + left / TILT_S)
            raise_heel(side, frames[first + n - 1, pitch] * tilt, worker)
        else:
            _play_foot(f, side, frames, worker)


@kernel
def _interpolate_frames(f: float, column: int, frames: Floats, worker: Worker) -> float:
    """Interpolate a column between frames by a Catmull-Rom spline, clamped at the ends.

    Args:
        f: time in frames of the clip.
        column: column of the frames.
        frames: frames of all clips.
        worker: record with the range of the clip's frames.
    """
    first, last = worker.clip_row, worker.clip_row + worker.clip_frames - 1
    k = first + int(f)
    u = f - int(f)
    a, b = frames[max(k - 1, first), column], frames[min(k, last), column]
    p, d = frames[min(k + 1, last), column], frames[min(k + 2, last), column]
    curve = 2.0 * a - 5.0 * b + 4.0 * p - d + u * (3.0 * (b - p) + d - a)
    return b + 0.5 * u * (p - a + u * curve)


@kernel
def _play_body(f: float, share: float, frames: Floats, worker: Worker) -> None:
    """Blend the poses of root, trunk, head and arms of a standing worker with those of the clip.

    Args:
        f: time in frames of the clip.
        share: weight of the clip.
        frames: frames of all clips.
        worker: record of the worker; its `q` is changed.
    """
    q = worker.q
    ahead, left = (
        _interpolate_frames(f, c.ROOT_X, frames, worker),
        _interpolate_frames(f, c.ROOT_Y, frames, worker),
    )
    x, y = move_point(worker.start_x, worker.start_y, worker.clip_yaw, ahead, left)
    q[c.ROOT_X] += share * (x - q[c.ROOT_X])
    q[c.ROOT_Y] += share * (y - q[c.ROOT_Y])
    yaw = worker.clip_yaw + _interpolate_frames(f, c.HEADING, frames, worker)
    q[c.HEADING] += share * (yaw - q[c.HEADING])
    for i in range(c.PELVIS_Z, c.N_BLENDED):
        q[i] += share * (_interpolate_frames(f, i, frames, worker) - q[i])


@kernel
def _play_foot(f: float, side: int, frames: Floats, worker: Worker) -> None:
    """Compute the pose of a foot in the clip, transformed to the world frame.

    Args:
        f: time in frames of the clip.
        side: 0 left, 1 right.
        frames: frames of all clips.
        worker: record of the worker; its `q` is written.
    """
    q, at, column = worker.q, c.ANKLE + 6 * side, c.N_BLENDED + 6 * side
    ahead, left = (
        _interpolate_frames(f, column, frames, worker),
        _interpolate_frames(f, column + 1, frames, worker),
    )
    q[at], q[at + 1] = move_point(worker.start_x, worker.start_y, worker.clip_yaw, ahead, left)
    q[at + 3] = worker.clip_yaw + _interpolate_frames(f, column + 3, frames, worker)
    for i in (2, 4, 5):
        q[at + i] = _interpolate_frames(f, column + i, frames, worker)


@kernel
def predict_clip_root(t: float, worker: Worker) -> Point:
    """Predict the approximate position of the root at time t of a clip, also after its end."""
    duration_s = worker.clip_s + 2.0 * SETTLE_S
    u = min(max(t / duration_s, 0.0), 1.0) * (N_ROOTS - 1)
    k = min(int(u), N_ROOTS - 2)
    share, roots = u - k, worker.roots
    x, y = roots[k, 0], roots[k, 1]
    return Point(x + share * (roots[k + 1, 0] - x), y + share * (roots[k + 1, 1] - y))
