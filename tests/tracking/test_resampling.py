"""Choosing ancestors by weight."""

import numpy as np
import pytest

from hrc_env.tracking.paper import multinomial, systematic

WEIGHTS = np.array([0.05, 0.4, 0.0, 0.3, 0.25])


def counts(scheme, n, rng):
    """How often each of the five particles is chosen in n draws."""
    weights = np.zeros(n)
    weights[: len(WEIGHTS)] = WEIGHTS
    ancestors = np.empty(n, np.int64)
    scheme(
        weights,
        rng.standard_exponential(n + 1) if scheme is multinomial else rng.random(),
        ancestors,
    )
    return np.bincount(ancestors, minlength=n)[: len(WEIGHTS)]


@pytest.mark.parametrize("scheme", [multinomial, systematic])
def test_particles_are_copied_in_proportion_to_their_weights(scheme):
    rng = np.random.default_rng(0)
    n, repeats = 50, 4000
    total = sum(counts(scheme, n, rng) for _ in range(repeats))
    expected = n * repeats * WEIGHTS
    np.testing.assert_allclose(total, expected, atol=4 * np.sqrt(expected.max()))
    assert total[2] == 0  # weight zero is never chosen


def test_multinomial_counts_vary_as_multinomial_counts_do():
    rng = np.random.default_rng(1)
    n = 50
    drawn = np.stack([counts(multinomial, n, rng) for _ in range(4000)])
    np.testing.assert_allclose(drawn.var(0), n * WEIGHTS * (1 - WEIGHTS), rtol=0.1)


def test_systematic_counts_differ_from_their_expectation_by_less_than_one():
    rng = np.random.default_rng(2)
    for _ in range(200):
        assert (np.abs(counts(systematic, 50, rng) - 50 * WEIGHTS) < 1).all()
