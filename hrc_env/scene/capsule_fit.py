"""Fitting of capsules to a shape, given points on its surface.

A sphere protrudes from a shape by its radius minus the depth of its centre. Therefore, a grid of
depths determines the maximum radius of a capsule along any line. From the capsules along many
random lines, those that cover most of the remaining surface are chosen one after the other.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial import KDTree

from hrc_env.core.typing import Floats, Points3

TRIES = ((0.02, 7), (0.025, 7), (0.025, 14), (0.04, 14), (0.08, 14))
"""Protrusion of capsules from the shape [m] and maximum number of capsules for each attempt, in
order; the first attempt that covers enough of the surface is used."""
UNCOVERED_M = 0.005
"""Maximum distance of a covered surface point from the nearest capsule [m]."""
LEFT_M = 0.015
"""Maximum distance of a surface point from the nearest capsule for a successful attempt [m]."""
LEAST_RADIUS_M = 0.01
"""Minimum radius of a capsule [m]."""
CELL_M = 0.01
"""Spacing of the grid of depths [m]; the spacing of points on surfaces should be half of it."""
WALLS = 5
"""Number of axis directions, out of six, in which a ray from an inner cell must meet the surface.
With this number, an open-ended tube has inner cells, and the corner of an L has none."""
LINES = 8000
"""Number of random lines along which capsules are fitted."""
MIDDLES = 1000
"""Number of points that the random lines connect."""
COUNTED = 1000
"""Number of surface points on which the coverage is measured."""
_TURN = np.pi * (3.0 - 5.0**0.5) * np.arange(120)
_HEIGHT = (2.0 * np.arange(120) + 1.0) / 120.0 - 1.0
SHORT = np.array([0.0, 0.0, 1e-3])
"""Axis of a capsule that is nearly a sphere [m]; MuJoCo requires a positive length."""
SPHERE = np.stack(
    [np.sqrt(1 - _HEIGHT**2) * np.cos(_TURN), np.sqrt(1 - _HEIGHT**2) * np.sin(_TURN), _HEIGHT], -1
)
"""(120, 3) unit vectors that are evenly distributed on a sphere."""


class Rod(NamedTuple):
    """Capsule in the frame of the surface points."""

    start_m: Points3
    """(3,) first end of the capsule's axis [m]."""
    end_m: Points3
    """(3,) second end of the capsule's axis [m]."""
    radius_m: float
    """Radius of the capsule [m]."""


class _Depths(NamedTuple):
    """Regular grid of depths below the surface of a shape."""

    low_m: Points3
    """(3,) centre of the first cell [m]."""
    depth_m: Floats
    """(X, Y, Z) distance of cells from the surface [m]; negative outside."""

    def middles(self) -> Points3:
        """Return the centres (X, Y, Z, 3) of all cells [m]."""
        return np.moveaxis(np.indices(self.depth_m.shape), 0, -1) * CELL_M + self.low_m

    def at(self, points_m: Points3) -> Floats:
        """Return the depths (...) of points (..., 3) [m]."""
        cells = ((points_m - self.low_m) / CELL_M).reshape(-1, 3).T
        depths = map_coordinates(self.depth_m, cells, order=1, mode="nearest")
        return np.asarray(depths, np.float64).reshape(points_m.shape[:-1])


def fit_rods(points_m: Points3) -> list[Rod]:
    """Fit a small number of capsules that cover points on the surface of a shape.

    Args:
        points_m: (N, 3) points with a spacing of at most half of `CELL_M` [m].
    """
    rng = np.random.default_rng(0)
    depths = _measure_depths(points_m)
    counted = points_m
    if len(points_m) > COUNTED:
        counted = points_m[rng.choice(len(points_m), COUNTED, replace=False)]
    best, left_m = list[Rod](), np.inf
    for out_m, most in TRIES:
        rods = _cover(counted, _draw_lines(depths, out_m, rng), most)
        outside = float(_outside_all_m(counted, rods).max())
        if outside < left_m:
            best, left_m = rods, outside
        if outside <= LEFT_M:
            break
    return _shrink(points_m, best)


