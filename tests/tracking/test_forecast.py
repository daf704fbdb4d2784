"""Predictions: where joints will be, how surely, and what is refused."""

import numpy as np
import pytest
from simulated import DT, LAB, Damage, detections, generators, keypoints, walk

from hrc_env.config import HRCConfig
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import MIRROR, N_JOINTS
from hrc_env.geometry.rotations import about_axis
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import ESTIMATORS, make_estimator
from hrc_env.tracking.forecast import forecast, mix_hypotheses
from hrc_env.tracking.oracle import estimate_prior
from hrc_env.tracking.tree.state import STANDING_M

CONFIG = TrackerConfig()


def standing(velocity=(0.0, 0.0, 0.0), std_m=0.02):
    """Somebody upright at (1, 0.5) who looks along +x and moves as a whole."""
    points = STANDING_M + np.array([1.0, 0.5, 1.2])
    return PoseEstimate(
        mean_world=points[None, None].copy(),
        cov_world=np.tile(std_m**2 * np.eye(3), (1, 1, N_JOINTS, 1, 1)),
        velocity_world=np.tile(np.array(velocity, float), (1, 1, N_JOINTS, 1)),
        age_s=np.zeros((1, 1, N_JOINTS)),
        tracked=np.ones((1, 1), bool),
    )


def deviation(estimate):
    return np.sqrt(np.trace(estimate.cov_world, axis1=-2, axis2=-1).mean())


@pytest.mark.parametrize("horizon_s", [0.0, -0.1, 1.01, np.nan, np.inf])
def test_a_horizon_that_is_none_is_refused_in_words(horizon_s):
    with pytest.raises(ConfigError, match=r"horizon must be in \(0, 1\] s, got"):
        forecast(standing(), horizon_s, CONFIG)
    with pytest.raises(ConfigError, match="forecast_s must be"):
        HRCConfig(forecast_s=(0.2, horizon_s))


def test_who_stands_still_is_expected_there_and_who_moves_further_on():
    still, moving = (forecast(standing((v, 0, 0)), 0.4, CONFIG) for v in (0.0, 1.2))
    moved = moving.mean_world - still.mean_world
    assert np.linalg.norm(still.mean_world - standing().mean_world, axis=-1).mean() < 0.1
    assert 0.1 < moved[..., 0].mean() < 0.55
    assert abs(moved[..., 1].mean()) < 0.1


def test_the_further_ahead_the_less_is_known():
    spread = [deviation(forecast(standing(), h, CONFIG)) for h in (0.05, 0.1, 0.3, 0.5, 0.7, 1.0)]
    assert deviation(standing()) < spread[0]
    assert (np.diff(spread) > 0).all()


def test_what_is_not_known_now_is_not_known_then():
    """A depth that one camera leaves open stays open."""
    now = standing()
    now.cov_world[..., 0, 0] = 0.5**2
    assert (forecast(now, 0.4, CONFIG).cov_world[..., 0, 0] >= 0.5**2).all()


def test_a_turn_of_the_world_turns_the_prediction():
    now, turn = standing((0.9, 0.2, 0.0)), about_axis("z", np.array(0.7))
    turned = PoseEstimate(
        now.mean_world @ turn.T, turn @ now.cov_world @ turn.T, now.velocity_world @ turn.T,
        now.age_s, now.tracked,
    )  # fmt: skip
    here, there = forecast(now, 0.6, CONFIG), forecast(turned, 0.6, CONFIG)
    np.testing.assert_allclose(there.mean_world, here.mean_world @ turn.T, atol=1e-5)
    np.testing.assert_allclose(there.cov_world, turn @ here.cov_world @ turn.T, atol=1e-6)


def test_horizons_between_the_networks_own_have_no_jumps():
    means = [forecast(standing((1, 0, 0)), h, CONFIG).mean_world for h in np.linspace(0.01, 1, 100)]
    assert np.abs(np.diff(means, axis=0)).max() < 0.04


def test_who_is_nobody_relaxes_to_the_prior_and_the_prior_stays():
    nobody = estimate_prior(1, 1, CONFIG)
    later = forecast(nobody, 1.0, CONFIG)
    np.testing.assert_allclose(later.mean_world, nobody.mean_world)
    np.testing.assert_allclose(later.cov_world, nobody.cov_world)
    lost = standing((3, 0, 0))
    lost.tracked[:] = False
    away = np.abs(lost.mean_world - CONFIG.prior_mean_world)
    assert (np.abs(forecast(lost, 1.0, CONFIG).mean_world - CONFIG.prior_mean_world) <= away).all()


def test_a_body_without_heading_goes_on_as_it_goes():
    now = standing((1.0, 0.0, 0.0))
    now.mean_world[..., :2] = 0.0  # shoulders and hips above each other
    later = forecast(now, 0.5, CONFIG)
    np.testing.assert_allclose(later.mean_world[..., 0], 0.5)
    assert deviation(later) > 0.3


