"""From what the pose network said of rendered workers to a calibration of the emulator."""

import itertools
import math
from dataclasses import replace

import numpy as np

from hrc_env.experiments.calibration.clips import DT_S
from hrc_env.experiments.calibration.samples import Samples
from hrc_env.perception.calibration import (
    HAND,
    INNER,
    KIND,
    KINDS,
    KNOTS,
    N_SEEN,
    N_VIEWS,
    POSTURES,
    SIGHTS,
    VISIBILITY,
    Calibration,
)
from hrc_env.perception.emulator_kernel import HIDDEN, OUTSIDE, SEEN
from hrc_env.perception.eyes import STATURE_OF_SIDE
from hrc_env.typing import Bools, Floats

N_K, N_P, N_S = len(KINDS), len(POSTURES), len(SIGHTS)
LOG_RAYLEIGH_MEAN, LOG_RAYLEIGH_VAR = 0.5 * (math.log(2) - np.euler_gamma), math.pi**2 / 24
"""Of the logarithm of the length of two normal variables of standard deviation 1."""
TOLD = 1.2
"""What is told is larger than what is measured by this, as errors that last and that cameras share
do not average. Chosen on half of the clips: 1 covers .88, 1.2 .90, 1.4 .91 (upright bodies), and
the tracker's median error is 20.4, 21.1 and 22.0 mm."""
FEW = 300
"""A cell of a table with fewer samples is drawn towards the cell that stands for it."""
SHARP = 0.06
"""Errors below this share of the side are no gross ones: means and correlations are theirs."""
SPEEDS = (0.0, 0.08, 0.2, 0.4, 0.7, 1.1, 3.0)
"""Edges of classes of workers by their joints' mean speed [m/s]."""
GAINS = (0.7, 1.5)
"""Errors are not made smaller or larger by more than this for the sake of the error in space."""
LAGS = (1, 2, 3, 5, 8, 12, 18, 25, 35, 45)
"""In frames, at which correlations in time are taken."""


def fit(samples: Samples) -> Calibration:
    """A calibration that draws errors like these."""
    s = _Cells(samples)
    offset, wander = _space(samples)
    left_over = s.mirrored - _projected(samples, offset)
    bias = _bias(s, left_over)
    left_over = left_over - _bias_at(bias, samples, s)
    size, spread = _sizes(s, left_over, _space_variance(samples, wander))
    unit = _unit(s, left_over, size)
    shares, slow_s, slow_m = _times(s, samples, unit, _space_variance(samples, wander), size)
    swap_share, swap_s = _swaps(samples)
    miss_share, miss_s = _misses(samples)
    common = _common(s, left_over, spread)
    return Calibration(
        offset, wander, bias, size, spread, _confidence_s(s), common, shares, slow_s, slow_m,
        _limbs(s, unit), _confidences(s), _follows(s, left_over, spread), swap_share, swap_s,
        miss_share, miss_s, sigma_table(samples),
    )  # fmt: skip


def scaled(calibration: Calibration, upright: float, folded: float) -> Calibration:
    """A calibration whose errors are larger by these factors; what they are on average stays."""
    factor = np.clip([upright, folded], *GAINS)[:, None, None]
    return replace(
        calibration, size=calibration.size * factor, wander_m=calibration.wander_m * factor
    )


class _Cells:
    """Samples sorted by kind of joint, left and right together."""

    def __init__(self, samples: Samples) -> None:
        self.mirrored = samples.error * np.stack([HAND, np.ones_like(HAND)], -1)
        self.found = np.isfinite(samples.error[..., 0]) & samples.counts[..., None, None]
        self.sight, self.confidence = samples.sight, samples.confidence
        fold = np.broadcast_to(samples.fold[..., None, None], self.found.shape)
        self.posture = np.where(fold < 0.3, 0, np.where(fold >= 0.5, 1, -1))
        view = samples.view[..., None] * HAND
        self.view_bin = np.round(view * N_VIEWS / (2 * np.pi)).astype(int) % N_VIEWS

    def pick(self, posture: int | None, sight: int, kind: int) -> Bools:
        """Which samples are of a cell."""
        found = self.found & (self.sight == sight) & (kind == KIND)
        return found if posture is None else found & (self.posture == posture)


