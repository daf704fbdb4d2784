"""Values counted in bins, an episode a row: what quantiles of long runs are made of."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints


@dataclass(frozen=True, slots=True)
class Bins:
    """Limits between bins; the first and the last bin are open."""

    edges: Floats
    """(n,) for n + 1 bins, growing."""

    def count(self, values: Floats, which: Bools | None = None) -> Ints:
        """(B, n + 1) how many of the values (B, ...), or of those marked, lie in each bin."""
        batch, n_bins = len(values), len(self.edges) + 1
        index = np.searchsorted(self.edges, values.reshape(batch, -1), side="right")
        index += n_bins * np.arange(batch)[:, None]
        chosen = index.ravel() if which is None else index[which.reshape(batch, -1)]
        return np.bincount(chosen, minlength=batch * n_bins).reshape(batch, n_bins)

    def quantile(self, counts: Floats | Ints, q: float) -> Floats:
        """(...,) of counts (..., n + 1), linear inside a bin: NaN of none, infinite in the last."""
        totals = counts.sum(-1, keepdims=True)
        some = np.maximum(totals, 1)
        share = np.cumsum(counts, -1) / some
        bin_ = np.minimum((share < q).sum(-1), counts.shape[-1] - 1)
        above = np.take_along_axis(share, bin_[..., None], -1)[..., 0]
        own = np.take_along_axis(counts, bin_[..., None], -1)[..., 0] / some[..., 0]
        low = np.concatenate([self.edges[:1], self.edges])[bin_]
        high = np.concatenate([self.edges, [np.inf]])[bin_]
        into = 1 - (above - q) / np.maximum(own, 1e-12)
        with np.errstate(invalid="ignore"):
            inside = np.where(np.isinf(high), np.inf, low + into * (high - low))
        return np.where(totals[..., 0] > 0, inside, np.nan)


ERRORS_M = Bins(np.geomspace(1e-4, 10.0, 240))
"""Position errors [m], five in a hundred apart."""
GAPS_M = Bins(np.linspace(-1.0, 2.0, 301))
"""Differences of gaps [m]."""
SPEEDS_MPS = Bins(np.linspace(-3.0, 4.0, 281))
"""Directed speeds [m/s]."""
