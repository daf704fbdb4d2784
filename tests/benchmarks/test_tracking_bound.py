"""The bound: what it is in the linear case, and that an estimator can reach it."""

import numpy as np
import pytest

from benchmarks.tracking.bound import posterior_bound
from benchmarks.tracking.cells import run_cell
from benchmarks.tracking.matched import (
    N_PLACES,
    N_STATES,
    advance,
    draw,
    heading,
    make_matched_model,
    transition,
)
from benchmarks.tracking.rigs import make_rig
from benchmarks.tracking.sequences import make_sequences
from hrc_env.core.skeleton import N_JOINTS

MODEL = make_matched_model(0.5, 0.05)
SIGMA_PX = 3.0


def affine_rig():
    """Cameras from infinitely far away: pixels are linear in the point."""
    P = np.zeros((3, 3, 4))
    P[:, 2, 3] = 1.0
    P[0, :2, :3] = [[300, 0, 0], [0, 0, -300]]
    P[1, :2, :3] = [[0, 300, 0], [0, 0, -300]]
    P[2, :2, :3] = [[200, 200, 0], [-60, 60, -280]]
    return P


def test_the_transition_is_the_derivative_of_the_motion():
    rng = np.random.default_rng(0)
    place = MODEL.offset + rng.normal(0, 0.05, MODEL.offset.shape)
    state = np.concatenate([place, rng.normal(0, 1, place.shape)]).reshape(1, -1)
    step = 1e-6 * np.eye(N_STATES)
    numeric = (advance(MODEL, state + step) - advance(MODEL, state - step)).T / 2e-6
    np.testing.assert_allclose(transition(MODEL, place[None])[0], numeric, atol=1e-7)


def test_motion_is_the_same_in_every_place_and_direction():
    joints = draw(MODEL, [1], 2)[0]
    body = np.concatenate([joints[0], 0 * joints[0]]).reshape(1, -1)
    shifted = body.reshape(1, 2, N_JOINTS, 3) + np.array([[5.0, -3.0, 0.4], [0, 0, 0]])[:, None]
    moved = advance(MODEL, shifted.reshape(1, -1)).reshape(2, N_JOINTS, 3)[0]
    np.testing.assert_allclose(
        moved, advance(MODEL, body).reshape(2, N_JOINTS, 3)[0] + [5.0, -3.0, 0.4], atol=1e-9
    )
    assert abs(heading(joints)[0]) < 1.5


def test_in_the_linear_case_the_bound_is_a_kalman_filters_covariance():
    """Affine cameras: Kalman's covariance is exact."""
    P = affine_rig()
    joints = np.repeat(
        np.tile(MODEL.offset, (1, 1, 1, 1)), 8, 0
    )  # stands still: constant derivatives
    seen = np.random.default_rng(1).random((8, 1, 3, N_JOINTS)) < 0.7
    bound = posterior_bound(P, MODEL, joints, seen, SIGMA_PX)
    move = transition(MODEL, joints[0])[0]
    cov = np.diag(np.repeat([1.5**2, 1.0], N_PLACES))
    for t in range(8):
        if t:
            cov = move @ cov @ move.T + MODEL.Q
        for c, j in np.argwhere(seen[t, 0]):
            for axis in range(2):  # one scalar measurement at a time, by Joseph's form
                row = np.zeros(N_STATES)
                row[3 * j : 3 * j + 3] = P[c, axis, :3]
                gain = cov @ row / (row @ cov @ row + SIGMA_PX**2)
                keep = np.eye(N_STATES) - np.outer(gain, row)
                cov = keep @ cov @ keep.T + SIGMA_PX**2 * np.outer(gain, gain)
        for j in range(N_JOINTS):
            own = slice(3 * j, 3 * j + 3)
            np.testing.assert_allclose(bound[t, 0, j], cov[own, own], rtol=1e-5, atol=1e-9)


def test_more_views_lower_the_bound():
    rig, joints = make_rig("lab"), draw(MODEL, [1], 10)
    seen = np.ones((10, 1, 4, N_JOINTS), bool)
    all_four = posterior_bound(rig.P, MODEL, joints, seen, SIGMA_PX)
    seen[:, :, 2:] = False
    two = posterior_bound(rig.P, MODEL, joints, seen, SIGMA_PX)
    assert (np.linalg.eigvalsh(two - all_four) > -1e-12).all()


def test_estimators_can_be_told_what_matched_sequences_are_and_reach_the_bound():
    """With bones switched off, nothing but linearisation and learnt places is between them."""
    rig, seeds = make_rig("lab"), list(range(400, 412))
    sums = run_cell("kalman", rig, make_sequences(rig, "matched", seeds), seeds, lambda share: None)
    total = {name: np.sum(value) for name, value in sums["matched"].items()}
    assert np.sqrt(total["squared"] / total["bound"]) == pytest.approx(1.0, abs=0.04)
    assert 0.93 < total["inside"] / total["n"] < 0.97
