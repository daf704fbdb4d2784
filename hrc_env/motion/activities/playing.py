"""Playing a clip: two steps into its first pose, the recording, two steps out of its last.

Frames hold `clip.RECORDED`, of pieces (`pieces.Clips`).
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.pieces import Clips
from hrc_env.motion.anatomy import ANKLE_Z
from hrc_env.motion.clip import footprints
from hrc_env.motion.curves import min_jerk, placed, ramp
from hrc_env.motion.feet import foot, raise_heel
from hrc_env.motion.posture import STANCE_HALF_WIDTH_M, stand
from hrc_env.motion.state import N_ROOTS, Pair, Worker
from hrc_env.motion.walk import footprint

STEP_AT_S, PERIOD_S, SWING_S = 0.12, 0.50, 0.42
"""First lift-off, from one to the next, in the air: steps into a clip and out of it [s]."""
TILT_S, PACE_S = 0.25, 0.6
"""In which standing feet take their pitch in the clip; the recording gathers and loses pace [s]."""
SETTLE_S = STEP_AT_S + PERIOD_S + SWING_S + 0.1 + TILT_S
"""Steps and pitch together [s]."""
END, BEGIN, LAST = 0, 2, 4
"""First of the two footprints where the activity ends, where the clip begins, where it ends."""
STRIDE_SHARE = 0.25
"""Share of a full stride that the steps into a clip and out of it are."""


def start_clip(piece: int, turn_rad: float, clips: Clips, me: Worker) -> float:
    """Plan to play a piece where the worker stands, turned from their heading; how long [s]."""
    prints, size = me["prints"], me["size"]
    row = int(me["body"]) * clips.n_rows + int(clips.row[piece])
    n, fps = int(clips.count[piece]), float(clips.fps[piece])
    q = clips.frames[row : row + n]
    yaw = float(me["start_yaw"]) + turn_rad
    lasts = (n - 1) / fps + PACE_S
    me["clip_row"], me["clip_frames"], me["clip_fps"] = row, n, fps
    me["clip_yaw"], me["clip_s"] = yaw, lasts
    me["step_start"], me["step_period"], me["step_swing"] = STEP_AT_S, PERIOD_S, SWING_S
    me["step_first"], me["step_count"], me["undo_at"] = 0, 2, 0.0
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn, origin = np.array([[cos, -sin], [sin, cos]]), np.array([me["start_x"], me["start_y"]])
    way = q[:, [c.ROOT_X, c.ROOT_Y]] @ turn.T + origin
    x, y, heading = float(way[-1, 0]), float(way[-1, 1]), float(yaw + q[-1, c.HEADING])
    me["end_x"], me["end_y"], me["end_yaw"] = x, y, heading
    prints[: LAST + 2, 3] = STRIDE_SHARE
    for side in range(2):
        footprint(side, x, y, heading, STANCE_HALF_WIDTH_M, prints[END + side], me)
        feet = footprints(q[[0, -1], c.N_BLENDED + 6 * side :], size)
        for at, foot_ in zip((BEGIN, LAST), feet, strict=True):
            prints[at + side, :2] = turn @ foot_[:2] + origin
            prints[at + side, 2] = foot_[3] + yaw
            prints[at + side, 4] = foot_[2] - size[ANKLE_Z]
    whole = lasts + 2.0 * SETTLE_S
    for k, since in enumerate(np.linspace(0.0, whole, N_ROOTS) - SETTLE_S):
        me["roots"][k] = way[min(round(_gone_s(since, me) * fps), n - 1)]
    return whole


@kernel
def _gone_s(since: float, me: Worker) -> float:
    """Time of the recording that is over: it gathers pace and loses it again."""
    slow = me.clip_s - PACE_S
    return PACE_S * (ramp(since / PACE_S) - ramp((since - slow) / PACE_S))


@kernel
def play(t: float, clock_s: float, frames: Floats, me: Worker) -> None:
    """The control vector, feet included, of someone who plays a clip."""
    since = t - SETTLE_S
    left = me.clip_s - since
    if since < 0.5 * me.clip_s:
        stand(me.start_x, me.start_y, me.start_yaw, clock_s, me)
    else:
        stand(me.end_x, me.end_y, me.end_yaw, clock_s, me)
    share = min_jerk(t / SETTLE_S) * min_jerk(1.0 + left / SETTLE_S)
    first, n = me.clip_row, me.clip_frames
    f = min(max(_gone_s(since, me) * me.clip_fps, 0.0), n - 1.0)
    _body(f, share, frames, me)
    for side in range(2):
        pitch = c.N_BLENDED + 6 * side + 4
        if since < 0.0:
            foot(t, side, me.prints[BEGIN:], me.stance, me)
            tilt = min_jerk(1.0 + since / TILT_S)
            raise_heel(side, frames[first, pitch] * tilt, me)
        elif left < 0.0:
            foot(-left - TILT_S, side, me.prints[END:], me.prints[LAST:], me)
            tilt = min_jerk(1.0 + left / TILT_S)
            raise_heel(side, frames[first + n - 1, pitch] * tilt, me)
        else:
            _placed_foot(f, side, frames, me)


@kernel
def _between(f: float, column: int, frames: Floats, me: Worker) -> float:
    """A column of a clip between its frames: Catmull-Rom, its ends held."""
    first, last = me.clip_row, me.clip_row + me.clip_frames - 1
    k = first + int(f)
    u = f - int(f)
    a, b = frames[max(k - 1, first), column], frames[min(k, last), column]
    p, d = frames[min(k + 1, last), column], frames[min(k + 2, last), column]
    curve = 2.0 * a - 5.0 * b + 4.0 * p - d + u * (3.0 * (b - p) + d - a)
    return b + 0.5 * u * (p - a + u * curve)


@kernel
def _body(f: float, share: float, frames: Floats, me: Worker) -> None:
    """Let a share of a standing q become the clip's root, trunk, head and arms at frame f."""
    q = me.q
    ahead, left = _between(f, c.ROOT_X, frames, me), _between(f, c.ROOT_Y, frames, me)
    x, y = placed(me.start_x, me.start_y, me.clip_yaw, ahead, left)
    q[c.ROOT_X] += share * (x - q[c.ROOT_X])
    q[c.ROOT_Y] += share * (y - q[c.ROOT_Y])
    yaw = me.clip_yaw + _between(f, c.HEADING, frames, me)
    q[c.HEADING] += share * (yaw - q[c.HEADING])
    for i in range(c.PELVIS_Z, c.N_BLENDED):
        q[i] += share * (_between(f, i, frames, me) - q[i])


@kernel
def _placed_foot(f: float, side: int, frames: Floats, me: Worker) -> None:
    """The clip's foot at frame f, where the clip is placed."""
    q, at, of = me.q, c.ANKLE + 6 * side, c.N_BLENDED + 6 * side
    ahead, left = _between(f, of, frames, me), _between(f, of + 1, frames, me)
    q[at], q[at + 1] = placed(me.start_x, me.start_y, me.clip_yaw, ahead, left)
    q[at + 3] = me.clip_yaw + _between(f, of + 3, frames, me)
    for i in (2, 4, 5):
        q[at + i] = _between(f, of + i, frames, me)


@kernel
def clip_root(t: float, me: Worker) -> Pair:
    """About where the root of someone who plays a clip is on the floor at time t, and after."""
    lasts = me.clip_s + 2.0 * SETTLE_S
    u = min(max(t / lasts, 0.0), 1.0) * (N_ROOTS - 1)
    k = min(int(u), N_ROOTS - 2)
    share, roots = u - k, me.roots
    x, y = roots[k, 0], roots[k, 1]
    return x + share * (roots[k + 1, 0] - x), y + share * (roots[k + 1, 1] - y)
