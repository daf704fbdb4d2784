"""Counts have exact intervals, few seeds none, and p-values are adjusted for their number."""

import numpy as np
import pytest
from scipy import stats

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.evaluation import intervals
from hrc_env.evaluation.intervals import (
    MIN_RUNS,
    MIN_SEEDS,
    adjust_holm,
    adjust_metrics,
    compare_means,
    compare_paired,
    estimate_burst_rate,
    estimate_clustered_share,
    estimate_mean,
    estimate_rate_ratio,
    estimate_ratio,
    estimate_run_iqm,
    estimate_share_of,
    make_ratio,
)

FEW = range(1, MIN_SEEDS)


def test_the_interquartile_mean_of_runs_is_that_of_all_tasks_and_resamples_within_each():
    """As rliable computes it: runs of each task are resampled, and all scores are trimmed."""
    near, far = np.array([1.0, 2.0, 3.0, 4.0, 50.0]), np.array([10.0, 20.0, 30.0, 40.0, 50.0])
    one = estimate_run_iqm([near], "1")
    assert one.value == pytest.approx(3.0)
    assert (one.n, one.low < 3 < one.high) == (5, True)
    both = estimate_run_iqm([near, far], "1")
    assert both.value == pytest.approx(stats.trim_mean([*near, *far], 0.25))
    fixed = estimate_run_iqm([np.full(5, 1.0), np.full(5, 2.0), np.full(5, 3.0)], "1")
    assert fixed.low == fixed.value == fixed.high, "strata keep their sizes"


@pytest.mark.parametrize("n", range(1, MIN_RUNS))
def test_fewer_than_five_runs_have_no_interval(n):
    found = estimate_run_iqm([np.arange(1.0, n + 1)], "1")
    assert np.isfinite(found.value)
    assert np.isnan([found.low, found.high]).all()
    lost = estimate_run_iqm([[*np.arange(4.0), np.nan]], "1")
    assert (lost.n, lost.value) == (4, 1.5)
    assert np.isnan(lost.low)
    assert np.isnan(estimate_run_iqm([[]], "1").value)
    unequal = estimate_run_iqm([np.arange(9.0), np.arange(float(n))], "1")
    assert np.isnan(unequal.low), "of the task with the fewest"


@pytest.mark.parametrize("n", FEW)
def test_few_seeds_have_neither_an_interval_nor_a_p_value(n):
    values = np.arange(1.0, n + 1)
    for found in (estimate_mean(values), estimate_ratio(values, 2 * values + 1, "1")):
        assert np.isfinite(found.value)
        assert np.isnan([found.low, found.high]).all()
    compared = compare_means(values + 100, values)
    assert compared.difference.value == 100
    assert np.isnan([compared.difference.low, compared.difference.high, compared.p]).all()


def test_eight_seeds_have_both():
    compared = compare_means(np.arange(8.0) + 1, np.arange(8.0))
    assert compared.difference.low == compared.difference.high == 1
    assert compared.p == 2 / 2**8  # all 256 ways to swap eight pairs, two of them as large
    assert np.isfinite(estimate_mean(np.arange(8.0)).low)


def test_a_small_p_value_is_known_closely_enough_for_many_contrasts():
    both = [*np.ones(30), *np.zeros(30)]
    found = compare_paired("x", make_ratio(both, np.ones(60)), 30, "m")
    assert found["p.x"].value == pytest.approx(1 / 40_001)


def test_p_values_are_adjusted_step_by_step():
    """Holm's own procedure: the smallest times n, the next times n - 1, never decreasing."""
    found = adjust_holm([0.01, 0.04, 0.03, 0.005, np.nan])
    np.testing.assert_allclose(found, [0.03, 0.06, 0.06, 0.02, np.nan])
    assert adjust_holm([0.5, 0.9]).tolist() == [1.0, 1.0]
    assert adjust_holm([]).size == 0
    assert adjust_holm([0.02]).tolist() == [0.02]
    with pytest.raises(ConfigError, match="p_values must be numbers"):
        adjust_holm(["a"])


def test_among_many_contrasts_without_a_difference_hardly_any_is_marked():
    """Unadjusted, two of three families of twenty contrasts would have a mark."""
    p = np.random.default_rng(0).uniform(size=(2000, 20))
    marked = np.mean([(adjust_holm(family) < 0.05).any() for family in p])
    assert (p < 0.05).any(1).mean() > 0.6
    assert marked == pytest.approx(0.05, abs=0.015)


def test_every_p_value_of_a_study_is_adjusted_for_all_of_them():
    def p(value: float) -> Metric:
        return Metric(value, value, value, "p", 30)

    found = adjust_metrics({"p.a": p(0.01), "a": p(0.5), "p.b": p(0.03), "p.c": p(np.nan)})
    assert found.keys() == {"p_holm.a", "p_holm.b", "p_holm.c"}
    assert (found["p_holm.a"].value, found["p_holm.a"].n) == (0.02, 2)
    assert found["p_holm.b"].value == 0.03
    assert np.isnan(found["p_holm.c"].value)


