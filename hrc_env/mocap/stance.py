"""Feet that stand: found in a fitted motion, and locked so that they do not slide.

A foot stands while its footprint, where a flat foot's ankle would be, rests. That is set to one
place then, and the change fades out in the swings before and after.
"""

import numpy as np

from hrc_env.core.typing import Bools, Floats
from hrc_env.mocap.person import runs, smoothed
from hrc_env.mocap.poses import posed
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ANKLE_Z, Anatomy
from hrc_env.motion.clip import find_footprints, shift_by_roll
from hrc_env.motion.curves import decay
from hrc_env.worker.body import SEGMENT

RESTS_M_S = 0.2
"""A footprint slower than this rests [m/s]: a small step moves it at 0.3, a stride at 2."""
LEAST_S, FADE_S, SMOOTH_S = 0.1, 0.25, 0.02
"""Shortest stance, and twice the shortest gap; in which a correction fades out in a swing; speed is
smoothed against the jitter of recordings [s]."""
FLOOR_M, FLAT_RAD = 0.06, 0.01
"""A foot that rests lower stands on the floor, else on something of its height [m]; one whose toes
are up by more on its heel."""


def locked(q: Floats, fps: float, size: Floats) -> tuple[Floats, Bools]:
    """Control vectors (T, N_CONTROLS) with feet that stand still, and when each stands (T, 2)."""
    out, stands = q.copy(), np.zeros((len(q), 2), bool)
    for side in range(2):
        at = c.ANKLE + 6 * side
        footprint = find_footprints(q[:, at:], size)
        stances = _stances(footprint, fps)
        cleaned = footprint + _corrections(footprint, stances, fps, size[ANKLE_Z])
        cleaned[:, 2] = np.maximum(cleaned[:, 2], size[ANKLE_Z])
        out[:, at : at + 3] = cleaned[:, :3] + shift_by_roll(cleaned[:, 3], q[:, at + 4], size)
        out[:, at + 3] = cleaned[:, 3]
        for first, last in stances:
            stands[first:last, side] = True
        loaded = smoothed(stands[:, side].astype(float), 2 * SMOOTH_S * fps)
        pitch = q[:, at + 4]
        out[:, at + 5] = np.where(pitch > 0.0, pitch * (1.0 - loaded), pitch)
    return out, stands


def slip(q: Floats, stands: Bools, fps: float, anatomy: Anatomy) -> Floats:
    """Speeds along the floor of the balls of standing feet [m/s], one a frame and foot."""
    position, _, _ = posed(q, anatomy)
    speeds = []
    for side, name in enumerate(("left_toes", "right_toes")):
        on = stands[:, side] & (q[:, c.ANKLE + 6 * side + 4] > -FLAT_RAD)
        ball = position[:, SEGMENT[name], :2]
        speed = np.linalg.norm(np.diff(ball, axis=0), axis=-1) * fps
        speeds.append(speed[on[1:] & on[:-1]])
    return np.concatenate(speeds)


def _stances(footprint: Floats, fps: float) -> list[tuple[int, int]]:
    """(first, one past the last) frame of each stance."""
    rate = np.gradient(smoothed(footprint[:, :3], SMOOTH_S * fps), 1.0 / fps, axis=0)
    rests = np.linalg.norm(rate, axis=-1) < RESTS_M_S
    for first, last in runs(~rests):
        inside = first > 0 and last < len(rests)
        if inside and last - first < 0.5 * LEAST_S * fps:
            rests[first:last] = True
    return [(a, b) for a, b in runs(rests) if b - a >= LEAST_S * fps]


def _corrections(
    footprint: Floats, stances: list[tuple[int, int]], fps: float, floor_m: float
) -> Floats:
    """(T, 4) what takes footprints x, y, z, heading to one place a stance, fading between."""
    change, n = np.zeros_like(footprint), len(footprint)
    rate = np.gradient(footprint, 1.0 / fps, axis=0)
    for k, (first, last) in enumerate(stances):
        place = np.median(footprint[first:last], axis=0)
        if abs(place[2] - floor_m) < FLOOR_M:
            place[2] = floor_m
        change[first:last] += place - footprint[first:last]
        before = stances[k - 1][1] if k else 0
        after = stances[k + 1][0] if k + 1 < len(stances) else n
        back, ahead = np.arange(first - 1, before - 1, -1), np.arange(last, after)
        change[back] += _fading(len(back), place - footprint[first], rate[first], fps)
        change[ahead] += _fading(len(ahead), place - footprint[last - 1], -rate[last - 1], fps)
    return change


def _fading(n: int, value: Floats, rate: Floats, fps: float) -> Floats:
    """(n, 4) the frames after one with a value and a rate, falling to zero within them."""
    lasts, out = min(FADE_S, (n + 1) / fps), np.empty((n, 4))
    for k, i in np.ndindex(out.shape):
        out[k, i] = decay((k + 1) / fps / lasts, lasts, value.item(i), rate.item(i))
    return out