def test_extreme_bodies_give_finite_positive_definite_beliefs():
    rng = np.random.default_rng(0)
    for _ in range(20):
        now = standing()
        now.mean_world[:] += rng.normal(0, 3, now.mean_world.shape)
        now.velocity_world[:] = rng.normal(0, 20, now.velocity_world.shape)
        later = forecast(now, 1.0, CONFIG)
        assert np.isfinite(later.mean_world).all()
        assert (np.linalg.eigvalsh(later.cov_world) > 0).all()


def _followed(name, n_batch):
    joints = np.stack([walk(seed, 30) for seed in range(n_batch)], 1)
    px = np.stack([detections(joints[:, b], Damage(), b) for b in range(n_batch)], 1)
    estimator, rngs = make_estimator(name, LAB, DT), generators(n_batch)
    state = estimator.init(n_batch, 1)
    estimator.reset(state, np.arange(n_batch), rngs)
    for frame in px[:20]:
        estimator.predict(state, DT, rngs)
        estimator.update(state, keypoints(frame), rngs)
    return estimator, state, joints


@pytest.mark.parametrize("name", ESTIMATORS)
def test_every_estimator_looks_ahead_and_its_state_stays(name):
    estimator, state, _ = _followed(name, 2)
    before = estimator.estimate(state)
    later = estimator.forecast(state, 0.3)
    again = estimator.estimate(state)
    for field in PoseEstimate.__slots__:
        np.testing.assert_array_equal(getattr(before, field), getattr(again, field))
        assert getattr(later, field).shape == getattr(before, field).shape
    assert np.isfinite(later.mean_world).all()
    assert (np.linalg.eigvalsh(later.cov_world) > 0).all()
    np.testing.assert_allclose(later.age_s, before.age_s + 0.3)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_prediction_does_not_depend_on_who_else_is_there(name):
    several, alone = (_followed(name, n) for n in (3, 1))
    a, b = (estimator.forecast(state, 0.4) for estimator, state, _ in (several, alone))
    np.testing.assert_array_equal(a.mean_world[:1], b.mean_world)
    np.testing.assert_array_equal(a.cov_world[:1], b.cov_world)


def test_walkers_that_it_never_saw_are_found_nearer_than_if_they_stood_still():
    estimator, state, joints = _followed("kalman", 8)
    then = joints[24][:, None]  # frame 19 was the last; 0.2 s later
    stay, go = (
        each.mean_world for each in (estimator.estimate(state), estimator.forecast(state, 0.2))
    )
    error = [np.sqrt(((mean - then) ** 2).sum(-1).mean()) for mean in (stay, go)]
    assert error[1] < 0.7 * error[0]


def test_left_and_right_are_treated_alike():
    """The network was shown every motion mirrored, too."""
    now, flip = standing((0.8, 0.3, 0.0)), np.array([1.0, -1.0, 1.0])
    other = PoseEstimate(
        now.mean_world[:, :, MIRROR] * flip, now.cov_world, now.velocity_world * flip,
        now.age_s, now.tracked,
    )  # fmt: skip
    here = forecast(now, 0.4, CONFIG).mean_world
    there = forecast(other, 0.4, CONFIG).mean_world[:, :, MIRROR] * flip
    assert np.abs(here - there).max() < 0.15


def test_one_hypothesis_is_its_own_mixture_and_two_that_differ_spread():
    one, two = standing(), standing()
    two.mean_world[..., 0] += 1.0
    both = PoseEstimate(
        *(np.concatenate([getattr(one, f), getattr(two, f)], 1) for f in PoseEstimate.__slots__)
    )
    weights = np.log([[[0.75, 0.25]]])
    alone = mix_hypotheses(both, np.zeros((1, 1, 2)), np.array([[1]]))
    np.testing.assert_array_equal(alone.mean_world, one.mean_world)
    np.testing.assert_array_equal(alone.cov_world, one.cov_world)
    mixture = mix_hypotheses(both, weights, np.array([[2]]))
    np.testing.assert_allclose(mixture.mean_world, one.mean_world + np.array([0.25, 0, 0]))
    expected = 0.02**2 + 0.75 * 0.25**2 + 0.25 * 0.75**2
    np.testing.assert_allclose(mixture.cov_world[..., 0, 0], expected)


def test_where_no_workers_are_none_are_expected():
    nobody = estimate_prior(2, 0, CONFIG)
    assert forecast(nobody, 0.5, CONFIG).mean_world.shape == (2, 0, N_JOINTS, 3)
    later = mix_hypotheses(nobody, np.zeros((2, 0, 1)), np.ones((2, 0), np.int64))
    assert later.cov_world.shape == (2, 0, N_JOINTS, 3, 3)
