"""Pixels of several cameras to points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrc_env.core.errors import ConfigError
from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.geometry.rotations import about_axis
from hrc_env.geometry.triangulation import triangulate

seeds = st.integers(0, 2**32 - 1)


def rig(rng, n_cameras):
    """Cameras round a room, each turned to somewhere near its middle."""
    angle = rng.uniform(0, 2 * np.pi) + 2.4 * np.arange(n_cameras) + rng.uniform(-0.3, 0.3)
    eyes = np.stack([4 * np.cos(angle), 4 * np.sin(angle), rng.uniform(1, 4, n_cameras)], -1)
    targets = rng.uniform([-0.3, -0.3, 0.7], [0.3, 0.3, 1.3], (n_cameras, 3))
    fields = rng.uniform(50, 110, n_cameras)
    return tuple(
        pinhole(f"camera_{k}", eyes[k], targets[k], fields[k], 1920, 1080) for k in range(n_cameras)
    )


def points(rng, shape):
    return rng.uniform([-1, -1, 0], [1, 1, 2], (*shape, 3))


@settings(max_examples=30, deadline=None)
@given(seeds, st.integers(2, 6))
def test_pixels_without_noise_give_the_point_back(seed, n_cameras):
    rng = np.random.default_rng(seed)
    P, truth = projections(rig(rng, n_cameras)), points(rng, (2, 1, 5))
    px, _ = project(P, truth)
    for gate_sigma in (0.0, 5.0):
        result = triangulate(P, px, np.full(px.shape[:-1], 2.0), gate_sigma)
        np.testing.assert_allclose(result.points_world, truth, atol=1e-6)
        assert (result.used.sum(1) == n_cameras).all()


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_moving_world_and_cameras_together_moves_the_points(seed):
    rng = np.random.default_rng(seed)
    P, truth = projections(rig(rng, 4)), points(rng, (1, 1, 5))
    px = project(P, truth)[0] + rng.normal(0, 3, (1, 4, 1, 5, 2))
    sigma = np.full(px.shape[:-1], 3.0)
    T = np.eye(4)
    T[:3, :3] = about_axis("z", rng.uniform(0, 6)) @ about_axis("x", rng.uniform(0, 6))
    T[:3, 3] = rng.uniform(-2, 2, 3)
    still = triangulate(P, px, sigma, 5.0)
    moved = triangulate(P @ np.linalg.inv(T), px, sigma, 5.0)
    expected = still.points_world @ T[:3, :3].T + T[:3, 3]
    np.testing.assert_allclose(moved.points_world, expected, atol=1e-6)


def test_the_covariance_is_the_spread_of_the_points():
    rng = np.random.default_rng(0)
    P, truth = projections(rig(rng, 4)), np.tile([0.2, 0.1, 1.2], (1, 1, 4000, 1))
    px = project(P, truth)[0] + rng.normal(0, 3, (1, 4, 1, 4000, 2))
    result = triangulate(P, px, np.full(px.shape[:-1], 3.0))
    error = (result.points_world - truth)[0, 0]
    nees = np.einsum("ni,nij,nj->n", error, np.linalg.inv(result.cov_world[0, 0]), error)
    assert 2.85 < nees.mean() < 3.15  # three degrees of freedom


def test_a_view_that_is_less_certain_counts_less():
    rng = np.random.default_rng(3)
    P, truth = projections(rig(rng, 3)), points(rng, (1, 1, 1))
    px = project(P, truth)[0]
    px[:, 0] += 30.0
    errors = []
    for doubt in (1.0, 10.0, 100.0):
        sigma = np.ones(px.shape[:-1])
        sigma[:, 0] = doubt
        errors.append(np.linalg.norm(triangulate(P, px, sigma).points_world - truth))
    assert errors[0] > 5 * errors[1] > 25 * errors[2]


def test_a_wrong_view_is_left_out():
    rng = np.random.default_rng(4)
    P, truth = projections(rig(rng, 4)), points(rng, (3, 2, 15))
    px = project(P, truth)[0]
    px[:, 2] += 200.0
    result = triangulate(P, px, np.full(px.shape[:-1], 3.0), 5.0)
    np.testing.assert_allclose(result.points_world, truth, atol=1e-6)
    assert not result.used[:, 2].any()
    assert result.used[:, [0, 1, 3]].all()


@pytest.mark.parametrize("absurd", [np.nan, np.inf, -np.inf, 1e300])
def test_absurd_pixels_are_missing_ones(absurd):
    rng = np.random.default_rng(5)
    P, truth = projections(rig(rng, 4)), points(rng, (1, 1, 15))
    px = project(P, truth)[0]
    px[:, 1] = absurd
    result = triangulate(P, px, np.full(px.shape[:-1], 3.0))
    np.testing.assert_allclose(result.points_world, truth, atol=1e-6)
    assert (result.used.sum(1) == 3).all()


def test_one_view_gives_no_point():
    rng = np.random.default_rng(6)
    P = projections(rig(rng, 4))
    px = project(P, points(rng, (1, 1, 15)))[0]
    px[:, 1:] = np.nan
    result = triangulate(P, px, np.full(px.shape[:-1], 3.0), 5.0)
    assert np.isnan(result.points_world).all()
    assert (result.used.sum(1) == 0).all()


def test_shapes_that_do_not_fit_are_refused():
    P = projections(rig(np.random.default_rng(0), 4))
    with pytest.raises(ConfigError, match=r"px must have shape \(B, 4, W, J, 2\)"):
        triangulate(P, np.zeros((1, 3, 1, 15, 2)), np.ones((1, 3, 1, 15)))
    with pytest.raises(ConfigError, match="sigma_px must have shape"):
        triangulate(P, np.zeros((1, 4, 1, 15, 2)), np.ones((1, 4, 1, 14)))
