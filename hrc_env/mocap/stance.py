"""Detection of standing feet in a fitted motion, and their fixation against sliding.

The footprint is the pose that the ankle would have if the foot were flat. A foot stands while its
footprint is at rest. The footprint is then fixed at one pose, and the correction decreases to zero
in the swings before and after.
"""

from typing import NamedTuple

import numpy as np

from hrc_env.core.typing import Bools, Floats
from hrc_env.mocap.person import Run, find_runs, smooth
from hrc_env.mocap.poses import pose_segments
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ANKLE_Z, Anatomy
from hrc_env.motion.clip import find_footprints, shift_by_roll
from hrc_env.motion.curves import decay
from hrc_env.worker.body import SEGMENT

RESTS_M_S = 0.2
"""Speed below which a footprint is at rest [m/s]; it is 0.3 in small steps and 2 in strides."""
LEAST_S = 0.1
"""Minimum duration of a stance, and twice that of a swing [s]."""
FADE_S = 0.25
"""Time in which a correction decreases to zero in a swing [s]."""
SMOOTH_S = 0.02
"""Standard deviation of the smoothing of footprints, which suppresses jitter [s]."""
FLOOR_M = 0.06
"""Height below which a foot at rest stands on the floor instead of on an object [m]."""
FLAT_RAD = 0.01
"""Upward pitch of the toes beyond which a foot stands on its heel [rad]."""


class LockedFeet(NamedTuple):
    """Control vectors in which standing feet do not slide."""

    controls: Floats
    """Control vectors (T, N_CONTROLS)."""
    stands: Bools
    """Mask (T, 2) of the frames in which the left and the right foot stand."""


def lock_feet(q: Floats, fps: float, size: Floats) -> LockedFeet:
    """Fix the standing feet in control vectors to prevent sliding.

    Args:
        q: control vectors (T, N_CONTROLS).
        fps: frame rate [Hz].
        size: dimensions (N_SIZES,) of the body [m].
    """
    out, stands = q.copy(), np.zeros((len(q), 2), bool)
    for side in range(2):
        at = c.ANKLE + 6 * side
        footprint = find_footprints(q[:, at:], size)
        stances = _find_stances(footprint, fps)
        cleaned = footprint + _correct_footprints(footprint, stances, fps, size[ANKLE_Z])
        cleaned[:, 2] = np.maximum(cleaned[:, 2], size[ANKLE_Z])
        out[:, at : at + 3] = cleaned[:, :3] + shift_by_roll(cleaned[:, 3], q[:, at + 4], size)
        out[:, at + 3] = cleaned[:, 3]
        for first, last in stances:
            stands[first:last, side] = True
        loaded = smooth(stands[:, side].astype(float), 2 * SMOOTH_S * fps)
        pitch = q[:, at + 4]
        out[:, at + 5] = np.where(pitch > 0.0, pitch * (1.0 - loaded), pitch)
    return LockedFeet(out, stands)


def measure_slip(q: Floats, stands: Bools, fps: float, anatomy: Anatomy) -> Floats:
    """Return the horizontal speeds of the balls of standing feet, one per frame and foot [m/s].

    Args:
        q: control vectors (T, N_CONTROLS).
        stands: mask (T, 2) of standing feet.
        fps: frame rate [Hz].
        anatomy: measurements of the body.
    """
    position = pose_segments(q, anatomy).position
    speeds = []
    for side, name in enumerate(("left_toes", "right_toes")):
        on = stands[:, side] & (q[:, c.ANKLE + 6 * side + 4] > -FLAT_RAD)
        ball = position[:, SEGMENT[name], :2]
        speed = np.linalg.norm(np.diff(ball, axis=0), axis=-1) * fps
        speeds.append(speed[on[1:] & on[:-1]])
    return np.concatenate(speeds)


def _find_stances(footprint: Floats, fps: float) -> list[Run]:
    """Return the run of frames of each stance."""
    rate = np.gradient(smooth(footprint[:, :3], SMOOTH_S * fps), 1.0 / fps, axis=0)
    rests = np.linalg.norm(rate, axis=-1) < RESTS_M_S
    for first, last in find_runs(~rests):
        inside = first > 0 and last < len(rests)
        if inside and last - first < 0.5 * LEAST_S * fps:
            rests[first:last] = True
    return [run for run in find_runs(rests) if run.end - run.first >= LEAST_S * fps]


def _correct_footprints(
    footprint: Floats, stances: list[Run], fps: float, floor_m: float
) -> Floats:
    """Return corrections (T, 4) that fix footprints in stances and decrease to zero in swings.

    Args:
        footprint: footprint (T, 4) of a foot: x, y, z [m], heading [rad].
        stances: frames of each stance.
        fps: frame rate [Hz].
        floor_m: height of the ankle of a foot on the floor [m].
    """
    change, n = np.zeros_like(footprint), len(footprint)
    rate = np.gradient(footprint, 1.0 / fps, axis=0)
    for k, (first, last) in enumerate(stances):
        place = np.median(footprint[first:last], axis=0)
        if abs(place[2] - floor_m) < FLOOR_M:
            place[2] = floor_m
        change[first:last] += place - footprint[first:last]
        before = stances[k - 1].end if k else 0
        after = stances[k + 1].first if k + 1 < len(stances) else n
        back, ahead = np.arange(first - 1, before - 1, -1), np.arange(last, after)
        change[back] += _fade(len(back), place - footprint[first], rate[first], fps)
        change[ahead] += _fade(len(ahead), place - footprint[last - 1], -rate[last - 1], fps)
    return change


def _fade(n: int, value: Floats, rate: Floats, fps: float) -> Floats:
    """Return values (n, 4) that decay to zero from the value in the previous frame.

    Args:
        n: number of frames.
        value: value (4,) in the frame before the first.
        rate: rate of change (4,) in the frame before the first [1/s].
        fps: frame rate [Hz].
    """
    lasts, out = min(FADE_S, (n + 1) / fps), np.empty((n, 4))
    for k, i in np.ndindex(out.shape):
        out[k, i] = decay((k + 1) / fps / lasts, lasts, value.item(i), rate.item(i))
    return out
