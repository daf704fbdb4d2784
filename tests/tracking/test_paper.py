"""Algorithm 1, the paper's filter."""

import numpy as np
import pytest
from simulated import DT, LAB, Damage, detections, generators, keypoints, track, walk

from hrc_env.core.errors import ConfigError
from hrc_env.tracking.config import PaperConfig
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.paper import find_place, roll

SIGMA_PX, FOCAL_PX = 3.0, 100.0
AFFINE = np.array(
    [
        [[FOCAL_PX, 0, 0, 500], [0, 0, FOCAL_PX, 500], [0, 0, 0, 1.0]],
        [[0, FOCAL_PX, 0, 500], [0, 0, FOCAL_PX, 500], [0, 0, 0, 1.0]],
    ]
)
"""Two parallel-projection cameras: pixels are linear in the point, so that a Kalman filter on
the random walk is the exact answer that Algorithm 1 approximates."""


def kalman(px, start, walk_m):
    """Exact mean and variance of every joint and axis; z is seen by both cameras."""
    seen = (np.stack([px[:, 0, :, 0], px[:, 1, :, 0], px[:, :, :, 1].mean(1)], -1) - 500) / FOCAL_PX
    noise = (SIGMA_PX / FOCAL_PX) ** 2 * np.array([1, 1, 0.5])
    mean, variance = start, noise.copy()
    history = []
    for z in seen:
        variance = variance + walk_m**2
        gain = variance / (variance + noise)
        mean, variance = mean + gain * (z - mean), (1 - gain) * variance
        history.append(mean)
    return np.stack(history), variance


@pytest.mark.parametrize("n_particles", [400, 6400])
def test_it_converges_to_the_kalman_filter_on_a_linear_gaussian_problem(n_particles):
    rng = np.random.default_rng(0)
    walk_m = 0.03
    steps = walk_m * rng.standard_normal((30, 15, 3))
    truth = np.array([1.0, 0.0, 1.0]) + np.cumsum(steps, 0)
    px = np.stack([truth[..., [0, 2]], truth[..., [1, 2]]], 1) * FOCAL_PX + 500
    px += SIGMA_PX * rng.standard_normal(px.shape)
    config = PaperConfig(n_particles=n_particles, sigma_m=walk_m, min_std_m=1e-6, gate_sigma=20.0)
    estimates = track(make_estimator("paper_restarts", AFFINE, DT, config), px[:, None], SIGMA_PX)
    mean = np.stack([e.mean_world[0, 0] for e in estimates])
    exact, variance = kalman(px[1:], mean[0], walk_m)
    error = np.sqrt(np.mean((mean[1:] - exact) ** 2 / variance))
    assert error < 6.0 / np.sqrt(n_particles)
    got = estimates[-1].cov_world[0, 0].diagonal(axis1=-2, axis2=-1).mean(0)
    np.testing.assert_allclose(got, variance, rtol=6.0 / np.sqrt(n_particles))


def test_no_noise_leaves_the_particles_where_they_are():
    particles = np.random.default_rng(0).random((15, 3, 40))
    before = particles.copy()
    roll(particles, 0.0, np.random.default_rng(1))
    np.testing.assert_array_equal(particles, before)


def test_a_step_adds_the_walks_variance_and_no_bias():
    particles = np.zeros((15, 3, 4000))
    roll(particles, 0.05, np.random.default_rng(1))
    np.testing.assert_allclose(particles.std(-1), 0.05, rtol=0.05)
    np.testing.assert_allclose(particles.mean(-1), 0.0, atol=0.05 * 4 / np.sqrt(4000))


def test_one_camera_leaves_the_depth_open_and_four_close_it():
    """The paper's point: across the ray one camera is enough, along it it says nothing."""
    joints = np.repeat(walk(0, 1), 60, axis=0)
    px = detections(joints, Damage(), 0)
    px[25:, 1:] = np.nan
    estimates = track(make_estimator("paper", LAB, DT), px[:, None])
    four = np.linalg.eigvalsh(estimates[24].cov_world[0, 0])
    one = np.linalg.eigvalsh(estimates[42].cov_world[0, 0])
    assert np.sqrt(four[:, -1]).max() < 0.03
    assert np.sqrt(one[:, 0]).max() < 0.03
    assert np.sqrt(one[:, -1]).min() > 0.06
    eye = -np.linalg.solve(LAB[0, :, :3], LAB[0, :, 3])
    _, directions = np.linalg.eigh(estimates[42].cov_world[0, 0])
    ray = joints[0] - eye
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    assert (np.abs((directions[..., -1] * ray).sum(-1)) > 0.98).all()


