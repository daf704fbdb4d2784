"""Gaps between capsules against brute force, and the cases where formulas break."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hrc_env.geometry.distances import least_separation

coordinates = st.floats(-2, 2, allow_nan=False, width=32)
segment = st.lists(coordinates, min_size=6, max_size=6).map(
    lambda values: np.array(values).reshape(1, 2, 3)
)


def sampled_distance(a: np.ndarray, b: np.ndarray, n: int = 60) -> float:
    """Distance of two segments by looking at n x n pairs of points."""
    t = np.linspace(0, 1, n)[:, None]
    on_a, on_b = a[0] + t * (a[1] - a[0]), b[0] + t * (b[1] - b[0])
    return float(np.linalg.norm(on_a[:, None] - on_b[None], axis=-1).min())


def _segment(*numbers: float) -> np.ndarray:
    return np.array(numbers).reshape(1, 2, 3)


@given(segment, segment)
@example(_segment(1, 0, 0, 0, 0, 1), _segment(1, 0, 6.103515625e-05, 0, 0, 1))  # all but parallel
@settings(max_examples=150, deadline=None)
def test_a_gap_is_never_above_what_sampling_finds_and_hardly_below(a, b):
    gap = least_separation(a, np.zeros(1), b, np.zeros(1))
    found = sampled_distance(a[0], b[0])
    spacing = (np.linalg.norm(np.diff(a[0], axis=0)) + np.linalg.norm(np.diff(b[0], axis=0))) / 59
    assert gap.distance_m <= found + 1e-6
    assert gap.distance_m >= found - spacing
    assert np.linalg.norm(gap.point_a_world - gap.point_b_world) == pytest.approx(
        float(gap.distance_m), abs=1e-6
    )


def test_radii_are_taken_off_and_overlap_is_negative():
    a = np.array([[[0.0, 0, 0], [1, 0, 0]]])
    b = np.array([[[0.5, 0, 0.3], [0.5, 0, 1]]])
    assert least_separation(a, np.array([0.1]), b, np.array([0.05])).distance_m == pytest.approx(
        0.15
    )
    assert least_separation(a, np.array([0.2]), b, np.array([0.2])).distance_m == pytest.approx(
        -0.1
    )


def test_pruning_by_spheres_changes_nothing():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(50, 9, 2, 3)), rng.normal(size=(50, 18, 2, 3)) + 1.5
    ra, rb = rng.uniform(0, 0.3, 9), rng.uniform(0, 0.3, 18)
    whole = least_separation(a, ra, b, rb).distance_m
    pairs = [
        least_separation(a[:, [i]], ra[[i]], b[:, [j]], rb[[j]]).distance_m
        for i in range(9)
        for j in range(18)
    ]
    np.testing.assert_array_equal(whole, np.min(pairs, axis=0))


def test_nobody_is_infinitely_far_away():
    gap = least_separation(np.zeros((3, 2, 2, 3)), np.ones(2), np.zeros((3, 0, 2, 3)), np.ones(4))
    assert np.isinf(gap.distance_m).all()


def test_several_workers_share_one_list_of_radii():
    a = np.zeros((1, 1, 2, 3))
    two = np.zeros((1, 2, 1, 2, 3))
    two[0, 1, ..., 0] = 5.0
    two[0, 0, ..., 0] = 2.0
    gap = least_separation(a, np.array([0.1]), two.reshape(1, 2, 2, 3), np.array([0.4]))
    assert gap.distance_m[0] == pytest.approx(1.5)
