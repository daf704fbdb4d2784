"""Histograms with one row per episode, from which quantiles of long runs are computed."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints


@dataclass(frozen=True, slots=True)
class Bins:
    """Bins of a histogram; the first and the last bin are unbounded."""

    edges: Floats
    """Edges (n,) of n + 1 bins, in increasing order."""

    def count(self, values: Floats, mask: Bools | None = None) -> Ints:
        """Count the values that lie in each bin.

        Args:
            values: values (B, ...), which are counted per row.
            mask: mask of the values to count, of the same shape (default: all).

        Returns:
            Counts (B, n + 1).
        """
        batch, n_bins = len(values), len(self.edges) + 1
        index = np.searchsorted(self.edges, values.reshape(batch, -1), side="right")
        index += n_bins * np.arange(batch)[:, None]
        selected = index.ravel() if mask is None else index[mask.reshape(batch, -1)]
        return np.bincount(selected, minlength=batch * n_bins).reshape(batch, n_bins)

    def quantile(self, counts: Floats | Ints, q: float) -> Floats:
        """Return the q-quantile (...,) of counts (..., n + 1), interpolated linearly in its bin.

        It is NaN if nothing was counted, and infinite if it lies in the last bin.
        """
        totals = counts.sum(-1, keepdims=True)
        some = np.maximum(totals, 1)
        share = np.cumsum(counts, -1) / some
        bin_ = np.minimum((share < q).sum(-1), counts.shape[-1] - 1)
        above = np.take_along_axis(share, bin_[..., None], -1)[..., 0]
        share_in_bin = np.take_along_axis(counts, bin_[..., None], -1)[..., 0] / some[..., 0]
        low = np.concatenate([self.edges[:1], self.edges])[bin_]
        high = np.concatenate([self.edges, [np.inf]])[bin_]
        into = 1 - (above - q) / np.maximum(share_in_bin, 1e-12)
        with np.errstate(invalid="ignore"):
            inside = np.where(np.isinf(high), np.inf, low + into * (high - low))
        return np.where(totals[..., 0] > 0, inside, np.nan)


ERRORS_M = Bins(np.geomspace(1e-4, 10.0, 240))
"""Bins for position errors [m], in steps of five percent."""
GAPS_M = Bins(np.linspace(-1.0, 2.0, 301))
"""Bins for differences of distances [m]."""
SPEEDS_MPS = Bins(np.linspace(-3.0, 4.0, 281))
"""Bins for signed speeds [m/s]."""
