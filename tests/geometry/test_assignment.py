"""Assignment: as good as trying every permutation."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrc_env.geometry.assignment import assign_rows


def assign(cost):
    column = np.empty(len(cost), int)
    assign_rows(cost, column)
    return column


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 5), st.integers(0, 2), st.integers(0, 1000))
def test_no_permutation_costs_less(n, spare, seed):
    cost = np.random.default_rng(seed).normal(size=(n, n + spare))
    chosen = assign(cost)
    assert len(set(chosen.tolist())) == n
    least = min(
        sum(cost[row, column] for row, column in enumerate(columns))
        for columns in itertools.permutations(range(n + spare), n)
    )
    assert cost[np.arange(n), chosen].sum() == pytest.approx(least)


def test_the_greedy_choice_is_not_always_the_best():
    """The first row would take 0, and the second then pay 9."""
    np.testing.assert_array_equal(assign(np.array([[0.0, 1.0], [1.0, 9.0]])), [1, 0])


def test_nobody_needs_nothing():
    assert assign(np.empty((0, 3))).shape == (0,)