def _space(samples: Samples) -> tuple[Floats, Floats]:
    """Offsets in space, and how far they vary."""
    offset, wander = np.zeros((N_P, N_K, 3)), np.full((N_P, N_K, 3), 0.003)
    ok = np.isfinite(samples.offset_m[..., 0]) & samples.counts[..., None]
    fold = np.broadcast_to(samples.fold[..., None], ok.shape)
    for kind in range(N_K):
        for posture, chosen in enumerate((fold < 0.3, fold >= 0.5)):
            mine = ok & chosen & (kind == KIND)
            values, n = samples.offset_m[mine], int(mine.sum())
            if n < 30:
                offset[posture, kind], wander[posture, kind] = offset[0, kind], wander[0, kind]
                continue
            middle = np.median(values, 0)
            variance = _robust_std(values - middle) ** 2 - np.median(samples.noise[mine], 0)
            trust = n / (n + FEW) if posture else 1.0
            offset[posture, kind] = offset[0, kind] + trust * (middle - offset[0, kind])
            wander[posture, kind] = np.sqrt(np.maximum(variance, 0.002**2))
    return offset, wander


def _robust_std(values: Floats) -> Floats:
    """Standard deviation along the first axis from the middle 80 %."""
    low, high = np.percentile(values, [10, 90], axis=0)
    return (high - low) / 2.563


def _projected(samples: Samples, offset: Floats) -> Floats:
    """(L, T, C, J, 2) what offsets in space (P, K, 3) look like."""
    upright, folded = offset[0][KIND], offset[1][KIND]
    at = upright + samples.fold[..., None, None] * (folded - upright)
    shown = np.einsum("ltcjka,ltja->ltcjk", samples.shown, at)
    return shown * np.stack([HAND, np.ones_like(HAND)], -1)


def _space_variance(samples: Samples, wander: Floats) -> Floats:
    """(L, T, C, J) mean variance of a coordinate by what varies in space."""
    upright, folded = wander[0][KIND], wander[1][KIND]
    at = (upright + samples.fold[..., None, None] * (folded - upright)) ** 2
    return 0.5 * np.einsum("ltcjka,ltja->ltcj", samples.shown**2, at)


def _bias(s: _Cells, left_over: Floats) -> Floats:
    """(A, K, 2) mean errors by view; of few samples, less."""
    bias = np.zeros((N_VIEWS, N_K, 2))
    small = np.linalg.norm(left_over, axis=-1) < SHARP
    for kind in range(N_K):
        mine = s.pick(0, SEEN, kind) & small
        for view in range(N_VIEWS):
            values = left_over[mine & (s.view_bin == view)]
            if len(values):
                bias[view, kind] = np.median(values, 0) * len(values) / (len(values) + FEW)
    bias[:, 0, 0] -= bias[(-np.arange(N_VIEWS)) % N_VIEWS, 0, 0]  # the nose is its own mirror image
    bias[:, 0, 1] += bias[(-np.arange(N_VIEWS)) % N_VIEWS, 0, 1]
    bias[:, 0] *= 0.5
    return bias


def _bias_at(bias: Floats, samples: Samples, s: _Cells) -> Floats:
    """(L, T, C, J, 2) the bias of every sample, between views."""
    place = (samples.view[..., None] * HAND) * N_VIEWS / (2 * np.pi)
    low = np.floor(place).astype(int)
    part = (place - low)[..., None]
    near, far = bias[low % N_VIEWS, KIND], bias[(low + 1) % N_VIEWS, KIND]
    return near + part * (far - near)


_SPREADS = np.linspace(0.0, 2.0, 41)


