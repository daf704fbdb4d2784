"""Capsules that stand for a shape which is known by points on its surface."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, KDTree, QhullError

from hrc_env.core.typing import Bools, Floats, Points3

TIGHT_M = 0.025
"""A capsule may reach out of the shape, and the shape out of it, by about this [m]."""
MOST = 5
"""Greatest number of capsules for one shape."""
LEAST_POINTS = 12
LEAST_RADIUS_M = 0.01
_TURN = np.pi * (3.0 - 5.0**0.5) * np.arange(120)
_HEIGHT = (2.0 * np.arange(120) + 1.0) / 120.0 - 1.0
SPHERE = np.stack(
    [np.sqrt(1 - _HEIGHT**2) * np.cos(_TURN), np.sqrt(1 - _HEIGHT**2) * np.sin(_TURN), _HEIGHT], -1
)
"""Directions (120, 3) all over a sphere."""


class Rod(NamedTuple):
    """A capsule in the frame of the points."""

    start_m: Points3
    end_m: Points3
    """(3,) [m]."""
    radius_m: float


class _Part(NamedTuple):
    """Some of the points, and the capsule round them."""

    points: Points3
    rod: Rod
    hull: Floats
    """(F, 4) the sides of their convex hull."""


def fit_rods(points_m: Points3) -> list[Rod]:
    """Return capsules round points (N, 3) on the surface of a shape [m]: one, or more where one
    would be too thick.

    The part whose capsule reaches farthest out of the shape is cut in two across its longest side,
    until all are tight or there are `MOST`.
    """
    parts, tree = [_part(points_m)], KDTree(points_m)
    while len(parts) < MOST:
        loose = [_looseness_m(k, parts, tree) for k in range(len(parts))]
        worst = int(np.argmax(loose))
        if loose[worst] < TIGHT_M:
            break
        parts[worst : worst + 1] = [_part(each) for each in _cut(parts[worst].points)]
    return [part.rod for part in parts]


def _part(points: Points3) -> _Part:
    return _Part(points, _round(points), sides_of_hull(points))


def surface_of_rod(rod: Rod) -> Points3:
    """Return points (N, 3) all over the surface of a capsule [m]."""
    along = rod.end_m - rod.start_m
    length = float(np.linalg.norm(along))
    axis = along / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    up = SPHERE @ axis
    ends = np.where(up[:, None] > 0.0, rod.end_m, rod.start_m) + rod.radius_m * SPHERE
    flat = SPHERE[np.abs(up) < 0.9]
    flat = flat - (flat @ axis)[:, None] * axis
    flat /= np.linalg.norm(flat, axis=-1, keepdims=True)
    shares = np.linspace(0.0, 1.0, 2 + int(length / TIGHT_M))[:, None, None]
    side = rod.start_m + shares * along + rod.radius_m * flat
    return np.asarray(np.concatenate([ends, side.reshape(-1, 3)]), np.float64)


def outside_m(points_m: Points3, rod: Rod) -> Floats:
    """Return how far points (N, 3) are out of a capsule (N,) [m]; negative inside."""
    along = rod.end_m - rod.start_m
    share = (points_m - rod.start_m) @ along / max(float(along @ along), 1e-12)
    nearest = rod.start_m + np.clip(share, 0.0, 1.0)[:, None] * along
    return np.asarray(np.linalg.norm(points_m - nearest, axis=-1), np.float64) - rod.radius_m


def _looseness_m(k: int, parts: list[_Part], tree: KDTree) -> float:
    """Return how far a capsule, where it is in no other, reaches out of the shape at most [m]."""
    if len(parts[k].points) <= LEAST_POINTS:
        return 0.0
    surface = surface_of_rod(parts[k].rod)
    for other in (*parts[:k], *parts[k + 1 :]):
        surface = surface[outside_m(surface, other.rod) > 0.0]
    away_m = np.asarray(tree.query(surface)[0]) if len(surface) else np.zeros(0)
    surface, away_m = surface[away_m > TIGHT_M], away_m[away_m > TIGHT_M]
    hidden = np.zeros(len(surface), np.bool_)
    for part in parts:
        hidden |= are_inside_sides(part.hull, surface)
    return float(away_m[~hidden].max(initial=0.0))


def sides_of_hull(points_m: Points3) -> Floats:
    """Return the sides (F, 4) of the convex hull of points (N, 3): normals outwards, and less their
    distance from the origin; of points in a plane, a side that leaves nothing inside."""
    try:
        return np.asarray(ConvexHull(points_m).equations, np.float64)
    except (QhullError, ValueError):
        return np.array([[0.0, 0.0, 0.0, 1.0]])


def are_inside_sides(sides: Floats, asked_m: Points3) -> Bools:
    """Return which of some points (M, 3) are behind all sides (F, 4) of a hull."""
    return np.asarray((asked_m @ sides[:, :3].T + sides[:, 3] <= 0.0).all(-1))


def _axes(points: Points3) -> Points3:
    """Return the principal axes (3, 3) of points, the longest first."""
    off = points - points.mean(0)
    return np.asarray(np.linalg.svd(off, full_matrices=False)[2], np.float64)


def _round(points: Points3) -> Rod:
    """Return the smallest capsule round all points along one of their principal axes."""
    axes = _axes(points)
    rods = [_along(points, np.roll(axes, -k, axis=0)) for k in range(len(axes))]
    return min(rods, key=_volume_m3)


def _along(points: Points3, axes: Points3) -> Rod:
    """Return a capsule round all points along the first of some axes (3, 3)."""
    local = points @ axes.T
    middle = (local.max(0) + local.min(0)) / 2
    off = local - middle
    across = np.linalg.norm(off[:, 1:], axis=-1)
    radius = max(float(across.max()) - TIGHT_M / 4, LEAST_RADIUS_M)
    # The ends are as near to the middle as the points allow, round them all.
    rise = np.sqrt(np.maximum(radius**2 - np.minimum(across, radius) ** 2, 0.0))
    half = max(float((np.abs(off[:, 0]) - rise).max()), 0.0)
    ends = np.array([[-half, 0.0, 0.0], [half, 0.0, 0.0]]) + middle
    start, end = ends @ axes
    return Rod(start, end, radius)


def _volume_m3(rod: Rod) -> float:
    length = float(np.linalg.norm(rod.end_m - rod.start_m))
    return np.pi * rod.radius_m**2 * (length + 4.0 / 3.0 * rod.radius_m)


def _cut(points: Points3) -> list[Points3]:
    """Return two parts of points, cut across the longest side of their box."""
    axes = _axes(points)
    local = points @ axes.T
    side = int(np.argmax(np.ptp(local, axis=0)))
    middle = (local[:, side].max() + local[:, side].min()) / 2
    low = local[:, side] < middle
    return [part for part in (points[low], points[~low]) if len(part)]
