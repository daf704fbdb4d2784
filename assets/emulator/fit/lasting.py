"""Correlations of errors: in time, and along limbs."""

import itertools

import numpy as np

from assets.emulator.clips import DT_S
from assets.emulator.fit.cells import N_K, Cells
from assets.emulator.samples import Samples
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import INNER, KIND
from hrc_env.perception.sightlines import HIDDEN, SEEN

SPEEDS = (0.0, 0.08, 0.2, 0.4, 0.7, 1.1, 3.0)
"""Edges of classes of workers by their joints' mean speed [m/s]."""
LAGS = (1, 2, 3, 5, 8, 12, 18, 25, 35, 45)
"""Lags at which correlations in time are taken [frames]."""


def times_of(
    s: Cells, samples: Samples, unit: Floats, in_space: Floats, size: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return shares of constant, lasting and new errors, (K, 3), and their duration [s] and range
    [m]."""
    speed = np.broadcast_to(samples.speed_m_s[:, :, None, None], s.found.shape)
    curves = np.zeros((N_K, len(SPEEDS) - 1, len(LAGS), 2))
    for kind in range(N_K):
        mine = s.pick(None, SEEN, kind) | s.pick(None, HIDDEN, kind)
        for k in range(len(SPEEDS) - 1):
            moves = mine & (speed >= SPEEDS[k]) & (speed < SPEEDS[k + 1])
            sums = [curves[kind, k, :, 0], curves[kind, k, :, 1]]
            add_lagged(sums, np.where(moves[..., None], unit, np.nan))
    pace = np.array([_mean_within(speed, *edges) for edges in itertools.pairwise(SPEEDS)])
    times, best = np.array(LAGS) * DT_S, (np.inf, 0.3, 0.3, np.zeros((N_K, 2)))
    for at_rest_s in np.geomspace(0.2, 6.0, 18):
        for way_m in np.geomspace(0.05, 1.5, 18):
            shape = np.exp(-times * (1 / at_rest_s + pace[:, None] / way_m))
            fits = [_two_parts(curve, shape) for curve in curves]
            miss = sum(error for _, error in fits)
            if miss < best[0]:
                parts = np.array([parts for parts, _ in fits])
                best = (miss, float(at_rest_s), float(way_m), parts)
    shares = np.zeros((N_K, 3))
    for kind in range(N_K):
        stays, lasts = best[3][kind]
        mine = s.pick(0, SEEN, kind)
        common = float(np.median(in_space[mine])) if mine.any() else 0.0
        common /= common + size[0, 0, kind] ** 2
        lasts = max(lasts - common, 0.0) / (1 - common)  # the rest of it varies in space
        stays = min(stays / (1 - common), 1 - lasts)
        shares[kind] = stays, lasts, 1 - stays - lasts
    return np.maximum(shares, 0.0), np.array(best[1]), np.array(best[2])


def _mean_within(values: Floats, low: float, high: float) -> float:
    within = values[(values >= low) & (values < high)]
    return float(within.mean()) if within.size else low


def _two_parts(curve: Floats, shape: Floats) -> tuple[tuple[float, float], float]:
    """Fit a + b shape to a curve with non-negative a and b of sum at most 1.

    Returns a and b, and the squared residual; each lag counts by its sum of squares.
    """
    weight = curve[..., 1] / max(float(curve[..., 1].sum()), 1e-9)
    found = curve[..., 0] / np.maximum(curve[..., 1], 1e-9)
    best = (np.inf, (0.0, 0.0))
    norm = max(float((weight * shape**2).sum()), 1e-9)
    for a in np.linspace(0, 1, 26):
        b = float(np.clip((weight * (found - a) * shape).sum() / norm, 0, 1 - a))
        best = min(best, (float((weight * (a + b * shape - found) ** 2).sum()), (float(a), b)))
    return best[1], best[0]


def limbs_of(s: Cells, unit: Floats) -> Floats:
    """Return the correlation of a joint's error with that of the next joint towards the trunk,
    (K,)."""
    limb = np.zeros(N_K)
    for kind in range(N_K):
        ours = [j for j in range(len(KIND)) if KIND[j] == kind and INNER[j] != j]
        if not ours:
            continue
        mine, inner = unit[..., ours, :], unit[..., INNER[ours], :]
        ok = np.isfinite(mine) & np.isfinite(inner) & (np.abs(mine) < 4) & (np.abs(inner) < 4)
        a, b = mine[ok], inner[ok]
        limb[kind] = np.clip((a * b).mean() / np.sqrt((a**2).mean() * (b**2).mean()), 0, 0.8)
    return limb


def add_lagged(sums: list[Floats], values: Floats) -> None:
    """Add the products of values (L, T, ...) at `LAGS`, and their squares."""
    for i, lag in enumerate(LAGS):
        now, then = values[:, lag:], values[:, :-lag]
        both = np.isfinite(now) & np.isfinite(then)
        sums[0][i] += (now[both] * then[both]).sum()
        sums[1][i] += 0.5 * ((now[both] ** 2).sum() + (then[both] ** 2).sum())