def _ratios() -> tuple[Floats, Floats]:
    """Of log-normal times Rayleigh, by its spread: 95 % over median, and the median."""
    rng = np.random.default_rng(0)
    z, rayleigh = rng.standard_normal(40_000), np.sqrt(-2 * np.log(rng.random(40_000)))
    values = np.exp(_SPREADS[:, None] * z) * rayleigh
    middle, high = np.percentile(values, [50, 95], axis=1)
    return high / middle, middle


def _sizes(s: _Cells, left_over: Floats, in_space: Floats) -> tuple[Floats, Floats]:
    """(P, S, K) each: geometric mean and spread of a camera's own errors, from the median and the
    95th percentile."""
    ratio, middle = _ratios()
    size, spread = np.zeros((N_P, N_S, N_K)), np.zeros((N_P, N_S, N_K))
    length = np.linalg.norm(left_over, axis=-1)
    for posture in range(N_P):
        for sight in (SEEN, HIDDEN, OUTSIDE):
            for kind in range(N_K):
                mine = s.pick(posture, sight, kind)
                n = int(mine.sum())
                stands_for = (0, max(sight - (posture == 0), 0))
                values = [size[*stands_for, kind] or 0.01, spread[*stands_for, kind]]
                if n >= 30:
                    half, most = np.percentile(length[mine], [50, 95])
                    wide = float(np.interp(most / half, ratio, _SPREADS))
                    own = half / np.interp(wide, _SPREADS, middle)
                    own = math.sqrt(max(own**2 - np.median(in_space[mine]), (0.4 * own) ** 2))
                    trust = n / (n + FEW)
                    values[0] = math.exp(_mix(math.log(values[0]), math.log(own), trust))
                    values[1] = _mix(values[1], wide, trust)
                size[posture, sight, kind], spread[posture, sight, kind] = values
    return size, spread


def _mix(a: float, b: float, part: float) -> float:
    return a + part * (b - a)


def _unit(s: _Cells, left_over: Floats, size: Floats) -> Floats:
    """Errors over their cell's size, gross ones cut; NaN where there is none."""
    posture, sight = np.maximum(s.posture, 0), np.minimum(s.sight, N_S - 1)
    scale = size[posture, sight, np.broadcast_to(KIND, sight.shape)]
    return np.where(s.found[..., None], np.clip(left_over / scale[..., None], -4, 4), np.nan)


def _add_lagged(sums: list[Floats], values: Floats) -> None:
    """Add products of values (L, T, ...) with themselves later, and their squares, at `LAGS`."""
    for i, lag in enumerate(LAGS):
        now, then = values[:, lag:], values[:, :-lag]
        both = np.isfinite(now) & np.isfinite(then)
        sums[0][i] += (now[both] * then[both]).sum()
        sums[1][i] += 0.5 * ((now[both] ** 2).sum() + (then[both] ** 2).sum())


def _decay_s(correlation: Floats) -> float:
    """Time constant of an exponential through correlations at `LAGS` [s]."""
    times, best = np.array(LAGS) * DT_S, (np.inf, 1.0)
    for tau in np.geomspace(0.1, 8.0, 60):
        shape = np.exp(-times / tau)
        share = np.clip((shape @ correlation) / (shape @ shape), 0, 1)
        best = min(best, (float(((share * shape - correlation) ** 2).sum()), float(tau)))
    return best[1]


def _times(
    s: _Cells, samples: Samples, unit: Floats, in_space: Floats, size: Floats
) -> tuple[Floats, Floats, Floats]:
    """(K, 3) shares of what stays, lasts and is new; how long [s] and how far [m] it lasts."""
    speed = np.broadcast_to(samples.speed_m_s[:, :, None, None], s.found.shape)
    curves = np.zeros((N_K, len(SPEEDS) - 1, len(LAGS), 2))
    for kind in range(N_K):
        mine = s.pick(None, SEEN, kind) | s.pick(None, HIDDEN, kind)
        for k in range(len(SPEEDS) - 1):
            moves = mine & (speed >= SPEEDS[k]) & (speed < SPEEDS[k + 1])
            sums = [curves[kind, k, :, 0], curves[kind, k, :, 1]]
            _add_lagged(sums, np.where(moves[..., None], unit, np.nan))
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
    """Non-negative a and b, together at most 1, of products over squares = a + b shape, and the
    squared miss; each lag counts by its squares."""
    weight = curve[..., 1] / max(float(curve[..., 1].sum()), 1e-9)
    found = curve[..., 0] / np.maximum(curve[..., 1], 1e-9)
    best = (np.inf, (0.0, 0.0))
    norm = max(float((weight * shape**2).sum()), 1e-9)
    for a in np.linspace(0, 1, 26):
        b = float(np.clip((weight * (found - a) * shape).sum() / norm, 0, 1 - a))
        best = min(best, (float((weight * (a + b * shape - found) ** 2).sum()), (float(a), b)))
    return best[1], best[0]