def test_four_cameras_follow_a_walk_to_a_few_centimetres():
    joints = walk(1, 120)
    estimates = track(make_estimator("paper", LAB, DT), detections(joints, Damage(), 1)[:, None])
    mean = np.stack([e.mean_world[0, 0] for e in estimates])
    error = np.linalg.norm(mean - joints, axis=-1)[10:]
    assert np.sqrt((error**2).mean()) < 0.03


def test_more_passes_follow_too():
    joints = walk(2, 50)
    estimator = make_estimator("paper", LAB, DT, PaperConfig(n_particles=500, n_iterations=2))
    estimates = track(estimator, detections(joints, Damage(), 2)[:, None])
    assert np.linalg.norm(estimates[-1].mean_world[0, 0] - joints[-1], axis=-1).max() < 0.1


def test_walking_for_a_longer_time_spreads_the_particles_more():
    estimator = make_estimator("paper_restarts", LAB, DT)
    px, rngs, state = detections(walk(3, 1), Damage(), 3), generators(1), estimator.init(1, 1)
    estimator.update(state, keypoints(px), rngs)
    before = state.particles.var(-1)
    estimator.predict(state, 4 * DT, rngs)
    np.testing.assert_allclose((state.particles.var(-1) - before).mean(), 4 * 0.05**2, rtol=0.05)


def test_particles_begin_all_over_the_room_that_the_cameras_stand_round():
    estimator = make_estimator("paper", LAB, DT)
    state = estimator.init(1, 1)
    low, high = (side(state.particles[0, 0], axis=(0, 2)) for side in (np.min, np.max))
    np.testing.assert_allclose(low, [-2.9, -2.6, 0.0], atol=0.01)
    np.testing.assert_allclose(high, [2.9, 2.6, 2.2], atol=0.01)
    estimate = estimator.estimate(state)
    assert not estimate.tracked.any()
    assert (np.linalg.norm(estimate.mean_world - [0, 0, 1.1], axis=-1) < 0.3).all()


def test_cameras_on_one_wall_leave_the_depth_of_the_place_to_the_prior():
    wall = make_estimator("paper", LAB[[0, 3]], DT, PaperConfig(prior_std_m=1.0))
    np.testing.assert_allclose(find_place(wall.P, wall.config)[0], [-0.7, 3.3])
    told = PaperConfig(initial_bounds_m=((-1, 2), (-3, 4), (0, 1)))
    np.testing.assert_array_equal(find_place(LAB, told), told.initial_bounds_m)


@pytest.mark.parametrize(
    "initial_bounds_m", [((0, 1), (0, 1)), ((0, 1), (0, 1), (2, 2)), (1, 2, 3)]
)
def test_a_place_that_is_none_is_refused(initial_bounds_m):
    with pytest.raises(ConfigError, match="initial_bounds_m must be empty or contain the minimum"):
        PaperConfig(initial_bounds_m=initial_bounds_m)


def test_clouds_from_all_over_the_room_find_the_body_and_are_tracked_from_then_on():
    joints = np.repeat(walk(4, 1), 40, axis=0)
    estimates = track(make_estimator("paper", LAB, DT), detections(joints, Damage(), 4)[:, None])
    error = [np.median(np.linalg.norm(e.mean_world[0, 0] - joints[0], axis=-1)) for e in estimates]
    tracked = [bool(e.tracked[0, 0]) for e in estimates]
    begun = tracked.index(True)
    assert all(tracked[begun:])
    assert max(error[4:]) < 0.1
    assert error[begun] < 0.2
    assert error[0] > 0.2
    assert not np.any(estimates[0].velocity_world)


def test_the_printed_algorithm_only_walks_to_a_worker_who_is_elsewhere_and_restarts_jump():
    """The listing has no line that begins a cloud anew."""
    joints = np.repeat(walk(5, 1), 40, axis=0)
    joints[20:] += [-2.0, 0.0, 0.0]
    px = detections(joints, Damage(), 5)[:, None]
    moved = {}
    for name in ("paper", "paper_restarts"):
        estimates = track(make_estimator(name, LAB, DT), px)
        moved[name] = [np.median(e.mean_world[0, 0, :, 0] - joints[0, :, 0]) for e in estimates]
    jumps = {name: np.abs(np.diff(x[20:])).max() for name, x in moved.items()}
    assert jumps["paper"] < 0.4
    assert jumps["paper_restarts"] > 1.0
    assert moved["paper"][-1] < -1.9
