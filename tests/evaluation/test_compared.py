"""Intervals and differences of plain arrays: exact for counts, bootstraps for means."""

import numpy as np
import pytest
from scipy import stats

from hrc_env import (
    ConfigError,
    compare_means,
    compare_rates,
    estimate_mean,
    estimate_rate,
    estimate_share,
)


def test_a_rate_has_the_exact_interval_of_a_poisson_count():
    found = estimate_rate([2, 0, 3], [1.0, 2.0, 2.0], "1/h")
    low, high = stats.chi2.ppf([0.025, 0.975], [10, 12]) / 2 / 5  # Garwood
    assert (found.value, found.low, found.high) == pytest.approx((1.0, low, high))


def test_a_share_has_the_exact_interval_of_trials():
    found = estimate_share(np.array([True, True, False]))
    expected = stats.beta.ppf([0.025, 0.975], [2, 3], [2, 1])  # Clopper and Pearson
    assert (found.low, found.high) == pytest.approx(tuple(expected))


def test_the_intervals_of_means_cover():
    rng = np.random.default_rng(0)
    drawn = [estimate_mean(rng.normal(size=40)) for _ in range(200)]
    assert 0.88 <= np.mean([each.low <= 0 <= each.high for each in drawn]) <= 0.98


def test_pairs_take_out_what_seeds_have_in_common():
    rng = np.random.default_rng(1)
    ours, noise = 10 * rng.normal(size=30), 0.1 * rng.normal(size=30)
    found = compare_means(ours + 1.0 + noise, ours, "m")
    assert 0.9 < found.difference.low < found.difference.high < 1.1
    assert found.p < 0.001
    assert found.difference.unit == "m"


def test_without_a_difference_p_is_evenly_spread():
    rng = np.random.default_rng(2)
    found = [compare_means(rng.normal(size=12), rng.normal(size=12)).p for _ in range(200)]
    assert 0.01 <= np.mean(np.array(found) < 0.05) <= 0.1


def test_pairs_with_a_number_that_is_not_known_do_not_count():
    found = compare_means([1.0, np.nan, 3.0], [0.0, 5.0, 1.0])
    assert (found.difference.n, found.difference.value) == (2, pytest.approx(1.5))
    assert np.isnan(compare_means([], []).difference.value)


def test_rates_are_compared_exactly():
    found = compare_rates([3, 5], [0, 0], 2.0, 2.0, "1/h")
    assert found.p == pytest.approx(2 * 0.5**8)
    assert found.difference.value == 4.0
    assert found.difference.low > 0
    none = compare_rates([0], [0], 1.0, 3.0)
    assert (none.difference.value, none.p) == (0.0, 1.0)
    assert none.difference.low < 0 < none.difference.high
    assert np.isnan(compare_rates([0], [1], 0.0, 1.0).p)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: estimate_mean([[1.0, 2.0]]), r"values must have shape \(n,\).*got \(1, 2\)"),
        (lambda: estimate_mean(["a"]), "values must be numbers"),
        (lambda: estimate_rate([0.5], 1.0), "counts must be non-negative integers"),
        (lambda: estimate_rate([-1], 1.0), "counts must be non-negative integers"),
        (lambda: estimate_rate([np.nan], 1.0), "counts must be non-negative integers"),
        (lambda: estimate_rate([1], -1.0), "exposure must not be negative"),
        (lambda: estimate_share([0.5]), "outcomes must be true or false"),
        (lambda: estimate_share([np.nan]), "outcomes must be true or false"),
        (lambda: compare_means([1.0], [1.0, 2.0]), "must have the same seeds, got 1 and 2"),
        (lambda: compare_rates([0.5], [1], 1.0, 1.0), "counts must be non-negative integers"),
    ],
)
def test_what_cannot_be_counted_is_refused(call, said):
    with pytest.raises(ConfigError, match=said):
        call()