def _limbs(s: _Cells, unit: Floats) -> Floats:
    """(K,) correlation of a joint's error with that of the next one towards the trunk."""
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


def _log_length(s: _Cells, left_over: Floats) -> Floats:
    """Logarithm of every error's length less its cell's median; NaN where there is none."""
    length = np.where(s.found, np.linalg.norm(left_over, axis=-1), np.nan)
    logs = np.log(np.maximum(length, 1e-4))
    for posture in range(N_P):
        for sight in range(N_S):
            for kind in range(N_K):
                mine = s.pick(posture, sight, kind)
                if mine.any():
                    logs[mine] -= np.median(logs[mine])
    return np.where(s.posture >= 0, logs, np.nan)


def _common(s: _Cells, left_over: Floats, spread: Floats) -> Floats:
    """Share of the sizes' variance that the joints of a body have in common."""
    logs = _log_length(s, left_over)
    flat = logs.reshape(-1, logs.shape[-1])
    ok = np.isfinite(flat)
    filled = np.where(ok, flat, 0.0)
    products, squares = filled.T @ filled, (filled**2).T @ ok
    other = ~np.eye(len(products), dtype=bool) & (HAND[:, None] * HAND >= 0)
    correlation = (products / np.sqrt(np.maximum(squares * squares.T, 1e-12)))[other].mean()
    own = float((spread[0, 0] ** 2).mean())
    return np.array(float(np.clip(correlation * (own + LOG_RAYLEIGH_VAR) / max(own, 0.05), 0, 0.9)))


def _confidence_s(s: _Cells) -> Floats:
    """How long the confidence lasts [s]."""
    logit = np.where(s.found, _logit(s.confidence), np.nan)
    for kind in range(N_K):
        for sight in range(N_S):
            mine = s.pick(None, sight, kind)
            if mine.any():
                logit[mine] -= np.mean(logit[mine])
    sums = [np.zeros(len(LAGS)), np.zeros(len(LAGS))]
    _add_lagged(sums, logit)
    return np.array(_decay_s(sums[0] / np.maximum(sums[1], 1e-9)))


def _logit(p: Floats) -> Floats:
    p = np.clip(p, 1e-3, 1 - 1e-4)
    return np.log(p / (1 - p))


def _confidences(s: _Cells) -> Floats:
    """(P, S, K, Z) quantiles of the reported visibility."""
    levels = [50 * (1 + math.erf(knot / math.sqrt(2))) for knot in KNOTS]
    table = np.full((N_P, N_S, N_K, len(KNOTS)), 0.5)
    for posture in range(N_P):
        for sight in range(N_S):
            for kind in range(N_K):
                mine = s.pick(posture, sight, kind)
                n = int(mine.sum())
                stands_for = table[0, max(sight - (posture == 0), 0), kind]
                if n < 30:
                    table[posture, sight, kind] = stands_for
                    continue
                table[posture, sight, kind] = np.percentile(s.confidence[mine], levels)
    return np.clip(table, 1e-3, 1 - 1e-4)


