"""Capsules that stand for a shape which is known by points on its surface."""

from typing import NamedTuple

import numpy as np

from hrc_env.core.typing import Points3

TIGHT_M = 0.02
"""A capsule may reach out of the shape, and the shape out of it, by about this [m]."""
MOST = 8
"""Greatest number of capsules for one shape."""
LEAST_POINTS = 12
LEAST_RADIUS_M = 0.01


class Rod(NamedTuple):
    """A capsule in the frame of the points."""

    start_m: Points3
    end_m: Points3
    """(3,) [m]."""
    radius_m: float


def fit_rods(points_m: Points3) -> list[Rod]:
    """Return capsules round points (N, 3) [m]: one, or more where one would be too thick.

    The part whose capsule reaches farthest out of its points is cut in two across its longest side,
    until all are tight or there are `MOST`.
    """
    parts = [points_m]
    while len(parts) < MOST:
        loose = [_looseness_m(part) if len(part) > LEAST_POINTS else 0.0 for part in parts]
        worst = int(np.argmax(loose))
        if loose[worst] < TIGHT_M:
            break
        parts[worst : worst + 1] = _cut(parts[worst])
    return [_round(part) for part in parts]


def _axes(points: Points3) -> tuple[Points3, Points3]:
    """Return the middle and the principal axes (3, 3), the longest first."""
    middle = (points.max(0) + points.min(0)) / 2
    off = points - points.mean(0)
    _, _, axes = np.linalg.svd(off, full_matrices=False)
    return middle, axes


def _round(points: Points3) -> Rod:
    """Return a capsule round all points along their longest axis."""
    _, axes = _axes(points)
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


def _looseness_m(points: Points3) -> float:
    """Return how far the capsule round points reaches out of them: how much farther its surface is
    from the axis than the points are, in the direction in which they are nearest."""
    rod, (_, axes) = _round(points), _axes(points)
    local = (points - (rod.start_m + rod.end_m) / 2) @ axes.T
    angle = np.arctan2(local[:, 2], local[:, 1])
    sector = ((angle + np.pi) / (2 * np.pi) * 8).astype(int) % 8
    reach = np.zeros(8)
    np.maximum.at(reach, sector, np.linalg.norm(local[:, 1:], axis=-1))
    half = float(np.linalg.norm(rod.end_m - rod.start_m)) / 2
    tip = half + rod.radius_m - float(np.abs(local[:, 0]).max())
    seen = reach[reach > 0]
    sideways = rod.radius_m - float(seen.min()) if len(seen) else 0.0
    return max(sideways, tip, 0.0)


def _cut(points: Points3) -> list[Points3]:
    """Return two parts of points, cut across the longest side of their box."""
    _, axes = _axes(points)
    local = points @ axes.T
    side = int(np.argmax(np.ptp(local, axis=0)))
    middle = (local[:, side].max() + local[:, side].min()) / 2
    low = local[:, side] < middle
    return [part for part in (points[low], points[~low]) if len(part)]