def measure_coverage(n: int, trials: int, share: float, likeness: float) -> list[float]:
    """How often the intervals of dependent trials, a bootstrap and independent trials hold a share
    that varies from seed to seed, the more the smaller `likeness` is."""
    rng, held = np.random.default_rng(0), np.zeros(3)
    for _ in range(300):
        shares = rng.beta(share * likeness, (1 - share) * likeness, n)
        x, y = rng.binomial(trials, shares), np.full(n, trials)
        found = (
            estimate_clustered_share(x, y), estimate_ratio(x, y, "share"), estimate_share_of(x, y),
        )  # fmt: skip
        held += [each.low <= share <= each.high for each in found]
    return (held / 300).tolist()


def test_the_interval_of_dependent_trials_holds_the_truth_where_others_do_not():
    dependent, bootstrap, independent = measure_coverage(20, 50, 0.02, likeness=20.0)
    assert dependent > 0.92 > bootstrap > independent
    dependent, bootstrap, independent = measure_coverage(20, 50, 0.02, likeness=4.0)
    assert dependent > bootstrap + 0.05 > independent + 0.2  # most seeds have no event


def test_dependent_trials_count_as_one_and_independent_ones_as_all():
    n, rng = 40, np.random.default_rng(1)
    whole = np.array([10.0] * 8 + [0.0] * 32)  # of a seed, all trials have the event or none
    same = estimate_clustered_share(whole, np.full(n, 10.0))
    per_seed = estimate_share_of(whole > 0, np.ones(n))
    assert (same.low, same.high) == pytest.approx((per_seed.low, per_seed.high), abs=0.02)
    alone = estimate_clustered_share(rng.binomial(10, 0.2, n), np.full(n, 10.0))
    every = estimate_share_of([round(400 * alone.value)], [400])
    assert alone.high - alone.low == pytest.approx(every.high - every.low, rel=0.35)


@pytest.mark.parametrize("n", [3, 8, 30])
def test_a_share_of_no_or_of_all_trials_is_bounded_by_the_number_of_seeds(n):
    none, every = (estimate_clustered_share([k] * n, [50] * n) for k in (0, 50))
    bound = 0.025 ** (1 / n)
    assert (none.value, none.low, none.high) == (0, 0, pytest.approx(1 - bound))
    assert (every.value, every.low, every.high) == (1, pytest.approx(bound), 1)


def test_dependent_trials_are_scaled_and_checked():
    found = estimate_clustered_share([0.0] * 9, [250.0] * 9, "per 1000 steps", 1000.0)
    assert found.high == pytest.approx(1000 * (1 - 0.025 ** (1 / 9)))
    assert found.unit == "per 1000 steps"
    assert np.isnan(estimate_clustered_share([0.0], [0.0]).value)
    some = estimate_clustered_share([1.0, 0.0], [2.0, 2.0])
    assert (some.value, np.isnan(some.low)) == (0.25, True)  # too few seeds
    with pytest.raises(ConfigError, match="between 0 and the number of trials"):
        estimate_clustered_share([3.0], [2.0])


def test_bursts_have_a_wider_interval_and_regular_events_the_exact_one():
    hours = np.full(30, 0.5)
    bursts, even = np.array([60.0] * 5 + [0.0] * 25), np.full(30, 10.0)
    wide, narrow = (estimate_burst_rate(counts, hours, "1/h") for counts in (bursts, even))
    assert wide.value == narrow.value == 20.0
    exact = intervals.estimate_rate(even, hours, "1/h")
    assert (narrow.low, narrow.high) == (exact.low, exact.high)
    assert wide.low < exact.low < exact.high < wide.high
    none = estimate_burst_rate(np.zeros(30), hours, "1/h")
    assert (none.value, none.high) == (0.0, pytest.approx(3.6889 / 15, abs=1e-4))
    assert np.isnan(estimate_burst_rate([np.nan] * 3, hours[:3]).value)  # without a shield


def test_the_ratio_of_two_counts_is_exact():
    found = estimate_rate_ratio([3, 1], [8], 2.0, 4.0)
    share = stats.binomtest(4, 12).proportion_ci(0.95, method="exact")
    assert found.value == pytest.approx(1.0)
    assert found.low == pytest.approx(2 * share.low / (1 - share.low))
    assert found.high == pytest.approx(2 * share.high / (1 - share.high))
    nothing = estimate_rate_ratio([0], [5], 1.0, 1.0)
    assert nothing.value == 0.0 < nothing.high
    assert np.isnan(estimate_rate_ratio([0], [0], 1.0, 1.0).high)