def _follows(s: _Cells, left_over: Floats, spread: Floats) -> Floats:
    """(S, K) correlation of visibility with smallness of the error, apart from its direction's."""
    follows = np.zeros((N_S, N_K))
    length = np.linalg.norm(left_over, axis=-1)
    for sight in range(N_S):
        for kind in range(N_K):
            mine = s.pick(0, sight, kind)
            if mine.sum() < 100:
                continue
            a, b = _ranks(-length[mine]), _ranks(s.confidence[mine])
            own = max(float(spread[0, sight, kind]) ** 2, 0.05)
            follows[sight, kind] = np.corrcoef(a, b)[0, 1] * math.sqrt(1 + LOG_RAYLEIGH_VAR / own)
    return np.clip(follows, 0.0, 0.95)


def _ranks(values: Floats) -> Floats:
    return np.argsort(np.argsort(values)).astype(float)


def _swaps(samples: Samples) -> tuple[Floats, Floats]:
    """(A, 2) shares of time by view, mirror images together; (2,) lengths [s]."""
    view = np.round(np.abs(samples.view) * N_VIEWS / (2 * np.pi)).astype(int)
    looked = ~samples.missed & samples.counts[..., None]
    share, length = np.zeros((N_VIEWS, 2)), np.zeros(2)
    for what in range(2):
        now = samples.exchanged[..., what] & looked
        overall = now.sum() / max(looked.sum(), 1)
        for bin_ in range(N_VIEWS // 2 + 1):
            mine = looked & (view == bin_)
            value = (now[mine].sum() + FEW * overall) / (mine.sum() + FEW)
            share[[bin_, -bin_], what] = value
        length[what] = _mean_burst_s(now)
    return share, length


def _mean_burst_s(now: Bools) -> float:
    """Mean length of bursts in (L, T, C) [s]; those that a clip cuts off count as they are."""
    begun = now[:, 1:] & ~now[:, :-1]
    n = int(begun.sum() + now[:, 0].sum())
    return float(np.clip(now.sum() / max(n, 1) * DT_S, DT_S, 2.0)) if n else 0.2


def _misses(samples: Samples) -> tuple[Floats, Floats]:
    """(P, 16) shares of time by the number of joints seen, never more with more; mean length."""
    n_seen = (samples.sight == SEEN).sum(-1)
    fold = np.broadcast_to(samples.fold[..., None], n_seen.shape)
    looked = np.broadcast_to(samples.counts[..., None], n_seen.shape)
    share = np.zeros((N_P, N_SEEN))
    for posture, chosen in enumerate((fold < 0.3, fold >= 0.5)):
        for n in range(N_SEEN):
            mine = looked & chosen & (np.abs(n_seen - n) <= 1)
            guess = share[0, n] if posture else max(0.0, 1 - n / 6)
            share[posture, n] = (samples.missed[mine].sum() + 20 * guess) / (mine.sum() + 20)
        share[posture] = np.maximum.accumulate(share[posture, ::-1])[::-1]
    often = samples.missed & looked & (n_seen >= 9)
    return np.clip(share, 0, 1), np.array(_mean_burst_s(often))


def sigma_table(samples: Samples) -> Floats:
    """(K, V) what to tell of a standard deviation by the visibility, a share of the stature."""
    edges = np.r_[0.0, 0.5 * (VISIBILITY[1:] + VISIBILITY[:-1]), 1.01]
    length = np.linalg.norm(samples.error, axis=-1) / STATURE_OF_SIDE
    found = np.isfinite(length) & samples.counts[..., None, None] & (samples.sight < OUTSIDE)
    table = np.zeros((N_K, len(VISIBILITY)))
    for v in range(len(VISIBILITY))[::-1]:
        inside = found & (samples.confidence >= edges[v]) & (samples.confidence < edges[v + 1])
        overall = np.percentile(length[inside], 90) / 2.146 if inside.any() else 0.05
        for kind in range(N_K):
            mine = inside & (kind == KIND)
            own = np.percentile(length[mine], 90) / 2.146 if mine.sum() >= 30 else overall
            table[kind, v] = _mix(overall, own, mine.sum() / (mine.sum() + FEW))
            if v + 1 < len(VISIBILITY):
                table[kind, v] = max(table[kind, v], table[kind, v + 1])
    return TOLD * table