def _measure_depths(points_m: Points3) -> _Depths:
    """Compute the grid of depths of a shape, given points (N, 3) on its surface [m]."""
    margin_m = max(out_m for out_m, _ in TRIES)
    low_m = points_m.min(0) - margin_m
    counts = np.ceil((points_m.max(0) + margin_m - low_m) / CELL_M).astype(int) + 1
    wall = np.zeros(counts, np.bool_)
    wall[tuple(np.round((points_m - low_m) / CELL_M).astype(int).T)] = True
    walls = np.zeros(counts, int)
    for axis in range(3):
        walls += np.logical_or.accumulate(wall, axis)
        walls += np.flip(np.logical_or.accumulate(np.flip(wall, axis), axis), axis)
    depths = _Depths(low_m, np.where(wall, 0.0, np.where(walls >= WALLS, 1.0, -1.0)))
    away_m = np.asarray(KDTree(points_m).query(depths.middles())[0], np.float64)
    return depths._replace(depth_m=depths.depth_m * away_m)


def _draw_lines(depths: _Depths, out_m: float, rng: np.random.Generator) -> list[Rod]:
    """Return the thickest capsules along random lines that protrude by at most `out_m` [m]."""
    middles = depths.middles()[depths.depth_m + out_m > LEAST_RADIUS_M]
    middles = middles[rng.permutation(len(middles))[:MIDDLES]]
    start, end = middles[rng.integers(len(middles), size=(2, LINES))]
    start, end = np.concatenate([middles, start]), np.concatenate([middles, end]) + SHORT
    shares = np.linspace(0.0, 1.0, 16)[:, None, None]
    radius = depths.at(start + shares * (end - start)).min(0) + out_m
    thick = radius > LEAST_RADIUS_M
    return [Rod(*each) for each in zip(start[thick], end[thick], radius[thick], strict=True)]


def _cover(points_m: Points3, lines: list[Rod], most: int) -> list[Rod]:
    """Choose up to `most` capsules, each of which covers most of the remaining points."""
    covers = np.stack([outside_m(points_m, line) <= UNCOVERED_M for line in lines])
    left, rods = np.ones(len(points_m), np.bool_), list[Rod]()
    while left.any() and len(rods) < most:
        best = int(covers[:, left].sum(1).argmax())
        rods.append(lines[best])
        left &= ~covers[best]
    return rods


def _shrink(points_m: Points3, rods: list[Rod]) -> list[Rod]:
    """Reduce the radii of capsules as far as they continue to cover all points (N, 3)."""
    rods = list(rods)
    for k, rod in enumerate(rods):
        uncovered = points_m[_outside_all_m(points_m, rods[:k] + rods[k + 1 :]) > UNCOVERED_M]
        needed_m = outside_m(uncovered, rod).max(initial=-rod.radius_m) + rod.radius_m - UNCOVERED_M
        radius_m = float(np.clip(needed_m, LEAST_RADIUS_M, rod.radius_m))
        rods[k] = rod._replace(radius_m=radius_m)
    return rods


def _outside_all_m(points_m: Points3, rods: list[Rod]) -> Floats:
    """Return the distance (N,) of points (N, 3) from the surface of the nearest capsule [m]."""
    away_m = [outside_m(points_m, rod) for rod in rods]
    return np.asarray(np.min([np.full(len(points_m), np.inf), *away_m], axis=0))


def sample_rod(rod: Rod) -> Points3:
    """Sample points (N, 3) on the surface of a capsule [m]."""
    along = rod.end_m - rod.start_m
    length = float(np.linalg.norm(along))
    axis = along / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    up = SPHERE @ axis
    ends = np.where(up[:, None] > 0.0, rod.end_m, rod.start_m) + rod.radius_m * SPHERE
    flat = SPHERE[np.abs(up) < 0.9]
    flat = flat - (flat @ axis)[:, None] * axis
    flat /= np.linalg.norm(flat, axis=-1, keepdims=True)
    shares = np.linspace(0.0, 1.0, 2 + int(length / CELL_M))[:, None, None]
    side = rod.start_m + shares * along + rod.radius_m * flat
    return np.asarray(np.concatenate([ends, side.reshape(-1, 3)]), np.float64)


def outside_m(points_m: Points3, rod: Rod) -> Floats:
    """Return the signed distance (N,) of points (N, 3) from a capsule's surface [m].

    It is negative inside the capsule.
    """
    along = rod.end_m - rod.start_m
    share = (points_m - rod.start_m) @ along / max(float(along @ along), 1e-12)
    nearest = rod.start_m + np.clip(share, 0.0, 1.0)[:, None] * along
    return np.asarray(np.linalg.norm(points_m - nearest, axis=-1), np.float64) - rod.radius_m
