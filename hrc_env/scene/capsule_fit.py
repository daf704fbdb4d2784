"""Capsules that stand for a shape which is known by points on its surface.

A ball reaches out of a shape by its radius less the depth of its middle. A grid of depths
therefore gives the greatest radius of a capsule along any line; of many lines, those whose
capsules cover most of the surface that is left are taken one after the other.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial import KDTree

from hrc_env.core.typing import Floats, Points3

TRIES = ((0.02, 7), (0.025, 7), (0.025, 14), (0.04, 14), (0.08, 14))
"""How far capsules may reach out of the shape [m], and how many they may be: the first with which
enough of the surface is covered."""
UNCOVERED_M = 0.005
"""The surface may reach out of all capsules by this: no more are added then [m]."""
LEFT_M = 0.015
"""By this it may reach out if there are as many capsules as may be [m]."""
LEAST_RADIUS_M = 0.01
CELL_M = 0.01
"""Spacing of the grid of depths; points on surfaces are wanted at half of it [m]."""
WALLS = 5
"""A cell is inside if the surface lies beyond it in at least so many of six directions: a tube with
open ends has an inside, the corner of an L has none."""
LINES, MIDDLES = 8000, 1000
"""Numbers of lines that are tried, and of points that these connect."""
COUNTED = 1000
"""Number of points by which the covered surface is measured."""
_TURN = np.pi * (3.0 - 5.0**0.5) * np.arange(120)
_HEIGHT = (2.0 * np.arange(120) + 1.0) / 120.0 - 1.0
SHORT = np.array([0.0, 0.0, 1e-3])
"""The axis of a capsule that is nearly a ball; MuJoCo wants some length [m]."""
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


class _Depths(NamedTuple):
    """How deep points are in a shape."""

    low_m: Points3
    """(3,) the first cell's middle [m]."""
    depth_m: Floats
    """(X, Y, Z) distance of cells to the surface [m]; negative outside."""

    def middles(self) -> Points3:
        """Return the middles of all cells (X, Y, Z, 3) [m]."""
        return np.moveaxis(np.indices(self.depth_m.shape), 0, -1) * CELL_M + self.low_m

    def at(self, points_m: Points3) -> Floats:
        """Return the depth of points (..., 3) [m]."""
        cells = ((points_m - self.low_m) / CELL_M).reshape(-1, 3).T
        found = map_coordinates(self.depth_m, cells, order=1, mode="nearest")
        return np.asarray(found, np.float64).reshape(points_m.shape[:-1])


def fit_rods(points_m: Points3) -> list[Rod]:
    """Return the few capsules that cover points on the surface of a shape.

    Args:
        points_m: (N, 3), neighbours not farther apart than half of `CELL_M` [m].
    """
    rng = np.random.default_rng(0)
    depths = _measure_depths(points_m)
    counted = points_m
    if len(points_m) > COUNTED:
        counted = points_m[rng.choice(len(points_m), COUNTED, replace=False)]
    covers = []
    for out_m, most in TRIES:
        rods = _cover(counted, _draw_lines(depths, out_m, rng), most)
        covers.append((float(_outside_all_m(counted, rods).max()), rods))
        if covers[-1][0] <= LEFT_M:
            break
    rods = min(covers, key=lambda cover: cover[0])[1]
    return _shrink(points_m, rods)


def _measure_depths(points_m: Points3) -> _Depths:
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
    """Return capsules, the thickest along random lines that reach out of the shape by `out_m`."""
    middles = depths.middles()[depths.depth_m + out_m > LEAST_RADIUS_M]
    middles = middles[rng.permutation(len(middles))[:MIDDLES]]
    start, end = middles[rng.integers(len(middles), size=(2, LINES))]
    start, end = np.concatenate([middles, start]), np.concatenate([middles, end]) + SHORT
    shares = np.linspace(0.0, 1.0, 16)[:, None, None]
    radius = depths.at(start + shares * (end - start)).min(0) + out_m
    thick = radius > LEAST_RADIUS_M
    return [Rod(*each) for each in zip(start[thick], end[thick], radius[thick], strict=True)]


def _cover(points_m: Points3, lines: list[Rod], most: int) -> list[Rod]:
    """Return capsules for points, each the one that covers most of the rest, at most `most`."""
    covers = np.stack([outside_m(points_m, line) <= UNCOVERED_M for line in lines])
    left, rods = np.ones(len(points_m), np.bool_), list[Rod]()
    while left.any() and len(rods) < most:
        best = int(covers[:, left].sum(1).argmax())
        rods.append(lines[best])
        left &= ~covers[best]
    return rods


def _shrink(points_m: Points3, rods: list[Rod]) -> list[Rod]:
    """Return capsules as thin as those points allow which are in no other."""
    rods = list(rods)
    for k, rod in enumerate(rods):
        own = points_m[_outside_all_m(points_m, rods[:k] + rods[k + 1 :]) > UNCOVERED_M]
        needed_m = outside_m(own, rod).max(initial=-rod.radius_m) + rod.radius_m - UNCOVERED_M
        radius_m = float(np.clip(needed_m, LEAST_RADIUS_M, rod.radius_m))
        rods[k] = rod._replace(radius_m=radius_m)
    return rods


def _outside_all_m(points_m: Points3, rods: list[Rod]) -> Floats:
    """Return how far points (N, 3) reach out of all capsules (N,) [m]."""
    away_m = [outside_m(points_m, rod) for rod in rods]
    return np.asarray(np.min([np.full(len(points_m), np.inf), *away_m], axis=0))


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
    shares = np.linspace(0.0, 1.0, 2 + int(length / CELL_M))[:, None, None]
    side = rod.start_m + shares * along + rod.radius_m * flat
    return np.asarray(np.concatenate([ends, side.reshape(-1, 3)]), np.float64)


def outside_m(points_m: Points3, rod: Rod) -> Floats:
    """Return how far points (N, 3) are out of a capsule (N,) [m]; negative inside."""
    along = rod.end_m - rod.start_m
    share = (points_m - rod.start_m) @ along / max(float(along @ along), 1e-12)
    nearest = rod.start_m + np.clip(share, 0.0, 1.0)[:, None] * along
    return np.asarray(np.linalg.norm(points_m - nearest, axis=-1), np.float64) - rod.radius_m
