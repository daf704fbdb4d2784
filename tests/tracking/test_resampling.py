"""Choosing ancestors by weight."""

import numpy as np

from hrc_env.tracking.paper import draw_multinomial

WEIGHTS = np.array([0.05, 0.4, 0.0, 0.3, 0.25])


def counts(n, rng):
    """How often each of the five particles is chosen in n draws."""
    weights = np.zeros(n)
    weights[: len(WEIGHTS)] = WEIGHTS
    ancestors = np.empty(n, np.int64)
    draw_multinomial(weights, rng.standard_exponential(n + 1), ancestors)
    return np.bincount(ancestors, minlength=n)[: len(WEIGHTS)]


def test_particles_are_copied_in_proportion_to_their_weights():
    rng = np.random.default_rng(0)
    n, repeats = 50, 4000
    total = sum(counts(n, rng) for _ in range(repeats))
    expected = n * repeats * WEIGHTS
    np.testing.assert_allclose(total, expected, atol=4 * np.sqrt(expected.max()))
    assert total[2] == 0  # weight zero is never chosen


def test_multinomial_counts_vary_as_multinomial_counts_do():
    rng = np.random.default_rng(1)
    n = 50
    drawn = np.stack([counts(n, rng) for _ in range(4000)])
    np.testing.assert_allclose(drawn.var(0), n * WEIGHTS * (1 - WEIGHTS), rtol=0.1)
