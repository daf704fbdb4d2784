"""Numbers with 95 % intervals: bootstraps over seeds, by SciPy.

Frames of one walk depend on each other; walks do not. So what is drawn anew is always the
seed with all that belongs to it. Rows that share their seeds are compared seed by seed.
"""

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy import stats

from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats

N_RESAMPLES = 4000


def mean_over(values: Sequence[float], unit: str) -> Metric:
    """The mean of one number a seed."""
    return _boot((np.asarray(values, float),), lambda x, axis: x.mean(axis), unit)


def iqm_over(values: Sequence[float], unit: str) -> Metric:
    """The interquartile mean: of the middle half of the seeds (Agarwal et al. 2021,
    arXiv:2108.13264)."""

    def iqm(x: Floats, axis: int) -> Any:
        return stats.trim_mean(x, 0.25, axis=axis)

    return _boot((np.asarray(values, float),), iqm, unit)


def ratio_over(above: Sequence[float], below: Sequence[float], unit: str) -> Metric:
    """Sum of one number a seed over the sum of another: rates, shares, ratios of paired rows."""

    def ratio(x: Floats, y: Floats, axis: int) -> Floats:
        return x.sum(axis) / y.sum(axis)

    return _boot((np.asarray(above, float), np.asarray(below, float)), ratio, unit)


def rmse_over(squared: Sequence[float], counts: Sequence[float], unit: str) -> Metric:
    """Root of the mean square, from each seed's sum of squares and number of frames."""

    def rmse(x: Floats, n: Floats, axis: int) -> Floats:
        return np.sqrt(x.sum(axis) / n.sum(axis))

    return _boot((np.asarray(squared, float), np.asarray(counts, float)), rmse, unit)


def rmse_ratio_over(
    squared: Sequence[float], other_squared: Sequence[float], unit: str = "ratio"
) -> Metric:
    """RMSE over another RMSE of the same frames."""

    def ratio(x: Floats, y: Floats, axis: int) -> Floats:
        return np.sqrt(x.sum(axis) / y.sum(axis))

    return _boot((np.asarray(squared, float), np.asarray(other_squared, float)), ratio, unit)


def quantile_over(values: Sequence[Sequence[float] | Floats], q: float, unit: str) -> Metric:
    """A quantile of all values together; seeds are drawn with all of theirs."""
    groups = [np.asarray(each, float) for each in values]
    groups = [each[np.isfinite(each)] for each in groups]
    together = np.concatenate(groups) if groups else np.zeros(0)
    if together.size == 0:
        return Metric(np.nan, np.nan, np.nan, unit, 0)

    def quantile(rows: Any) -> float:
        drawn = np.concatenate([groups[int(k)] for k in rows])
        return float(np.quantile(drawn, q)) if drawn.size else np.nan

    point = float(np.quantile(together, q))
    if len(groups) < 2:
        return Metric(point, point, point, unit, together.size)
    draws = np.random.default_rng(0).integers(len(groups), size=(400, len(groups)))
    low, high = np.nanquantile([quantile(rows) for rows in draws], [0.025, 0.975])
    return Metric(point, float(low), float(high), unit, together.size)


def apart(one: Metric, other: Metric) -> bool:
    """Whether two intervals do not touch."""
    return one.high < other.low or other.high < one.low


def _boot(samples: tuple[Floats, ...], statistic: Callable[..., Any], unit: str) -> Metric:
    """A statistic of paired samples (n,) with its percentile interval; none where all are equal.

    Draws without a value (a ratio to nothing) do not count.
    """
    usable = np.all(np.isfinite(samples), axis=0)
    samples = tuple(each[usable] for each in samples)
    n = len(samples[0])
    if n == 0:
        return Metric(np.nan, np.nan, np.nan, unit, 0)
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", stats.DegenerateDataWarning)  # draws that are all alike
        point = float(statistic(*samples, axis=0))
        if n < 2 or all(np.ptp(each) == 0 for each in samples):
            return Metric(point, point, point, unit, n)
        found = stats.bootstrap(
            samples, statistic, n_resamples=N_RESAMPLES, paired=True, method="percentile",
            vectorized=True, rng=np.random.default_rng(0), batch=200,
        )  # fmt: skip
    drawn = found.bootstrap_distribution[np.isfinite(found.bootstrap_distribution)]
    low, high = np.quantile(drawn, [0.025, 0.975]) if drawn.size else (point, point)
    return Metric(point, float(low), float(high), unit, n)
