"""The emulator errs as the detector does, and only as much."""

import copy
import dataclasses

import numpy as np
import pytest
from people import truth

from hrc_env.errors import ConfigError
from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.geometry.sight import Surroundings, nothing
from hrc_env.perception.emulator import EmulatorConfig, emulate, make_state, reset
from hrc_env.skeleton import JOINT, MIRROR, N_JOINTS

DT = 0.04
CONFIG = EmulatorConfig()
EXACT = EmulatorConfig(
    seen_error=0, hidden_arm_error=0, hidden_leg_error=0, hidden_trunk_error=0,
    swap_share=0, miss_share=0,
)  # fmt: skip
STEADY = EmulatorConfig(swap_share=0, miss_share=0)
CAMERAS = tuple(
    pinhole(f"camera_{k}", np.array([x, y, 2.45]), np.array([0.2, 0, 1.0]), 90, 1920, 1080)
    for k, (x, y) in enumerate([(2.9, 2.6), (-2.9, 2.6), (-2.9, -2.6), (2.9, -2.6)])
)
FRONT = (pinhole("front", np.array([4.5, 0, 1.2]), np.array([0, 0, 1.0]), 60, 1920, 1080),)


def start(batch, config, cameras=CAMERAS, n_workers=1, first_seed=0):
    rngs = [np.random.default_rng(first_seed + b) for b in range(batch)]
    state = make_state(batch, len(cameras), n_workers, DT, config)
    reset(state, np.arange(batch), rngs, config)
    return state, rngs


def before(cameras, points, radius_m):
    """Balls before points (B, P, 3), 0.3 m nearer to every camera's eye."""
    eyes = np.stack([camera.eye_world for camera in cameras])[:, None]
    ray = points[:, None] - eyes
    centres = points[:, None] - 0.3 * ray / np.linalg.norm(ray, axis=-1, keepdims=True)
    balls = np.repeat(centres.reshape(len(points), -1, 1, 3), 2, axis=2)
    return Surroundings(
        nothing(1).still, nothing(len(balls)).moving, balls, np.full(balls.shape[1], radius_m)
    )


def film(config, n_images, cameras=FRONT, hidden=(), batch=32):
    """Errors in shares of stature, and confidences: (T, B, C, J, 2), (T, B, C, J)."""
    state, rngs = start(batch, config, cameras)
    true = truth(batch)
    px, depth = project(projections(cameras), true.joints_world[:, 0])
    stature_px = 1.75 * cameras[0].K[0, 0] / depth.mean(-1)[..., None, None]
    columns = [JOINT[name] for name in hidden]
    between = before(cameras, true.joints_world[:, 0, columns], 0.02)
    errors, confidences = [], []
    for _ in range(n_images):
        seen = emulate(state, rngs, true, between, cameras, config)
        errors.append((seen.px[:, :, 0] - px) / stature_px)
        confidences.append(seen.confidence[:, :, 0])
    return np.array(errors), np.array(confidences)


def test_without_errors_keypoints_are_the_projected_truth():
    state, rngs = start(2, EXACT)
    true = truth(2)
    px, _ = project(projections(CAMERAS), true.joints_world)
    seen = emulate(state, rngs, true, nothing(2), CAMERAS, EXACT)
    np.testing.assert_allclose(seen.px, px, atol=1e-9)


def test_visible_joints_err_as_measured():
    """Median 1.3 % of stature, 90th percentile 2.4 times as much."""
    errors, confidence = film(STEADY, 2, batch=1000)
    size = np.linalg.norm(errors, axis=-1)
    assert np.median(size) == pytest.approx(0.013, rel=0.1)
    assert np.percentile(size, 90) / np.median(size) == pytest.approx(2.4, rel=0.15)
    assert np.median(confidence) == pytest.approx(0.98, abs=0.01)


