"""Numbers with 95 % intervals: one bootstrap over seeds, of which frames are no independent part.

Rows that share their seeds are compared seed by seed (`paired`). Events that are rare and shares of
trials have exact intervals (`rate_of`, `share_of`): draws of zeros are zeros, and would say that
an event that did not happen cannot happen.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy import stats

from hrc_env.core.brought import described
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.evaluation.counts import Bins

Metrics = dict[str, Metric]
Numbers = Sequence[float] | Floats
Statistic = Callable[[Ints], Floats]
"""From how often each seed is drawn (R, n) to a number for each draw (R,)."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """How much one row has more than another."""

    difference: Metric
    """With its 95 % interval."""
    p: float
    """Two-sided probability of a difference as large as that if there were none; NaN: not known."""


def compare_means(ours: Numbers, theirs: Numbers, unit: str = "1") -> Comparison:
    """Return the difference of two means over the same seeds, pair by pair.

    Its interval is a bootstrap over pairs, p is by exchanging the two of a pair at random (Fisher
    1935): below .05 with 6 pairs or more. Pairs of which a number is not finite do not count.

    Args:
        ours: (n,) a number with each seed.
        theirs: (n,) those of what it is compared with, with the same seeds in the same order.
        unit: of both.

    Raises:
        ConfigError: not two columns of one length.
    """
    x, y = _column("ours", ours), _column("theirs", theirs)
    if len(x) != len(y):
        raise ConfigError(
            f"ours and theirs must be of the same seeds, got {len(x)} and {len(y)} numbers."
        )
    x, y = _usable(x, y)
    both = [*x, *y]
    found = paired("it", ratio_of(both, np.ones(len(both))), len(x), unit)
    return Comparison(found["difference.it"], found["p.it"].value)


def compare_rates(
    ours: Numbers,
    theirs: Numbers,
    our_exposure: Numbers | float,
    their_exposure: Numbers | float,
    unit: str = "1",
) -> Comparison:
    """Return the difference of how often something rare happened, from exact intervals.

    Its interval follows from those of both rates (`rate_of`; Zou and Donner 2008,
    doi:10.1002/sim.3095), also where nothing happened at all; p is exact, of how the events are
    shared out (Przyborowski and Wilenski 1940, doi:10.1093/biomet/31.3-4.313).

    Args:
        ours: (n,) how often it happened with each seed.
        theirs: (m,) the same of what it is compared with.
        our_exposure: in how much it was counted, with each seed or with all together.
        their_exposure: the same of what it is compared with.
        unit: of a count over an exposure.

    Raises:
        ConfigError: counts that are no whole numbers, or an exposure below 0.
    """
    difference = excess_of(rate_of(ours, our_exposure, unit), rate_of(theirs, their_exposure, unit))
    x, y = int(np.sum(ours)), int(np.sum(theirs))
    over, under = float(np.sum(our_exposure)), float(np.sum(their_exposure))
    if not over or not under:
        return Comparison(difference, np.nan)
    p = stats.binomtest(x, x + y, over / (over + under)).pvalue if x + y else 1.0
    return Comparison(difference, float(p))


def bootstrap(statistic: Statistic, n: int, unit: str, n_draws: int = 4000) -> Metric:
    """A statistic of n seeds with its percentile interval; draws without a value do not count."""
    if n == 0:
        return Metric(np.nan, np.nan, np.nan, unit, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        point = float(statistic(np.ones((1, n), np.int64))[0])
        drawn = statistic(draws(n, n_draws)) if n > 1 else np.array([point])
    drawn = drawn[~np.isnan(drawn)]
    if np.isnan(point) or not np.isfinite(drawn).all() or not drawn.size:
        return Metric(point, point, point, unit, n)
    low, high = np.quantile(drawn, [0.025, 0.975])
    return Metric(point, float(low), float(high), unit, n)


def paired(name: str, statistic: Statistic, n: int, unit: str, n_draws: int = 4000) -> Metrics:
    """Return the difference of a statistic between two rows with the same seeds.

    Of numbers `ours` and `theirs` (n,) the difference of the means, as `compare_means` gives it:

        both = np.array([*ours, *theirs])
        paired("mean", lambda weights: weights @ both / weights.sum(-1), len(ours), "m")

    Args:
        name: of the statistic.
        statistic: of one row, not the difference. It is given weights (R, 2n), how often each seed
            counts, of ours and then of theirs; for the statistic of ours those of theirs are 0.
        n: number of seeds of a row.
        unit: of the statistic.
        n_draws: how often seeds are drawn.

    Returns:
        "difference.NAME" with its 95 % interval over draws of whole pairs; and "p.NAME", two-sided,
        by exchanging the rows in each pair at random (Fisher 1935), below .05 with 6 seeds or more.
    """

    def off(ours: Ints, theirs: Ints) -> Floats:
        return statistic(np.hstack([ours, theirs])) - statistic(np.hstack([theirs, ours]))

    found = bootstrap(lambda w: off(w, 0 * w), n, unit, n_draws)
    flips = np.random.default_rng(0).integers(0, 2, (n_draws, n))
    with np.errstate(divide="ignore", invalid="ignore"):
        is_less = np.abs(off(flips, 1 - flips)) < abs(found.value) * (1 - 1e-9)
    p = (1 + int((~is_less).sum())) / (1 + n_draws) + 0 * found.value  # not known if that is not
    return {f"difference.{name}": found, f"p.{name}": Metric(p, p, p, "p", n)}


def ratio_of(above: Numbers, below: Numbers) -> Statistic:
    """Sum of one number a seed over the sum of another."""
    x, y = np.asarray(above, float), np.asarray(below, float)
    return lambda weights: (weights @ x) / (weights @ y)


def rmse_of(squared: Numbers, counts: Numbers) -> Statistic:
    """Root of the mean of squares, from their sum and number a seed."""
    return lambda weights: np.sqrt(ratio_of(squared, counts)(weights))


def quantile_of(values: Sequence[Numbers], q: float) -> Statistic:
    """A quantile of all values of all seeds together."""
    owner = np.repeat(np.arange(len(values)), [len(each) for each in values])
    together = np.concatenate([*values, []])

    def quantile(weights: Ints) -> Floats:
        drawn = (np.repeat(together, each[owner]) for each in weights)
        return np.array([np.quantile(each, q) if each.size else np.nan for each in drawn])

    return quantile


def counted_quantile_of(bins: Bins, counts: Any, q: float) -> Statistic:
    """A quantile of counts (n, bins), a row a seed; what is beyond the last limit is that limit."""
    rows, most = np.asarray(counts, float), bins.edges[-1]
    return lambda weights: np.minimum(bins.quantile(weights @ rows, q), most)


def ratio_over(above: Numbers, below: Numbers, unit: str) -> Metric:
    """Sum of one number a seed over the sum of another: rates, shares, ratios of paired rows."""
    x, y = _usable(above, below)
    return bootstrap(ratio_of(x, y), len(x), unit)


def rate_of(counts: Numbers, exposure: Numbers | float, unit: str = "1") -> Metric:
    """Return how often something rare happened, with its exact 95 % interval.

    That of a Poisson count says how often an event that did not happen still may (Garwood 1936,
    doi:10.2307/2333958).

    Args:
        counts: (n,) how often it happened with each seed.
        exposure: in how much it was counted, with each seed (n,) or with all together.
        unit: of a count over an exposure.

    Raises:
        ConfigError: counts that are no whole numbers, or an exposure below 0.
    """
    events = _column("counts", counts)
    if not (np.isfinite(events).all() and (events >= 0).all() and (events % 1 == 0).all()):
        raise ConfigError(
            "counts must be whole numbers from 0 on, one with each seed: of other numbers take "
            f"mean_over; got {described(counts)}."
        )
    if np.ndim(exposure) and len(_column("exposure", exposure)) != len(events):
        raise ConfigError(
            f"counts and exposure must be of the same seeds, got {len(events)} and "
            f"{np.size(exposure)} numbers; one number is the exposure of all together."
        )
    if not np.all(np.asarray(exposure, float) >= 0):
        raise ConfigError(f"exposure must not be negative, got {described(exposure)}.")
    total, over = float(np.sum(counts)), float(np.sum(exposure))
    if not over:
        return Metric(np.nan, np.nan, np.nan, unit, len(counts))
    low = stats.gamma.ppf(0.025, total) if total else 0.0
    value, low, high = (
        float(each) / over for each in (total, low, stats.gamma.ppf(0.975, total + 1))
    )
    return Metric(value, low, high, unit, len(counts))


def share_of(seen: Sequence[bool] | Bools) -> Metric:
    """Return the share of trials in which something was seen, with its exact 95 % interval.

    The interval is binomial (Clopper and Pearson 1934, doi:10.1093/biomet/26.4.404); NaN of no
    trials. `ConfigError` for anything but a column of truth values.
    """
    column = _column("seen", seen)
    if not np.isin(column, (0.0, 1.0)).all():
        raise ConfigError(f"seen must be true or false of each trial, got {described(seen)}.")
    n, n_seen = len(column), int(column.sum())
    if n == 0:
        return Metric(np.nan, np.nan, np.nan, "share", 0)
    found = stats.binomtest(n_seen, n).proportion_ci(0.95, method="exact")
    return Metric(n_seen / n, float(found.low), float(found.high), "share", n)


def goals_over(goals: Numbers, minutes: Numbers) -> Metric:
    """Goals a minute: they come so regularly that a bootstrap is narrower than the interval of a
    Poisson count, which stands where no goal was reached."""
    return (ratio_over if np.any(goals) else rate_of)(goals, minutes, "1/min")


def success_over(achieved: Numbers, tries: Numbers) -> Metric:
    """The share of tries that succeeded; where all or none did, its interval is the exact one of
    as many trials as there are seeds, as tries with one seed are alike."""
    found = ratio_over(achieved, tries, "1")
    if found.value not in (0.0, 1.0):
        return found
    exact = share_of([bool(found.value)] * found.n)
    return replace(found, low=exact.low, high=exact.high)


def excess_of(ours: Metric, theirs: Metric) -> Metric:
    """One rate less another, with the interval that follows from both of theirs (Zou and Donner
    2008, doi:10.1002/sim.3095): also where both are zero it has a width."""
    less = ours.value - theirs.value
    low = less - np.hypot(ours.value - ours.low, theirs.high - theirs.value)
    high = less + np.hypot(ours.high - ours.value, theirs.value - theirs.low)
    return Metric(less, float(low), float(high), ours.unit, ours.n)


def mean_over(values: Numbers, unit: str = "1") -> Metric:
    """Return the mean of one number a seed with its 95 % bootstrap interval.

    Seeds without a finite number do not count: `Metric.n` says how many did. `ConfigError` for
    anything but a column of numbers.
    """
    values = _column("values", values)
    return ratio_over(values, np.ones(len(values)), unit)


def rmse_over(squared: Numbers, counts: Numbers, unit: str) -> Metric:
    """Root of the mean of squares, from their sum and number a seed; or the ratio of two RMSEs."""
    x, y = _usable(squared, counts)
    return bootstrap(rmse_of(x, y), len(x), unit)


def iqm_over(values: Numbers, unit: str) -> Metric:
    """The mean of the middle half of the seeds (Agarwal et al. 2021, arXiv:2108.13264)."""
    (x,) = _usable(values)

    def iqm(weights: Ints) -> Floats:
        drawn = np.repeat(np.tile(x, len(weights)), weights.ravel()).reshape(weights.shape)
        return stats.trim_mean(drawn, 0.25, axis=1)

    return bootstrap(iqm, len(x), unit)


def quantile_over(values: Sequence[Numbers], q: float, unit: str) -> Metric:
    """A quantile of all values of all seeds together; its n is their number."""
    groups = [_usable(each)[0] for each in values]
    found = bootstrap(quantile_of(groups, q), len(groups), unit, 400)
    return replace(found, n=sum(each.size for each in groups))


def counted_quantile_over(bins: Bins, counts: Any, q: float, unit: str) -> Metric:
    """A quantile of counts (n, bins), a row a seed."""
    return bootstrap(counted_quantile_of(bins, counts, q), len(counts), unit, 1000)


def crossing(x: Floats, y: Floats, level: float) -> float:
    """Where falling values y (n,) at x (n,) first come down to a level: linearly between the two
    nearest, the last x if they never do."""
    reached = np.flatnonzero(y <= level)
    if not reached.size or reached[0] == 0:
        return x[0] if reached.size else x[-1]
    nearest = slice(reached[0] - 1, reached[0] + 1)
    return float(np.interp(-level, -y[nearest], x[nearest]))


def _column(what: str, values: Any) -> Floats:
    """Return (n,) numbers, or raise `ConfigError`."""
    try:
        column = np.asarray(values, float)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{what} must be numbers, got {described(values)}: {error}.") from error
    if column.ndim != 1:
        raise ConfigError(
            f"{what} must have shape (n,), a number with each seed, got {column.shape}."
        )
    return column


def _usable(*samples: Numbers) -> list[Floats]:
    """(n,) each: the seeds of which every number is finite."""
    arrays = [np.asarray(each, float) for each in samples]
    finite = np.all(np.isfinite(arrays), axis=0)
    return [each[finite] for each in arrays]


@lru_cache(maxsize=8)
def draws(n: int, n_draws: int, stream: int = 0) -> Ints:
    """(R, n) how often each seed is drawn, always the same of a stream."""
    return np.random.default_rng(stream).multinomial(n, np.full(n, 1 / n), n_draws)
