"""Statistics of the workers' motion: speeds, accelerations and errors.

The errors are slipping feet, hands that miss their targets, and self-intersections.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hrc_env.core.typing import Bools, Floats
from hrc_env.motion import controls as c
from hrc_env.motion import state as st
from hrc_env.motion.anatomy import GRIP_M
from hrc_env.motion.repertoire import Film
from hrc_env.worker.body import SEGMENT, Body, worker_truth

SIDES = ("left", "right")
WRISTS = [SEGMENT[f"{side}_hand"] for side in SIDES]
ANKLES = [SEGMENT[f"{side}_foot"] for side in SIDES]
HEAD = [SEGMENT["head"]]
MISSED_M = 0.01
"""Distance of a hand from its target above which it has missed the target [m]."""
LOADED_M = 0.001
"""Height above the ground of the ball of a foot, below which the foot is considered loaded [m]."""
STEADY_SHARE = 0.97
"""Fraction of the top speed above which a walk is considered steady."""
DEEP_M = 0.05
"""Depth above which capsules count as intersecting [m]. Smaller depths are ignored, since limbs are
not exactly capsules and tissue is soft.
"""


def compute_statistics(films: Sequence[Film], body: Body) -> dict[str, float]:
    """Compute the statistics of a motion over all frames of its films."""
    numbers: dict[str, float] = {}
    for name, which in (("wrist", WRISTS), ("ankle", ANKLES), ("head", HEAD)):
        speeds = np.concatenate([_speeds(film, which) for film in films])
        alike = name == "ankle" or films[0].activity == st.WALK
        speeds = speeds.ravel() if alike else speeds.max(1)  # at work, the faster hand is measured
        numbers[f"{name}_p95_m_s"] = float(np.percentile(speeds, 95))
        numbers[f"{name}_max_m_s"] = float(speeds.max())
        rates = np.concatenate([_accelerations(film, which) for film in films])
        numbers[f"{name}_p999_m_s2"] = float(np.percentile(rates, 99.9))
    pelvis = np.concatenate([film.motion.position_world[:, 0, 0, 2] for film in films])
    numbers["pelvis_low_m"] = float(pelvis.min())
    numbers["slip_p95_m_s"] = _percentile(
        np.concatenate([compute_slips(film) for film in films]), 95
    )
    missed = np.concatenate([compute_misses(film) for film in films])
    numbers["grip_missed_share"] = float((missed > MISSED_M).mean()) if missed.size else 0.0
    inside = np.concatenate([compute_depths(film, body) > DEEP_M for film in films])
    numbers["inside_itself_share"] = float(inside.mean())
    return numbers


def _percentile(values: Floats, share: float) -> float:
    return float(np.percentile(values, share)) if values.size else 0.0


def _speeds(film: Film, which: list[int]) -> Floats:
    """Return the speeds (T, n) of the origins of the given segments [m/s]."""
    return np.linalg.norm(film.motion.velocity_world[:, 0, which], axis=-1)


def _accelerations(film: Film, which: list[int]) -> Floats:
    """Return the accelerations of the origins of the given segments in all frames [m/s^2]."""
    velocity = film.motion.velocity_world[:, 0, which]
    change = np.diff(velocity, axis=0) / np.diff(film.time_s)[:, None, None]
    return np.linalg.norm(change, axis=-1).ravel()


def compute_slips(film: Film) -> Floats:
    """Return the speeds of the balls of all loaded feet in all frames [m/s]."""
    grounds = np.unique(np.round([0.0, *film.worker.footprints[:, 4]], 4))
    found = []
    for side in SIDES:
        ball = SEGMENT[f"{side}_toes"]
        height = film.motion.position_world[:, 0, ball, 2]
        rest = min(height[0], height[-1])  # activities begin and end on the floor
        above = np.abs(height[:, None] - rest - grounds).min(1)
        speed = np.linalg.norm(film.motion.velocity_world[:, 0, ball], axis=-1)
        found.append(speed[above < LOADED_M])
    return np.concatenate(found)


def compute_grips(film: Film) -> Floats:
    """Return the grip positions (T, 2, 3), beyond the wrists along the forearms [m]."""
    place = film.motion.position_world[:, 0]
    both = []
    for side in SIDES:
        wrist = place[:, SEGMENT[f"{side}_hand"]]
        along = wrist - place[:, SEGMENT[f"{side}_forearm"]]
        both.append(wrist + GRIP_M * along / np.linalg.norm(along, axis=-1, keepdims=True))
    return np.stack(both, 1)


def find_arrivals(film: Film) -> Bools:
    """Return a mask (T, 2) of frames in which each hand should be at its target."""
    return film.controls[:, c.HAND_SHARE : c.HAND_SHARE + 2] > 1.0 - 1e-9


def compute_misses(film: Film) -> Floats:
    """Return the distances of the hands from their targets [m].

    Frames in which a hand has no target are excluded.
    """
    wished = film.controls[:, c.HAND_TARGET : c.HAND_TARGET + 6].reshape(-1, 2, 3)
    return np.linalg.norm(compute_grips(film) - wished, axis=-1)[find_arrivals(film)]


def compute_depths(film: Film, body: Body) -> Floats:
    """Return the maximum depth (T,) of intersections of limbs with other body parts [m].

    Without an intersection, the value is the negative clearance.
    """
    truth = worker_truth(body, film.motion)
    capsules, radius = truth.capsules_world[:, 0], truth.capsule_radius_m[0, 0]
    deepest = np.full(len(film.time_s), -np.inf)
    for limb, part in _pairs(body):
        a, b = capsules[:, part, 0, None], capsules[:, part, 1, None]
        shares = np.linspace(0.0, 1.0, 5)[:, None]
        points = capsules[:, limb, 0, None] * (1 - shares) + capsules[:, limb, 1, None] * shares
        length = np.maximum(((b - a) ** 2).sum(-1), 1e-12)
        along = np.clip(((points - a) * (b - a)).sum(-1) / length, 0.0, 1.0)[..., None]
        apart = np.linalg.norm(points - a - along * (b - a), axis=-1).min(1)
        deepest = np.maximum(deepest, radius[limb] + radius[part] - apart)
    return deepest


def _pairs(body: Body) -> list[tuple[int, int]]:
    """Return the index pairs of capsules that should not intersect."""
    at = {name: index for index, name in enumerate(body.capsule_names)}
    trunk = ("pelvis", "abdomen", "torso", "chest", "head")
    named = [(f"{side}_hand", part) for side in SIDES for part in trunk]
    named += [(f"{side}_forearm", part) for side in SIDES for part in ("chest", "torso", "head")]
    named += [(f"{side}_hand", f"{other}_thigh") for side in SIDES for other in SIDES]
    named += [(f"{side}_hand", f"{other}_shank") for side in SIDES for other in SIDES]
    named += [("left_shank", "right_shank"), ("left_foot", "right_foot")]
    return [(at[a], at[b]) for a, b in named if a in at and b in at]


def compute_gait(film: Film) -> dict[str, float]:
    """Compute cadence, step size, vertical oscillation and knee flexion of a straight walk."""
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
    """Return the moving average of speeds at 100 Hz over about half a second."""
    window = np.ones(51) / 51
    return np.convolve(np.pad(speed, 25, "edge"), window, "valid")


def knee_flexion_deg(place: Floats, side: str) -> Floats:
    """Compute knee flexion (T,) from segment origins (T, 22, 3) [deg]; 0 is a straight leg."""
    hip, knee, ankle = (place[:, SEGMENT[f"{side}_{n}"]] for n in ("thigh", "shank", "foot"))
    thigh, shank = knee - hip, ankle - knee
    cosine = (thigh * shank).sum(-1) / np.linalg.norm(thigh, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine / np.linalg.norm(shank, axis=-1), -1.0, 1.0)))