def test_hidden_arms_err_more_and_say_so():
    errors, confidence = film(STEADY, 2, hidden=("left_wrist", "right_wrist"), batch=1000)
    wrists = [JOINT["left_wrist"], JOINT["right_wrist"]]
    size = np.linalg.norm(errors[:, :, :, wrists], axis=-1)
    assert np.median(size) == pytest.approx(0.041, rel=0.15)
    assert np.percentile(size, 90) / np.median(size) > 3
    assert np.median(confidence[..., wrists]) < 0.2


def test_hidden_hips_err_more_and_say_nothing():
    hips = ("left_hip", "right_hip")
    errors, confidence = film(STEADY, 2, hidden=hips, batch=1000)
    columns = [JOINT[name] for name in hips]
    assert np.median(np.linalg.norm(errors[:, :, :, columns], axis=-1)) > 0.02
    assert np.median(confidence[..., columns]) > 0.95


def test_errors_last_for_about_half_a_second():
    """The correlation after 0.5 s is the slow part's share of the variance over e."""
    config = dataclasses.replace(STEADY, seen_tail=0.0)
    errors, _ = film(config, 300)  # correlated, so long rather than wide
    errors -= errors.mean()
    lag = round(CONFIG.correlation_s / DT)
    correlation = (errors[lag:] * errors[:-lag]).mean() / (errors**2).mean()
    expected = CONFIG.slow_share * np.exp(-lag * DT / CONFIG.correlation_s)
    assert correlation == pytest.approx(expected, abs=0.05)


def test_what_it_reports_as_sigma_is_about_what_it_errs():
    state, rngs = start(64, STEADY, FRONT)
    true = truth(64)
    px, _ = project(projections(FRONT), true.joints_world)
    whitened = []
    for _ in range(50):
        seen = emulate(state, rngs, true, nothing(64), FRONT, STEADY)
        whitened.append((seen.px - px) / seen.sigma_px[..., None])
    assert 0.6 < np.std(whitened) < 1.2


def test_a_blocked_camera_is_nan_without_confidence_and_with_infinite_sigma():
    state, rngs = start(1, STEADY)
    around = CAMERAS[2].eye_world + np.zeros((1, 1, 2, 3))
    lid = Surroundings(nothing(1).still, nothing(len(around)).moving, around, np.array([0.1]))
    seen = emulate(state, rngs, truth(), lid, CAMERAS, STEADY)
    assert np.isnan(seen.px[0, 2]).all()
    assert np.all(seen.confidence[0, 2] == 0)
    assert np.isinf(seen.sigma_px[0, 2]).all()
    assert np.isfinite(seen.px[0, [0, 1, 3]]).all()


def test_a_worker_behind_a_camera_is_not_seen():
    state, rngs = start(1, STEADY, FRONT)
    seen = emulate(state, rngs, truth(at=(8.0, 0, 0)), nothing(1), FRONT, STEADY)
    assert np.isnan(seen.px).all()


def test_joints_outside_the_image_are_guesses_with_a_large_sigma():
    state, rngs = start(1, EXACT, FRONT)
    seen = emulate(state, rngs, truth(at=(3.1, 0, 0)), nothing(1), FRONT, EXACT)
    v = seen.px[0, 0, 0, :, 1]
    outside = (v < 0) | (v >= 1080)
    assert outside.any()
    assert not outside.all()
    assert np.all(seen.confidence[0, 0, 0, outside] <= CONFIG.outside_confidence)
    assert seen.sigma_px[0, 0, 0, outside].min() > 2 * seen.sigma_px[0, 0, 0, ~outside].min()


def test_a_worker_in_front_hides_the_one_behind():
    state, rngs = start(1, EXACT, FRONT, n_workers=2)
    true = truth(n_workers=2)
    true.joints_world[0, 1] += [-1.0, -1.0, 0.0]
    true.capsules_world[0, 1] += [-1.0, -1.0, 0.0]  # now behind the first, seen from x
    seen = emulate(state, rngs, true, nothing(1), FRONT, EXACT)
    wrist = JOINT["left_wrist"]
    alone = np.median(seen.confidence[0, 0, 0])
    assert alone > 0.9
    assert np.isnan(seen.px[0, 0, 1]).all() or seen.confidence[0, 0, 1, wrist] < 0.5


