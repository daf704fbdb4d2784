"""Sums per sequence over one window's frames, people and joints: what all metrics are made of."""

from typing import Any

import numpy as np
from scipy import stats

from benchmarks.common import CHI2_95_3D
from hrc_env.core.skeleton import TORSO
from hrc_env.core.typing import Bools, Covariances3, Floats, Ints, Points3

N_LEVELS = 20
"""Bins of the probability that the reported Gaussian gives to a nearer joint."""
CHI2_LEVELS: Floats = stats.chi2(3).ppf(np.arange(1, N_LEVELS) / N_LEVELS)
"""(19,) limits of the 20 equally likely classes of a normalised squared error."""


def tally(truth: Points3, mean: Points3, cov: Covariances3 | None) -> dict[str, Any]:
    """Sums by name, each a list over sequences, of joints (T, S, W, J, 3) [m] and what is claimed
    of them [m^2], if anything is."""
    n_frames, n_sequences = truth.shape[:2]
    offset = mean - truth
    squared = (offset**2).sum(-1)
    out: dict[str, Floats] = {
        "n": np.full(n_sequences, float(squared[:, 0].size)),
        "n_frames": np.full(n_sequences, float(n_frames * truth.shape[2])),
        "squared": _total(squared),
        "wrong_way": _total(((_left(mean) * _left(truth)).sum(-1) < 0)[..., None]),
        "median": np.median(np.sqrt(squared), axis=(0, 2, 3)),
    }
    if cov is not None:
        nees = np.einsum("...i,...i->...", offset, np.linalg.solve(cov, offset[..., None])[..., 0])
        level = np.searchsorted(CHI2_LEVELS, nees)
        out["inside"] = _total(nees < CHI2_95_3D)
        out["nees"] = _total(nees)
        out["trace"] = _total(np.trace(cov, axis1=-2, axis2=-1))
        out["levels"] = np.stack([_total(level == k) for k in range(N_LEVELS)], -1)
    return {name: value.tolist() for name, value in out.items()}


def _total(values: Floats | Bools | Ints) -> Floats:
    """(S,) from (T, S, W, J)."""
    return values.sum(axis=(0, 2, 3), dtype=float)


def _left(joints: Points3) -> Floats:
    """(..., 2) from right to left across the torso, on the ground."""
    a, b, c, d = (joints[..., j, :2] for j in TORSO)
    return a - b + c - d
