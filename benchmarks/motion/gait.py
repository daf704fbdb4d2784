"""Numbers of a walk in its steady part, as they were taken of recorded walks."""

from itertools import pairwise

import numpy as np

from benchmarks.motion.statistics import SIDES
from hrc_env.core.typing import Floats
from hrc_env.motion.repertoire import Film
from hrc_env.worker.body import SEGMENT

STEADY_SHARE = 0.97
"""Of the top speed: from there on a walk is steady."""


def gait_of(film: Film) -> dict[str, float]:
    """Cadence, step length and width, bob and knee flexion of a straight walk."""
    place, rate = film.motion.position_world[:, 0], film.motion.velocity_world[:, 0]
    ahead = place[-1, 0, :2] - place[0, 0, :2]
    ahead /= np.linalg.norm(ahead)
    speed = _smooth(rate[:, 0, :2] @ ahead)
    steady = np.flatnonzero(speed > STEADY_SHARE * np.percentile(speed, 90))
    part = slice(steady[0], steady[-1] + 1)
    left, right = (place[part, SEGMENT[f"{side}_foot"], :2] for side in SIDES)
    apart = (left - right) @ ahead
    passed = np.flatnonzero(apart[1:] * apart[:-1] < 0.0)  # one foot passes the other
    step_s = float(np.median(np.diff(film.time_s[part][passed])))
    steps = [a + int(np.argmax(np.abs(apart[a:b]))) for a, b in pairwise(passed)]
    beside = np.abs((left - right) @ np.array([-ahead[1], ahead[0]]))[steps]
    height = place[part, 0, 2]
    bobs = [np.ptp(height[a:b]) for a, b in pairwise(steps)]
    return {
        "cadence_per_min": 60.0 / step_s,
        "step_length_m": float(speed[part].mean()) * step_s,
        "step_width_m": float(beside.mean()),
        "bob_m": float(np.median(bobs)),
        "knee_flexion_deg": max(float(knee_flexion_deg(place[part], side).max()) for side in SIDES),
    }


def _smooth(speed: Floats) -> Floats:
    """Mean over about half a second of a film at 100 Hz."""
    window = np.ones(51) / 51
    return np.convolve(np.pad(speed, 25, "edge"), window, "valid")


def knee_flexion_deg(place: Floats, side: str) -> Floats:
    """(T,) from segments' origins (T, 22, 3); 0 is straight."""
    hip, knee, ankle = (place[:, SEGMENT[f"{side}_{n}"]] for n in ("thigh", "shank", "foot"))
    thigh, shank = knee - hip, ankle - knee
    cosine = (thigh * shank).sum(-1) / np.linalg.norm(thigh, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine / np.linalg.norm(shank, axis=-1), -1.0, 1.0)))