def test_a_swap_exchanges_left_and_right():
    config = dataclasses.replace(EXACT, swap_share=1.0)
    state, rngs = start(1, config)
    true = truth()
    px, _ = project(projections(CAMERAS), true.joints_world)
    seen = emulate(state, rngs, true, nothing(1), CAMERAS, config)
    np.testing.assert_allclose(seen.px, px[..., MIRROR, :], atol=1e-9)


def test_swaps_and_misses_take_their_share_of_the_time_in_bursts():
    config = dataclasses.replace(EXACT, swap_share=0.1, miss_share=0.2)
    state, rngs = start(64, config)
    true, swapped, missed = truth(64), [], []
    for _ in range(300):
        seen = emulate(state, rngs, true, nothing(64), CAMERAS, config)
        swapped.append(state.swapped.copy())
        missed.append(np.isnan(seen.px[..., 0]).all(-1))
    assert np.mean(swapped) == pytest.approx(0.1, abs=0.02)
    assert np.mean(missed) == pytest.approx(0.2, abs=0.03)
    begun = np.array(swapped)[1:] & ~np.array(swapped)[:-1]
    length_s = DT * np.sum(swapped) / max(np.sum(begun), 1)
    assert length_s == pytest.approx(config.swap_s, rel=0.15)


@pytest.mark.parametrize("batch", [1, 3, 7])
def test_an_environment_sees_the_same_in_any_company(batch):
    """Environment 0 of a batch is the batch of one, bit for bit."""
    alone, crowd = start(1, CONFIG), start(batch, CONFIG)
    for _ in range(20):
        one = emulate(*alone, truth(1), nothing(1), CAMERAS, CONFIG)
        many = emulate(*crowd, truth(batch), nothing(batch), CAMERAS, CONFIG)
        np.testing.assert_array_equal(one.px[0], many.px[0])
        np.testing.assert_array_equal(one.sigma_px[0], many.sigma_px[0])


def test_a_copied_state_replays_the_same_errors():
    state, rngs = start(2, CONFIG)
    emulate(state, rngs, truth(2), nothing(2), CAMERAS, CONFIG)
    saved = copy.deepcopy((state, rngs))
    first = emulate(state, rngs, truth(2), nothing(2), CAMERAS, CONFIG)
    again = emulate(*saved, truth(2), nothing(2), CAMERAS, CONFIG)
    np.testing.assert_array_equal(first.px, again.px)


def test_a_reset_touches_only_its_own_environments():
    state, rngs = start(3, CONFIG)
    before = copy.deepcopy(state)
    reset(state, np.array([1]), rngs, CONFIG)
    np.testing.assert_array_equal(state.slow[[0, 2]], before.slow[[0, 2]])
    assert not np.array_equal(state.slow[1], before.slow[1])


def test_a_room_without_workers_has_no_keypoints():
    state, rngs = start(2, CONFIG, n_workers=0)
    seen = emulate(state, rngs, truth(2, 0), nothing(2), CAMERAS, CONFIG)
    assert seen.px.shape == (2, 4, 0, N_JOINTS, 2)


def test_settings_and_shapes_that_cannot_work_are_explained():
    with pytest.raises(ConfigError, match="swap_share must be in"):
        EmulatorConfig(swap_share=1.5)
    with pytest.raises(ConfigError, match="correlation_s must be positive"):
        EmulatorConfig(correlation_s=0.0)
    state, rngs = start(1, CONFIG)
    with pytest.raises(ConfigError, match="capsules_world must have shape"):
        emulate(state, rngs, truth(), nothing(2), CAMERAS, CONFIG)
