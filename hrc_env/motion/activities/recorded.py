"""Playing a clip: two steps into its first pose, the recording, two steps out of its last.

The recording's time gathers pace and loses it again, so that what was cut out of a longer motion
begins and ends at rest. Frames hold `capture.clip.RECORDED`: the columns up to the hands' shift,
then both feet.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.curves import min_jerk, ramp
from hrc_env.motion.feet import foot, raise_heel
from hrc_env.motion.posture import stand

STEP_AT_S, PERIOD_S, SWING_S = 0.12, 0.50, 0.42
"""First lift-off, then the times of `plans` of the steps into a clip and out of it [s]."""
TILT_S = 0.25
"""Time in which standing feet take the pitch that they have in the clip [s]."""
SETTLE_S = STEP_AT_S + PERIOD_S + SWING_S + 0.1 + TILT_S
"""Steps and pitch together [s]."""
PACE_S = 0.6
"""Time in which the recording gathers pace, and loses it [s]."""
END, BEGIN, LAST = 0, 2, 4
"""First of the two footprints where the activity ends, where the clip begins, where it ends."""


@kernel
def clip_lasts(frames_s: float) -> float:
    """How long it takes to play so much of a recording [s]."""
    return frames_s + PACE_S


@kernel
def play(
    t: float, plan: Floats, prints: Floats, stance: Floats, clock_s: float, traits: Floats,
    size: Floats, frames: Floats, q: Floats,
) -> None:  # fmt: skip
    """The control vector, feet included, of someone who plays a clip."""
    since = t - SETTLE_S
    left = plan[pl.CLIP_S] - since
    at = pl.START_X if since < 0.5 * plan[pl.CLIP_S] else pl.END_X
    stand(plan[at], plan[at + 1], plan[at + 2], clock_s, traits, size, q)
    share = min_jerk(t / SETTLE_S) * min_jerk(1.0 + left / SETTLE_S)
    n = plan[pl.CLIP_FRAMES]
    slow = plan[pl.CLIP_S] - PACE_S
    gone_s = PACE_S * (ramp(since / PACE_S) - ramp((since - slow) / PACE_S))
    f = min(max(gone_s * plan[pl.CLIP_FPS], 0.0), n - 1.0)
    _body(f, share, plan, frames, q)
    first = int(plan[pl.CLIP_ROW])
    for side in range(2):
        pitch = c.N_BLENDED + 6 * side + 4
        if since < 0.0:
            foot(t, side, plan, prints[BEGIN:], stance, size, q)
            tilt = min_jerk(1.0 + since / TILT_S)
            raise_heel(side, frames[first, pitch] * tilt, size, q)
        elif left < 0.0:
            foot(-left - TILT_S, side, plan, prints[END:], prints[LAST:], size, q)
            tilt = min_jerk(1.0 + left / TILT_S)
            raise_heel(side, frames[first + int(n) - 1, pitch] * tilt, size, q)
        else:
            _placed_foot(f, side, plan, frames, q)


@kernel
def _between(f: float, column: int, plan: Floats, frames: Floats) -> float:
    """A column of a clip between its frames: Catmull-Rom, its ends held."""
    first, last = int(plan[pl.CLIP_ROW]), int(plan[pl.CLIP_ROW] + plan[pl.CLIP_FRAMES]) - 1
    k = first + int(f)
    u = f - int(f)
    a, b = frames[max(k - 1, first), column], frames[min(k, last), column]
    p, d = frames[min(k + 1, last), column], frames[min(k + 2, last), column]
    curve = 2.0 * a - 5.0 * b + 4.0 * p - d + u * (3.0 * (b - p) + d - a)
    return b + 0.5 * u * (p - a + u * curve)


@kernel
def _body(f: float, share: float, plan: Floats, frames: Floats, q: Floats) -> None:
    """Let a share of a standing q become the clip's root, trunk, head and arms at frame f."""
    cos, sin = math.cos(plan[pl.CLIP_YAW]), math.sin(plan[pl.CLIP_YAW])
    ahead, left = _between(f, c.ROOT_X, plan, frames), _between(f, c.ROOT_Y, plan, frames)
    x = plan[pl.START_X] + cos * ahead - sin * left
    y = plan[pl.START_Y] + sin * ahead + cos * left
    q[c.ROOT_X] += share * (x - q[c.ROOT_X])
    q[c.ROOT_Y] += share * (y - q[c.ROOT_Y])
    yaw = plan[pl.CLIP_YAW] + _between(f, c.HEADING, plan, frames)
    q[c.HEADING] += share * (yaw - q[c.HEADING])
    for i in range(c.PELVIS_Z, c.N_BLENDED):
        q[i] += share * (_between(f, i, plan, frames) - q[i])


@kernel
def _placed_foot(f: float, side: int, plan: Floats, frames: Floats, q: Floats) -> None:
    """The clip's foot at frame f, where the clip is placed."""
    cos, sin = math.cos(plan[pl.CLIP_YAW]), math.sin(plan[pl.CLIP_YAW])
    at, of = c.ANKLE + 6 * side, c.N_BLENDED + 6 * side
    ahead, left = _between(f, of, plan, frames), _between(f, of + 1, plan, frames)
    q[at] = plan[pl.START_X] + cos * ahead - sin * left
    q[at + 1] = plan[pl.START_Y] + sin * ahead + cos * left
    q[at + 3] = plan[pl.CLIP_YAW] + _between(f, of + 3, plan, frames)
    for i in (2, 4, 5):
        q[at + i] = _between(f, of + i, plan, frames)


@kernel
def clip_root(t: float, plan: Floats) -> tuple[float, float]:
    """About where the root of someone who plays a clip is on the floor at time t, and after."""
    lasts = plan[pl.CLIP_S] + 2.0 * SETTLE_S
    u = min(max(t / lasts, 0.0), 1.0) * (pl.N_ROOTS - 1)
    k = min(int(u), pl.N_ROOTS - 2)
    share, at = u - k, pl.ROOTS + 2 * k
    x, y = plan[at], plan[at + 1]
    return x + share * (plan[at + 2] - x), y + share * (plan[at + 3] - y)
