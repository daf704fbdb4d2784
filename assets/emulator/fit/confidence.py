"""Confidence of the network, and the standard deviation that it stands for in the tracker."""

import math

import numpy as np

from assets.emulator.fit.body import LOG_RAYLEIGH_VAR
from assets.emulator.fit.cells import FEW, N_K, N_P, N_S, Cells, mix
from assets.emulator.samples import Samples
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import KIND, KNOTS, VISIBILITY
from hrc_env.perception.detector import STATURE_OF_SIDE
from hrc_env.perception.sightlines import OUTSIDE

TOLD = 1.2
"""Reported standard deviation over the measured one, because errors that last and that cameras
share do not average out. Chosen on half of the clips: coverage is .88 at 1, .90 at 1.2 and .91 at
1.4 (upright bodies), and the tracker's median error is 20.4, 21.1 and 22.0 mm."""


def _logit(p: Floats) -> Floats:
    p = np.clip(p, 1e-3, 1 - 1e-4)
    return np.log(p / (1 - p))


def confidences_of(s: Cells) -> Floats:
    """Return quantiles of the reported visibility, (P, S, K, Z)."""
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


def follows_of(s: Cells, left_over: Floats, spread: Floats, common: float) -> Floats:
    """Return the correlation of visibility with small errors, (S, K), apart from that of its
    direction."""
    follows = np.zeros((N_S, N_K))
    length = np.linalg.norm(left_over, axis=-1)
    for sight in range(N_S):
        for kind in range(N_K):
            mine = s.pick(0, sight, kind)
            if mine.sum() < 100:
                continue
            a, b = _ranks(-length[mine]), _ranks(s.confidence[mine])
            own = max(float(spread[0, sight, kind]) ** 2 / (1 - common), 0.05)
            follows[sight, kind] = np.corrcoef(a, b)[0, 1] * math.sqrt(1 + LOG_RAYLEIGH_VAR / own)
    return np.clip(follows, 0.0, 0.95)


def _ranks(values: Floats) -> Floats:
    return np.argsort(np.argsort(values)).astype(float)


def sigma_table(s: Cells, samples: Samples) -> Floats:
    """Return standard deviations by visibility as a share of the stature, (P, K, V).

    A cell of few samples takes those of all joints of such bodies, and these those of all bodies.
    """
    edges = np.r_[0.0, 0.5 * (VISIBILITY[1:] + VISIBILITY[:-1]), 1.01]
    length = np.linalg.norm(samples.error, axis=-1) / STATURE_OF_SIDE
    found = np.isfinite(length) & samples.counts[..., None, None] & (samples.sight < OUTSIDE)
    table = np.zeros((N_P, N_K, len(VISIBILITY)))
    for v in range(len(VISIBILITY))[::-1]:
        inside = found & (samples.confidence >= edges[v]) & (samples.confidence < edges[v + 1])
        anybody = _told(length[inside], 0.05)
        for posture, kind in np.ndindex(N_P, N_K):
            such = inside & (s.posture == posture)
            overall = _told(length[such], anybody)
            table[posture, kind, v] = _told(length[such & (kind == KIND)], overall)
    return TOLD * np.maximum.accumulate(table[..., ::-1], -1)[..., ::-1]


def _told(length: Floats, otherwise: float) -> float:
    """Return a standard deviation from the 90th percentile of lengths, near `otherwise` if they are
    few."""
    n = length.size
    own = float(np.percentile(length, 90)) / 2.146 if n >= 30 else otherwise
    return mix(otherwise, own, n / (n + FEW))
