"""Capsules that enclose the clothed body, fitted to its vertices.

Cost and the safety shield measure distances to these, so they must hold the surface and yet
not be fat: a vertex outside counts far more than empty room inside.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

OUTSIDE_WEIGHT = 2.5
"""How much more a vertex outside a capsule weighs than one as far inside."""
HOLD = 0.3
"""Pull of a capsule's ends towards their guesses, where the vertices leave them free."""


@dataclass(frozen=True)
class Capsule:
    """One capsule in the rest frame and the segment that carries it."""

    name: str
    segment: str
    ends: np.ndarray
    radius_m: float


def residual_m(points: np.ndarray, ends: np.ndarray, radius_m: float) -> np.ndarray:
    """Signed distance of points to a capsule's surface, positive outside."""
    axis = ends[1] - ends[0]
    along = np.clip((points - ends[0]) @ axis / max(axis @ axis, 1e-12), 0.0, 1.0)
    return np.linalg.norm(points - ends[0] - along[:, None] * axis, axis=1) - radius_m


def _fit(
    points: np.ndarray, start: np.ndarray, ends_of: Callable, outside: float = OUTSIDE_WEIGHT
) -> np.ndarray:
    """Return parameters (the last one the radius) of the capsule with the surface closest to
    points."""
    hold = HOLD * np.sqrt(len(points))

    def residuals(values: np.ndarray) -> np.ndarray:
        distance = residual_m(points, ends_of(values), values[-1])
        balanced = np.where(distance > 0, outside * distance, distance)
        return np.append(balanced, hold * (values - start)[:-1])

    return least_squares(residuals, start).x


def fit_across(name: str, segment: str, points: np.ndarray) -> Capsule:
    """A capsule from left to right, symmetric about y = 0 (trunk, head, neck)."""

    def ends_of(values: np.ndarray) -> np.ndarray:
        x, z, half, _ = values
        return np.array([[x, abs(half), z], [x, -abs(half), z]])

    start = np.array([points[:, 0].mean(), points[:, 2].mean(), 0.05, 0.1])
    best = _fit(points, start, ends_of)
    return Capsule(name, segment, ends_of(best), float(best[3]))


def fit_upright(
    name: str, segment: str, points: np.ndarray, outside: float = OUTSIDE_WEIGHT
) -> Capsule:
    """A capsule in the plane y = 0 (head, neck)."""

    def ends_of(values: np.ndarray) -> np.ndarray:
        return np.array([[values[0], 0.0, values[1]], [values[2], 0.0, values[3]]])

    middle, low, high = points[:, 0].mean(), *np.percentile(points[:, 2], [25, 75])
    start = np.array([middle, low, middle, high, 0.1])
    best = _fit(points, start, ends_of, outside)
    return Capsule(name, segment, ends_of(best), float(best[4]))


def fit_along(name: str, segment: str, points: np.ndarray, guess: np.ndarray) -> Capsule:
    """A free capsule that starts from two guessed ends (2, 3)."""
    start = np.append(guess.ravel(), 0.06)
    best = _fit(points, start, lambda p: p[:6].reshape(2, 3))
    return Capsule(name, segment, best[:6].reshape(2, 3), float(best[6]))


def mirrored(capsule: Capsule) -> Capsule:
    """The right-hand twin of a left-hand capsule."""
    flip = np.array([1.0, -1.0, 1.0])
    return Capsule(
        capsule.name.replace("left_", "right_"),
        capsule.segment.replace("left_", "right_"),
        capsule.ends * flip,
        capsule.radius_m,
    )


def body_capsules(
    cloth: np.ndarray, part: np.ndarray, head: np.ndarray, hand: np.ndarray, joints: dict
) -> list[Capsule]:
    """All capsules of a clothed body.

    Args:
        cloth: (V, 3) vertices of the clothes, rest frame.
        part: (V,) the part each of them follows.
        head: (V, 3) vertices of head, neck and hat.
        hand: (V, 3) vertices of the left hand.
        joints: origins of the left limbs' segments and the head, by name.
    """
    left = cloth[:, 1] > 0
    z = cloth[:, 2]
    trunk = np.isin(part, ("pelvis", "abdomen", "torso", "chest"))
    waist, ribs, chest = joints["abdomen"][2], joints["torso"][2], joints["chest"][2]
    neck_top = joints["head"][2] - 0.02
    central = [
        fit_upright("head", "head", head[head[:, 2] > neck_top - 0.03], 6.0),
        fit_upright("neck", "neck", _between(head, joints["neck"][2], neck_top)),
        fit_across("chest", "chest", cloth[trunk & (z > chest - 0.01) & (z < chest + 0.16)]),
        fit_across("torso", "torso", cloth[trunk & (z > ribs + 0.01) & (z < chest + 0.02)]),
        fit_across("abdomen", "abdomen", cloth[trunk & (z > waist + 0.02) & (z < ribs + 0.04)]),
        fit_across("pelvis", "pelvis", cloth[(trunk | (part == "thigh")) & _hips(z, waist)]),
    ]
    shoulder = left & (np.isin(part, ("clavicle",)) | ((part == "chest") & (cloth[:, 1] > 0.1)))
    start = {name: joints[f"left_{name}"] for name in _LIMBS}
    limbs = [fit_along("left_shoulder", "left_clavicle", cloth[shoulder & (z > chest + 0.08)],
                       np.stack([start["clavicle"] * [1, 3, 1], start["upper_arm"]]))]  # fmt: skip
    for name, first, last in _SPANS:
        mine = left & (part == name) if name != "foot" else left & np.isin(part, ("foot", "toes"))
        guess = np.stack([start[first], start[last]])
        limbs.append(fit_along(f"left_{name}", f"left_{name}", cloth[mine], guess))
    wrist, reach = start["hand"], hand[np.argmax(hand[:, 1])]
    guess = np.stack([wrist + 0.2 * (reach - wrist), wrist + 0.8 * (reach - wrist)])
    limbs.append(fit_along("left_hand", "left_hand", hand, guess))
    return central + [twin for limb in limbs for twin in (limb, mirrored(limb))]


_LIMBS = ("clavicle", "upper_arm", "forearm", "hand", "thigh", "shank", "foot", "toes")
_SPANS = (
    ("upper_arm", "upper_arm", "forearm"),
    ("forearm", "forearm", "hand"),
    ("thigh", "thigh", "shank"),
    ("shank", "shank", "foot"),
    ("foot", "foot", "toes"),
)


def _between(points: np.ndarray, low: float, high: float) -> np.ndarray:
    return points[(points[:, 2] > low) & (points[:, 2] < high)]


def _hips(z: np.ndarray, waist: float) -> np.ndarray:
    return (z > waist - 0.11) & (z < waist + 0.06)
