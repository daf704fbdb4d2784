"""Metrics with 95 % intervals: exact for counts and fractions, bootstraps over seeds for the rest.

Seeds are resampled because the frames of one seed are dependent. Rows that share their seeds are
compared seed by seed (`compare_paired`). Rates of rare events and fractions of trials have exact
intervals (`estimate_rate`, `estimate_share`, `estimate_clustered_share`): if no event was observed,
a bootstrap interval has zero width, as if the event were impossible. Fewer than `MIN_SEEDS` seeds
have neither a bootstrap interval nor a p-value; both are then NaN.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
from scipy import stats

from hrc_env.core.brought import describe
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.evaluation.counts import Bins

Metrics = dict[str, Metric]
Numbers = Sequence[float] | Floats
MIN_SEEDS = 8
"""Smallest number of seeds with a bootstrap interval or a p-value. With fewer, percentile intervals
are far too narrow."""
MIN_RUNS = 5
"""Smallest number of training runs of a learner with an interval of their interquartile mean, as in
Agarwal et al. 2021 (arXiv:2108.13264). With fewer, there is none."""
N_FLIPS = (4_000, 40_000)
"""Numbers of random swaps in a permutation test. The second is used if the first p-value is below
`CLOSER_P`, as a p-value that is adjusted for many contrasts must be known more closely (sequential
Monte Carlo test; Besag and Clifford 1991, doi:10.1093/biomet/78.2.301)."""
CLOSER_P = 0.02
"""P-value below which more swaps are drawn."""
P, HOLM = "p.", "p_holm."
"""Prefixes of the names of p-values: of a single contrast, and adjusted for all of a study."""
ALPHA = 0.05
"""Adjusted p-value below which a difference is marked as significant."""
Statistic = Callable[[Ints], Floats]
"""Function that computes a statistic for R bootstrap resamples of n seeds. It maps weights (R, n),
the number of times that each seed occurs in each resample, to values (R,)."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """The difference between two rows of results."""

    difference: Metric
    """The difference, with its 95 % interval."""
    p: float
    """Two-sided p-value: the probability of a difference at least as large as the observed one if
    the rows do not differ; NaN if undefined."""


def compare_means(ours: Numbers, theirs: Numbers, unit: str = "1") -> Comparison:
    """Return the difference of two means over the same seeds, compared pair by pair.

    The interval is computed by bootstrap over pairs. The p-value is that of a permutation test that
    swaps the two numbers of a pair at random (Fisher 1935). Both are NaN for fewer than 8 pairs.
    Pairs with a number that is not finite are ignored.

    Args:
        ours: numbers (n,), one per seed.
        theirs: numbers (n,) to compare with, for the same seeds in the same order.
        unit: unit of the numbers.

    Raises:
        ConfigError: the numbers are not two one-dimensional arrays of the same length.
    """
    x, y = _check_column("ours", ours), _check_column("theirs", theirs)
    if len(x) != len(y):
        raise ConfigError(
            f"ours and theirs must have the same seeds, got {len(x)} and {len(y)} numbers."
        )
    x, y = _keep_finite(x, y)
    both = [*x, *y]
    metrics = compare_paired("it", make_ratio(both, np.ones(len(both))), len(x), unit)
    return Comparison(metrics["difference.it"], metrics["p.it"].value)


def compare_rates(
    ours: Numbers,
    theirs: Numbers,
    our_exposure: Numbers | float,
    their_exposure: Numbers | float,
    unit: str = "1",
) -> Comparison:
    """Return the difference of two rates of rare events, with its 95 % interval and p-value.

    The interval is computed from the exact intervals of both rates (`estimate_rate`; Zou and Donner
    2008, doi:10.1002/sim.3095), even if no event was observed. The p-value is exact, from the
    distribution of the events over the two rows (Przyborowski and Wilenski 1940,
    doi:10.1093/biomet/31.3-4.313).

    Args:
        ours: number of events (n,) per seed.
        theirs: number of events (m,) per seed to compare with.
        our_exposure: exposure of `ours`, per seed or in total.
        their_exposure: exposure of `theirs`, per seed or in total.
        unit: unit of the rates.

    Raises:
        ConfigError: counts are not whole numbers, or an exposure is negative.
    """
    difference = subtract_rates(
        estimate_rate(ours, our_exposure, unit), estimate_rate(theirs, their_exposure, unit)
    )
    x, y = int(np.sum(ours)), int(np.sum(theirs))
    over, under = float(np.sum(our_exposure)), float(np.sum(their_exposure))
    if not over or not under:
        return Comparison(difference, np.nan)
    p = stats.binomtest(x, x + y, over / (over + under)).pvalue if x + y else 1.0
    return Comparison(difference, float(p))


def bootstrap(statistic: Statistic, n: int, unit: str, n_draws: int = 4000) -> Metric:
    """Return a statistic of n seeds with its 95 % percentile interval.

    Resamples for which the statistic is undefined are ignored. The ends of the interval are NaN if
    there are fewer than `MIN_SEEDS` seeds, or if the statistic of a resample is infinite.
    """
    if n == 0:
        return Metric(np.nan, np.nan, np.nan, unit, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        point = float(statistic(np.ones((1, n), np.int64))[0])
        drawn = statistic(draw_seeds(n, n_draws)) if n >= MIN_SEEDS else np.empty(0)
    return make_percentile_metric(point, drawn, unit, n)


def make_percentile_metric(
    point: float, drawn: Floats, unit: str, n: int, fewest: int = MIN_SEEDS
) -> Metric:
    """Return a statistic with the central 95 % interval of its values in resamples.

    Args:
        point: value of the statistic.
        drawn: values (R,) in resamples of the seeds; NaN where the statistic is undefined.
        unit: unit of the statistic.
        n: number of seeds.
        fewest: number of seeds below which the ends of the interval are NaN.
    """
    drawn = drawn[~np.isnan(drawn)]
    if n < fewest or np.isnan(point) or not drawn.size or not np.isfinite(drawn).all():
        return Metric(point, np.nan, np.nan, unit, n)
    low, high = np.quantile(drawn, [0.025, 0.975])
    return Metric(point, float(low), float(high), unit, n)


def compare_paired(
    name: str, statistic: Statistic, n: int, unit: str, n_draws: int = 4000
) -> Metrics:
    """Return the difference of a statistic between two rows with the same seeds.

    For example, the difference of the means of `ours` and `theirs` (n,), one number per seed, as in
    `compare_means`:

        both = np.array([*ours, *theirs])
        compare_paired("mean", lambda weights: weights @ both / weights.sum(-1), len(ours), "m")

    Args:
        name: name of the statistic.
        statistic: statistic of one row, not of the difference. It takes weights (R, 2n), the number
            of times that each seed counts, first for our row and then for the other. For the
            statistic of our row, the weights of the other row are 0.
        n: number of seeds of a row.
        unit: unit of the statistic.
        n_draws: number of resamples.

    Returns:
        "difference.NAME", with its 95 % interval over resamples of whole pairs, and "p.NAME", the
            two-sided p-value of a permutation test that swaps the rows of each pair at random
            (Fisher 1935). With fewer than `MIN_SEEDS` seeds, the interval and the p-value are NaN.
    """

    def subtract(ours: Ints, theirs: Ints) -> Floats:
        return statistic(np.hstack([ours, theirs])) - statistic(np.hstack([theirs, ours]))

    difference = bootstrap(lambda weights: subtract(weights, 0 * weights), n, unit, n_draws)
    p = np.nan
    if n >= MIN_SEEDS and np.isfinite(difference.value):
        p = _test_by_permutation(subtract, n, abs(difference.value) * (1 - 1e-9))
    return {f"difference.{name}": difference, f"{P}{name}": Metric(p, p, p, "p", n)}


def _test_by_permutation(subtract: Callable[[Ints, Ints], Floats], n: int, least: float) -> float:
    """Return the p-value of a paired difference.

    It is exact if all swaps can be enumerated.

    Args:
        subtract: function that returns the differences (R,) for weights (R, n) of both rows.
        n: number of pairs.
        least: size from which a difference counts as at least as large as the observed one.
    """
    p, is_exact = 1.0, 2**n <= N_FLIPS[0]
    for n_flips in N_FLIPS[:1] if is_exact else N_FLIPS:
        n_as_large = n_drawn = 0
        for flips in _list_swaps(n) if is_exact else _draw_swaps(n, n_flips):
            with np.errstate(divide="ignore", invalid="ignore"):
                is_less = np.abs(subtract(flips, 1 - flips)) < least
            n_as_large, n_drawn = n_as_large + int((~is_less).sum()), n_drawn + len(flips)
        p = n_as_large / n_drawn if is_exact else (1 + n_as_large) / (1 + n_drawn)
        if p > CLOSER_P:
            break
    return p


def _list_swaps(n: int) -> Iterator[Ints]:
    """Yield all ways (2^n, n) to swap n pairs."""
    yield np.array(list(product((0, 1), repeat=n)))


def _draw_swaps(n: int, n_flips: int) -> Iterator[Ints]:
    """Yield random ways (R, n) to swap n pairs, in blocks; they are the same in every call."""
    rng = np.random.default_rng(0)
    for _ in range(n_flips // N_FLIPS[0]):
        yield rng.integers(0, 2, (N_FLIPS[0], n))


def adjust_holm(p_values: Numbers) -> Floats:
    """Return p-values (n,) adjusted for n contrasts (Holm 1979, Scand. J. Statist. 6:65-70).

    The probability that any contrast without a difference has an adjusted p-value below .05 is at
    most .05. NaN values stay NaN and do not count as contrasts.

    Args:
        p_values: p-values (n,) of all contrasts that are tested together.

    Raises:
        ConfigError: p-values are not a one-dimensional array of numbers.
    """
    p = _check_column("p_values", p_values)
    order = np.argsort(p)[: int(np.isfinite(p).sum())]
    adjusted = np.full(len(p), np.nan)
    factors = np.arange(len(order), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(p[order] * factors), 1.0)
    return adjusted


def adjust_metrics(metrics: Mapping[str, Metric]) -> Metrics:
    """Return "p_holm.NAME" for each "p.NAME" of a study, adjusted for all its contrasts.

    `Metric.n` is the number of contrasts.
    """
    names = [name for name in metrics if name.startswith(P)]
    adjusted = adjust_holm([metrics[name].value for name in names])
    values = [p if np.isfinite(p) else np.nan for p in adjusted.tolist()]
    n = int(np.isfinite(adjusted).sum())
    return {
        HOLM + name.removeprefix(P): Metric(p, p, p, "p", n)
        for name, p in zip(names, values, strict=True)
    }


def make_ratio(above: Numbers, below: Numbers) -> Statistic:
    """Return a statistic that divides the sum of one number per seed by the sum of another."""
    x, y = np.asarray(above, float), np.asarray(below, float)
    return lambda weights: (weights @ x) / (weights @ y)


def make_rmse(squared: Numbers, counts: Numbers) -> Statistic:
    """Return a statistic that computes a root mean square, from sums of squares and counts."""
    return lambda weights: np.sqrt(make_ratio(squared, counts)(weights))


def make_quantile(values: Sequence[Numbers], q: float) -> Statistic:
    """Return a statistic that computes a quantile of the values of all seeds together."""
    owner = np.repeat(np.arange(len(values)), [len(each) for each in values])
    together = np.concatenate([*values, []])

    def quantile(weights: Ints) -> Floats:
        drawn = (np.repeat(together, each[owner]) for each in weights)
        return np.array([np.quantile(each, q) if each.size else np.nan for each in drawn])

    return quantile


def make_binned_quantile(bins: Bins, counts: Any, q: float) -> Statistic:
    """Return a statistic that computes a quantile of histograms `counts` (n, bins), one per seed.

    A quantile beyond the last edge is replaced by that edge.
    """
    rows, most = np.asarray(counts, float), bins.edges[-1]
    return lambda weights: np.minimum(bins.quantile(weights @ rows, q), most)


def estimate_ratio(above: Numbers, below: Numbers, unit: str) -> Metric:
    """Return the sum of one number per seed, divided by the sum of another, with its interval.

    The result is a rate, a fraction or the ratio of two rows.
    """
    x, y = _keep_finite(above, below)
    return bootstrap(make_ratio(x, y), len(x), unit)


def estimate_rate(counts: Numbers, exposure: Numbers | float, unit: str = "1") -> Metric:
    """Return the rate of a rare event, with its exact 95 % interval.

    It is the interval of a Poisson count, which bounds the rate even if no event was observed
    (Garwood 1936, doi:10.2307/2333958).

    Args:
        counts: number of events (n,) per seed.
        exposure: the time, distance or number of trials observed, per seed (n,) or in total.
        unit: unit of the rate.

    Raises:
        ConfigError: counts are not whole numbers, or an exposure is negative.
    """
    events = _check_column("counts", counts)
    if not (np.isfinite(events).all() and (events >= 0).all() and (events % 1 == 0).all()):
        raise ConfigError(
            "counts must be non-negative integers, one per seed (use estimate_mean for other "
            f"numbers); got {describe(counts)}."
        )
    if np.ndim(exposure) and len(_check_column("exposure", exposure)) != len(events):
        raise ConfigError(
            f"counts and exposure must have the same seeds, got {len(events)} and "
            f"{np.size(exposure)} numbers; a single number applies to all seeds."
        )
    if not np.all(np.asarray(exposure, float) >= 0):
        raise ConfigError(f"exposure must not be negative, got {describe(exposure)}.")
    total, over = float(np.sum(counts)), float(np.sum(exposure))
    if not over:
        return Metric(np.nan, np.nan, np.nan, unit, len(counts))
    low = stats.gamma.ppf(0.025, total) if total else 0.0
    value, low, high = (
        float(each) / over for each in (total, low, stats.gamma.ppf(0.975, total + 1))
    )
    return Metric(value, low, high, unit, len(counts))


def estimate_share(outcomes: Sequence[bool] | Bools) -> Metric:
    """Return the fraction of trials with a true outcome, with its exact 95 % interval.

    The interval is binomial (Clopper and Pearson 1934, doi:10.1093/biomet/26.4.404). Without
    trials, the fraction is NaN.

    Args:
        outcomes: truth values (n,), one per trial.

    Raises:
        ConfigError: outcomes are not a one-dimensional array of truth values.
    """
    column = _check_column("outcomes", outcomes)
    if not np.isin(column, (0.0, 1.0)).all():
        raise ConfigError(f"outcomes must be true or false per trial, got {describe(outcomes)}.")
    return estimate_share_of(column, np.ones(len(column)))


def estimate_share_of(counts: Numbers, trials: Numbers) -> Metric:
    """Return the fraction of independent trials with an event, with its exact 95 % interval.

    It is the interval of `estimate_share`, for trials that were counted per seed.

    Args:
        counts: number of trials with the event (n,) per seed.
        trials: number of all trials (n,) per seed.

    Returns:
        The fraction; `Metric.n` is the number of trials. Without trials, the fraction is NaN.
    """
    n_true, n = round(float(np.sum(counts))), round(float(np.sum(trials)))
    if n == 0:
        return Metric(np.nan, np.nan, np.nan, "share", 0)
    interval = stats.binomtest(n_true, n).proportion_ci(0.95, method="exact")
    return Metric(n_true / n, float(interval.low), float(interval.high), "share", n)


def estimate_clustered_share(
    counts: Numbers, trials: Numbers, unit: str = "share", per: float = 1.0
) -> Metric:
    """Return the fraction of trials with an event if trials with the same seed are dependent.

    Its 95 % interval is the exact binomial one for the effective number of trials: that of
    independent trials whose fraction would vary as much as it does over seeds (Korn and Graubard
    1998, Survey Methodology 24:193-201). If no trial or every trial has the event, it is the number
    of seeds. Otherwise, the interval is NaN for fewer than `MIN_SEEDS` seeds. If most events occur
    in very few seeds, the interval is still too narrow, though less so than a bootstrap.

    Args:
        counts: number of trials with the event (n,) per seed, such as steps of an episode.
        trials: number of all trials (n,) per seed; seeds without trials are ignored.
        unit: unit of the fraction.
        per: number of trials to which the fraction refers.

    Raises:
        ConfigError: an event was counted in more than all trials, or in less than none.
    """
    x, y = _keep_finite(counts, trials)
    if not ((x >= 0).all() and (x <= y).all()):
        raise ConfigError(
            f"counts must be between 0 and the number of trials, got {describe(counts)} of "
            f"{describe(trials)}."
        )
    x, y = x[y > 0], y[y > 0]
    n, n_trials = len(x), float(y.sum())
    if not n:
        return Metric(np.nan, np.nan, np.nan, unit, 0)
    share = float(x.sum()) / n_trials
    if n < MIN_SEEDS and 0 < share < 1:
        return Metric(per * share, np.nan, np.nan, unit, n)
    n_effective = float(n) if share in (0.0, 1.0) else _count_effective_trials(x, y)
    n_true = share * n_effective
    low = stats.beta.ppf(0.025, n_true, n_effective - n_true + 1) if share > 0 else 0.0
    high = stats.beta.ppf(0.975, n_true + 1, n_effective - n_true) if share < 1 else 1.0
    return Metric(per * share, per * float(low), per * float(high), unit, n)


def _count_effective_trials(x: Floats, y: Floats) -> float:
    """Return the number of independent trials with the same variance as x (n,) of y (n,) trials."""
    n, n_trials = len(x), float(y.sum())
    share = float(x.sum()) / n_trials
    variance = n / (n - 1) * float(np.square(x - share * y).sum()) / n_trials**2
    if variance == 0:
        return n_trials
    fewer = stats.t.ppf(0.975, max(n_trials - 1, n - 1)) / stats.t.ppf(0.975, n - 1)
    return min(share * (1 - share) / variance * float(fewer) ** 2, n_trials)


def estimate_goal_rate(goals: Numbers, minutes: Numbers, unit: str = "1/min") -> Metric:
    """Return goals per minute with an interval.

    Goals are reached more regularly than the events of a Poisson process; the interval is therefore
    computed by bootstrap. If no goal was reached, or all seeds have the same rate, a bootstrap
    interval has zero width, and the interval is that of `estimate_rate`.
    """
    x, y = _keep_finite(goals, minutes)
    is_regular = len(x) >= MIN_SEEDS and np.allclose(x * y.sum(), y * x.sum())
    if is_regular or not x.any():
        return estimate_rate(x, y, unit)
    return bootstrap(make_ratio(x, y), len(x), unit)


def estimate_burst_rate(counts: Numbers, exposure: Numbers, unit: str = "1") -> Metric:
    """Return the rate of events that may come in bursts, such as interventions of a shield.

    The interval contains the exact one of a Poisson count and, from `MIN_SEEDS` seeds on, the
    bootstrap interval over seeds, which is wider if events come in bursts.

    Args:
        counts: number of events (n,) per seed; seeds with NaN are ignored, and without other seeds
            the rate is NaN.
        exposure: the time observed (n,) per seed.
        unit: unit of the rate.
    """
    x, y = _keep_finite(counts, exposure)
    exact, drawn = estimate_rate(x, y, unit), bootstrap(make_ratio(x, y), len(x), unit)
    if np.isnan(exact.value) or np.isnan(drawn.low):
        return exact
    return replace(exact, low=min(exact.low, drawn.low), high=max(exact.high, drawn.high))


def estimate_rate_ratio(
    ours: Numbers, theirs: Numbers, our_exposure: Numbers | float, their_exposure: Numbers | float
) -> Metric:
    """Return the ratio of two rates of rare events, with its exact 95 % interval.

    Given the number of all events, those of our row are binomial (Przyborowski and Wilenski 1940,
    doi:10.1093/biomet/31.3-4.313). The ratio is NaN if there is no event to compare with; the
    interval is NaN if there is no event at all.

    Args:
        ours: number of events (n,) per seed.
        theirs: number of events (m,) per seed to compare with.
        our_exposure: exposure of `ours`, per seed or in total.
        their_exposure: exposure of `theirs`, per seed or in total.
    """
    rates = estimate_rate(ours, our_exposure), estimate_rate(theirs, their_exposure)
    x, y = int(np.sum(ours)), int(np.sum(theirs))
    over, under = float(np.sum(our_exposure)), float(np.sum(their_exposure))
    if not (x + y and over and under):
        return Metric(np.nan, np.nan, np.nan, "share", rates[0].n)
    interval = stats.binomtest(x, x + y).proportion_ci(0.95, method="exact")
    low, high = (
        under / over * share / (1 - share) if share < 1 else np.inf
        for share in (float(interval.low), float(interval.high))
    )
    value = rates[0].value / rates[1].value if y else np.nan
    return Metric(value, low, high, "share", rates[0].n)


def subtract_rates(ours: Metric, theirs: Metric) -> Metric:
    """Return the difference of two rates, with an interval computed from their intervals.

    The interval (Zou and Donner 2008, doi:10.1002/sim.3095) has a width greater than zero even if
    both rates are 0.
    """
    difference = ours.value - theirs.value
    low = difference - np.hypot(ours.value - ours.low, theirs.high - theirs.value)
    high = difference + np.hypot(ours.high - ours.value, theirs.value - theirs.low)
    return Metric(difference, float(low), float(high), ours.unit, ours.n)


def estimate_mean(values: Numbers, unit: str = "1") -> Metric:
    """Return the mean of one number per seed with its 95 % bootstrap interval.

    Seeds without a finite number are ignored; `Metric.n` is the number of the others.

    Args:
        values: numbers (n,), one per seed.
        unit: unit of the numbers.

    Raises:
        ConfigError: values are not a one-dimensional array of numbers.
    """
    values = _check_column("values", values)
    return estimate_ratio(values, np.ones(len(values)), unit)


def estimate_rmse(squared: Numbers, counts: Numbers, unit: str) -> Metric:
    """Return a root mean square with its interval, from a sum of squares and a count per seed.

    With the sums of squares of two rows instead, it is the ratio of their root mean squares.
    """
    x, y = _keep_finite(squared, counts)
    return bootstrap(make_rmse(x, y), len(x), unit)


def estimate_iqm(values: Numbers, unit: str) -> Metric:
    """Return the interquartile mean over seeds (Agarwal et al. 2021, arXiv:2108.13264)."""
    (x,) = _keep_finite(values)

    def iqm(weights: Ints) -> Floats:
        drawn = np.repeat(np.tile(x, len(weights)), weights.ravel()).reshape(weights.shape)
        return stats.trim_mean(drawn, 0.25, axis=1)

    return bootstrap(iqm, len(x), unit)


def estimate_run_iqm(scores: Sequence[Numbers], unit: str, n_draws: int = 4000) -> Metric:
    """Return the interquartile mean of a learner's scores over training runs, with its interval.

    The scores of all tasks are trimmed together. The 95 % interval is a stratified bootstrap, which
    resamples runs within each task (Agarwal et al. 2021, arXiv:2108.13264). It describes the
    variation between trainings, which intervals over the episodes of one policy do not contain.

    Args:
        scores: scores (n,) of the training runs of each task, one number per run; a run without a
            finite score is ignored.
        unit: unit of the scores.
        n_draws: number of resamples.

    Returns:
        The interquartile mean; `Metric.n` is the smallest number of runs of a task. The interval is
            NaN if that is below `MIN_RUNS`.
    """
    tasks = [_keep_finite(_check_column("scores", each))[0] for each in scores]
    n = min((len(each) for each in tasks), default=0)
    if n == 0:
        return Metric(np.nan, np.nan, np.nan, unit, 0)
    point = float(stats.trim_mean(np.concatenate(tasks), 0.25))
    rng = np.random.default_rng(0)
    picked = [each[rng.integers(0, len(each), (n_draws, len(each)))] for each in tasks]
    drawn: Floats = stats.trim_mean(np.hstack(picked), 0.25, axis=1)
    return make_percentile_metric(point, drawn, unit, n, MIN_RUNS)


def estimate_quantile(values: Sequence[Numbers], q: float, unit: str) -> Metric:
    """Return a quantile of the values of all seeds together; `Metric.n` is the number of values."""
    groups = [_keep_finite(each)[0] for each in values]
    metric = bootstrap(make_quantile(groups, q), len(groups), unit, 400)
    return replace(metric, n=sum(group.size for group in groups))


def estimate_binned_quantile(bins: Bins, counts: Any, q: float, unit: str) -> Metric:
    """Return a quantile of histograms `counts` (n, bins), one per seed, with its interval."""
    return bootstrap(make_binned_quantile(bins, counts, q), len(counts), unit, 1000)


def find_crossing(x: Floats, y: Floats, level: float) -> float:
    """Return the x at which decreasing values y first reach a level.

    Args:
        x: increasing coordinates (n,).
        y: values (n,) at x, interpolated linearly between them.
        level: level to reach; if y never reaches it, the last x is returned.
    """
    reached = np.flatnonzero(y <= level)
    if not reached.size or reached[0] == 0:
        return x[0] if reached.size else x[-1]
    nearest = slice(reached[0] - 1, reached[0] + 1)
    return float(np.interp(-level, -y[nearest], x[nearest]))


def _check_column(name: str, values: Any) -> Floats:
    """Return values as an array (n,) of numbers; raise `ConfigError` if they are not numbers."""
    try:
        column = np.asarray(values, float)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{name} must be numbers, got {describe(values)}: {error}.") from error
    if column.ndim != 1:
        raise ConfigError(f"{name} must have shape (n,), one number per seed, got {column.shape}.")
    return column


def _keep_finite(*samples: Numbers) -> list[Floats]:
    """Return the samples without the seeds for which any sample is not finite."""
    arrays = [np.asarray(each, float) for each in samples]
    finite = np.all(np.isfinite(arrays), axis=0)
    return [each[finite] for each in arrays]


@lru_cache(maxsize=8)
def draw_seeds(n: int, n_draws: int, stream: int = 0) -> Ints:
    """Return bootstrap weights (R, n), the number of times that each seed occurs in each resample.

    They are the same in every call with the same `stream`.
    """
    return np.random.default_rng(stream).multinomial(n, np.full(n, 1 / n), n_draws)
