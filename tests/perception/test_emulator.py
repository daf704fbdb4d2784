"""The emulator errs as the detector does, and only as much."""

import copy
import dataclasses
import math

import numpy as np
import pytest
from people import truth
from scipy.stats import multivariate_normal, norm

from assets.emulator.writing import write_calibration
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import JOINT, MIRROR, N_JOINTS
from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.geometry.sight import Surroundings, no_surroundings
from hrc_env.perception.calibration import KINDS, SHAPES, read_calibration
from hrc_env.perception.emulator import (
    EmulatorConfig,
    emulate,
    lines_of_sight,
    make_state,
    reset,
)
from hrc_env.perception.noise import sigma_px
from hrc_env.perception.outline import posture_of
from hrc_env.perception.searching import STATURE_OF_SIDE
from hrc_env.perception.sightlines import HIDDEN, SEEN, SIDE
from hrc_env.perception.windows import window_from_joints

DT = 0.04
CONFIG = EmulatorConfig()
EXACT = EmulatorConfig(error_scale=0, swap_share=0, miss_share=0)
STEADY = EmulatorConfig(swap_share=0, miss_share=0)
CAMERAS = tuple(
    pinhole(f"camera_{k}", np.array([x, y, 2.45]), np.array([0.2, 0, 1.0]), 90, 1920, 1080)
    for k, (x, y) in enumerate([(2.9, 2.6), (-2.9, 2.6), (-2.9, -2.6), (2.9, -2.6)])
)
FRONT = (pinhole("front", np.array([4.5, 0, 1.2]), np.array([0, 0, 1.0]), 60, 1920, 1080),)


def start(batch, config, cameras=CAMERAS, n_workers=1, first_seed=0):
    rngs = [np.random.default_rng(first_seed + b) for b in range(batch)]
    state = make_state(batch, len(cameras), n_workers, DT, config)
    reset(state, np.arange(batch), rngs)
    return state, rngs


def before(cameras, points, radius_m):
    """Balls before points (B, P, 3), 0.3 m nearer to every camera's eye."""
    eyes = np.stack([camera.eye_world for camera in cameras])[:, None]
    ray = points[:, None] - eyes
    centres = points[:, None] - 0.3 * ray / np.linalg.norm(ray, axis=-1, keepdims=True)
    balls = np.repeat(centres.reshape(len(points), -1, 1, 3), 2, axis=2)
    return Surroundings(
        no_surroundings(1).still,
        no_surroundings(len(balls)).moving,
        balls,
        np.full(balls.shape[1], radius_m),
    )


def film(config, n_images, cameras=FRONT, hidden=(), batch=32):
    """Errors in shares of the window's side, confidences: (T, B, C, J, 2), (T, B, C, J)."""
    state, rngs = start(batch, config, cameras)
    true = truth(batch)
    px, _ = project(projections(cameras), true.joints_world[:, 0])
    columns = [JOINT[name] for name in hidden]
    between = before(cameras, true.joints_world[:, 0, columns], 0.02)
    side_px = lines_of_sight(true, between, cameras)[1][:, :, 0, SIDE, None, None]
    errors, confidences = [], []
    for _ in range(n_images):
        seen = emulate(state, rngs, true, between, cameras, config)
        errors.append((seen.px[:, :, 0] - px) / side_px)
        confidences.append(seen.confidence[:, :, 0])
    return np.array(errors), np.array(confidences)


def test_without_errors_keypoints_are_the_projected_truth():
    state, rngs = start(2, EXACT)
    true = truth(2)
    px, _ = project(projections(CAMERAS), true.joints_world)
    seen = emulate(state, rngs, true, no_surroundings(2), CAMERAS, EXACT)
    np.testing.assert_allclose(seen.px, px, atol=1e-9)


def test_hidden_arms_err_more_and_say_so():
    wrists = ("left_wrist", "right_wrist")
    columns = [JOINT[name] for name in wrists]
    free, sure = film(STEADY, 2, batch=300)
    hidden, unsure = film(STEADY, 2, hidden=wrists, batch=300)
    size, more = (np.median(np.linalg.norm(e[..., columns, :], axis=-1)) for e in (free, hidden))
    assert more > 2 * size
    assert np.median(unsure[..., columns]) < 0.5 < np.median(sure[..., columns])


def test_hidden_hips_err_more_and_say_nothing():
    hips = ("left_hip", "right_hip")
    columns = [JOINT[name] for name in hips]
    free, _ = film(STEADY, 2, batch=300)
    hidden, confidence = film(STEADY, 2, hidden=hips, batch=300)
    size, more = (np.median(np.linalg.norm(e[..., columns, :], axis=-1)) for e in (free, hidden))
    assert more > 1.1 * size
    assert np.median(confidence[..., columns]) > 0.95


def calibrated(tmp_path, **changes):
    """A config whose file is the package's with some tables changed."""
    path = tmp_path / "changed.json"
    write_calibration(path, dataclasses.replace(read_calibration(), **changes), {})
    return EmulatorConfig(calibration=str(path), swap_share=0, miss_share=0)


def plain(**changes):
    """Tables of errors of one size that all cameras have for themselves."""
    known = read_calibration()
    zeros = ("offset_m", "wander_m", "space_limb", "bias", "spread", "body", "limb", "tail")
    tables = {name: np.zeros_like(getattr(known, name)) for name in zeros}
    shares = np.zeros_like(known.shares)
    shares[:, 1] = 1.0
    return {**tables, "size": np.full_like(known.size, 0.01), "shares": shares, **changes}


def test_errors_are_as_large_as_the_file_says(tmp_path):
    errors, _ = film(calibrated(tmp_path, **plain()), 2, batch=300)
    assert np.std(errors) == pytest.approx(0.01, rel=0.05)
    assert abs(np.mean(errors)) < 0.001


def test_errors_of_who_stands_last_as_long_as_the_file_says(tmp_path):
    config = calibrated(tmp_path, **plain(slow_s=np.array(0.4)))
    errors, _ = film(config, 200, batch=16)
    lag = 10
    correlation = (errors[lag:] * errors[:-lag]).mean() / (errors**2).mean()
    assert correlation == pytest.approx(np.exp(-lag * DT / 0.4), abs=0.05)


def test_who_moves_gets_new_errors_sooner(tmp_path):
    config = calibrated(tmp_path, **plain(slow_s=np.array(5.0), slow_m=np.array(0.2)))
    state, rngs = start(16, config, FRONT)
    true, errors = truth(16), []
    true.velocity_world[...] = (1.0, 0.0, 0.0)  # and yet stays: only what the errors hear of it
    px, _ = project(projections(FRONT), true.joints_world)
    for _ in range(200):
        errors.append(emulate(state, rngs, true, no_surroundings(16), FRONT, config).px - px)
    errors, lag = np.array(errors), 5
    correlation = (errors[lag:] * errors[:-lag]).mean() / (errors**2).mean()
    assert correlation == pytest.approx(np.exp(-lag * DT * (1 / 5.0 + 1 / 0.2)), abs=0.05)


def test_offsets_in_space_are_the_same_in_every_camera(tmp_path):
    hips = np.zeros_like(read_calibration().offset_m)
    hips[:, KINDS.index("hip"), 2] = 0.03  # up
    config = calibrated(tmp_path, **plain(offset_m=hips, size=np.full(SHAPES["size"], 1e-6)))
    state, rngs = start(1, config)
    true = truth(1)
    raised = true.joints_world.copy()
    raised[..., [JOINT["left_hip"], JOINT["right_hip"]], 2] += 0.03
    px, _ = project(projections(CAMERAS), raised)
    seen = emulate(state, rngs, true, no_surroundings(1), CAMERAS, config)
    np.testing.assert_allclose(seen.px, px, atol=0.05)


def test_what_cameras_share_goes_along_limbs(tmp_path):
    known = read_calibration()
    limb = np.zeros_like(known.space_limb)
    limb[KINDS.index("knee")] = 0.8
    still = {"wander_m": np.full_like(known.wander_m, 0.02), "size": np.full(SHAPES["size"], 1e-9)}
    errors, _ = film(calibrated(tmp_path, **plain(**still, space_limb=limb)), 2, batch=600)
    knee, hip, ankle = (errors[..., JOINT[f"left_{name}"], :] for name in ("knee", "hip", "ankle"))
    together, apart = ((knee * each).mean() / (knee**2).mean() for each in (hip, ankle))
    assert together == pytest.approx(0.8, abs=0.1)
    assert abs(apart) < 0.1


def test_what_cameras_share_can_go_far_now_and_then(tmp_path):
    """A vector n of normal variables is lengthened by 1 + tail n.n / 3."""
    wander = np.full_like(read_calibration().wander_m, 0.01)
    still = {"wander_m": wander, "size": np.full(SHAPES["size"], 1e-9), "slow_s": np.array(1e-3)}
    tails = [np.full(SHAPES["tail"], tail) for tail in (0.0, 0.5)]
    plain_tail, long_tail = (
        film(calibrated(tmp_path, **plain(**still, tail=tail)), 2, batch=300)[0] for tail in tails
    )
    usual, farther = (np.linalg.norm(each, axis=-1).ravel() for each in (plain_tail, long_tail))
    n2 = np.random.default_rng(0).chisquare(3, 100_000)
    expected = np.sqrt((n2 * (1 + 0.5 * n2 / 3) ** 2).mean() / n2.mean())
    ratio = np.sqrt((farther**2).mean() / (usual**2).mean())
    assert ratio == pytest.approx(expected, rel=0.08)


def test_who_walks_errs_as_the_file_says_of_who_walks(tmp_path):
    size = np.full(SHAPES["size"], 0.01)
    size[1] = 0.03
    config = calibrated(tmp_path, **plain(size=size))
    spread = []
    for speed_m_s in (0.1, 0.5, 1.2):
        state, rngs = start(200, config, FRONT)
        true = truth(200)
        true.velocity_world[...] = (speed_m_s, 0.0, 0.0)
        px, _ = project(projections(FRONT), true.joints_world)
        errors = emulate(state, rngs, true, no_surroundings(200), FRONT, config).px - px
        spread.append(np.std(errors))
    np.testing.assert_allclose(np.array(spread) / spread[0], [1.0, math.sqrt(3.0), 3.0], rtol=0.1)


def test_confidences_have_the_quantiles_of_the_file():
    _, confidence = film(STEADY, 2, batch=500)
    median = read_calibration().confidence[0, 0, KINDS.index("elbow"), 2]
    elbows = [JOINT["left_elbow"], JOINT["right_elbow"]]
    seen = confidence[..., elbows]
    assert np.mean(seen < median) == pytest.approx(0.5, abs=0.06)


def test_what_it_reports_as_sigma_is_about_what_it_errs():
    state, rngs = start(64, STEADY, FRONT)
    true = truth(64)
    px, _ = project(projections(FRONT), true.joints_world)
    whitened = []
    for _ in range(50):
        seen = emulate(state, rngs, true, no_surroundings(64), FRONT, STEADY)
        whitened.append((seen.px - px) / seen.sigma_px[..., None])
    assert 0.3 < np.std(whitened) < 1.2  # with room for errors that last and that cameras share


def believed(joints, velocity=0.0, tracked=True):
    """What a tracker expects of bodies (B, W, J, 3)."""
    shape = joints.shape[:3]
    cov = np.tile(np.eye(3), (*shape, 1, 1))
    moves = np.full(joints.shape, velocity)
    return PoseEstimate(joints, cov, moves, np.zeros(shape), np.full(shape[:2], tracked))


def as_the_detector_says(seen, expected, cameras):
    """(C, J) sigma as `PoseDetector` makes it of confidences and windows round the expected."""
    joints, velocity = expected.mean_world[0, 0], expected.velocity_world[0, 0]
    px, depth_m = project(projections(cameras), joints[None])
    windows = map(window_from_joints, px[0], depth_m[0], cameras)
    posture = posture_of(joints, velocity)
    sides = [STATURE_OF_SIDE * window.side_px for window in windows]
    return [
        sigma_px(k, side, posture) for k, side in zip(seen.confidence[0, :, 0], sides, strict=True)
    ]


@pytest.mark.parametrize("bent", [False, True])
def test_sigma_is_what_the_detector_says_of_whom_the_tracker_expects(bent):
    """Whatever is true: somebody larger is expected 20 cm away, walking, or with raised hands."""
    joints = truth().joints_world
    joints[..., :2] += 0.2 - 0.1 * joints[..., :2]
    joints[..., 5:7, 2] += 0.6 * bent
    expected = believed(joints, velocity=0.0 if bent else 0.5)
    state, rngs = start(1, STEADY)
    seen = emulate(state, rngs, truth(), no_surroundings(1), CAMERAS, STEADY, expected)
    told = as_the_detector_says(seen, expected, CAMERAS)
    np.testing.assert_allclose(seen.sigma_px[0, :, 0], told, rtol=1e-6)


def test_whose_track_it_is_decides_and_not_its_number():
    joints = truth(n_workers=2).joints_world
    joints[0, 1, 5:7, 2] += 0.6
    told = []
    for order in ([0, 1], [1, 0]):
        state, rngs = start(1, STEADY, n_workers=2)
        expected = believed(joints[:, order])
        seen = emulate(
            state, rngs, truth(n_workers=2), no_surroundings(1), CAMERAS, STEADY, expected
        )
        told.append(seen.sigma_px)
    np.testing.assert_array_equal(told[0], told[1])


def test_who_is_not_followed_is_told_of_as_a_search_does():
    """As of somebody who stands, in the window round them; a track elsewhere changes nothing."""
    true, told = truth(), []
    true.joints_world[..., 5:7, 2] += 0.6
    for expected in (
        None,
        believed(truth().joints_world, 1.0, False),
        believed(truth().joints_world + 1.0),
    ):
        state, rngs = start(1, EXACT)
        seen = emulate(state, rngs, true, no_surroundings(1), CAMERAS, EXACT, expected)
        told.append(seen.sigma_px)
    np.testing.assert_array_equal(told[0], told[1])
    np.testing.assert_array_equal(told[0], told[2])
    side_px = lines_of_sight(true, no_surroundings(1), CAMERAS)[1][0, :, 0, SIDE]
    for c, side in enumerate(side_px):
        known = sigma_px(seen.confidence[0, c, 0], STATURE_OF_SIDE * side)
        np.testing.assert_allclose(told[0][0, c, 0], known)


def test_a_blocked_camera_is_nan_without_confidence_and_with_infinite_sigma():
    state, rngs = start(1, STEADY)
    around = CAMERAS[2].eye_world + np.zeros((1, 1, 2, 3))
    lid = Surroundings(
        no_surroundings(1).still, no_surroundings(len(around)).moving, around, np.array([0.1])
    )
    seen = emulate(state, rngs, truth(), lid, CAMERAS, STEADY)
    assert np.isnan(seen.px[0, 2]).all()
    assert np.all(seen.confidence[0, 2] == 0)
    assert np.isinf(seen.sigma_px[0, 2]).all()
    assert np.isfinite(seen.px[0, [0, 1, 3]]).all()


def test_a_worker_behind_a_camera_is_not_seen():
    state, rngs = start(1, STEADY, FRONT)
    seen = emulate(state, rngs, truth(at=(8.0, 0, 0)), no_surroundings(1), FRONT, STEADY)
    assert np.isnan(seen.px).all()


def test_joints_outside_the_image_are_guesses_with_a_large_sigma():
    state, rngs = start(1, EXACT, FRONT)
    seen = emulate(state, rngs, truth(at=(3.1, 0, 0)), no_surroundings(1), FRONT, EXACT)
    v = seen.px[0, 0, 0, :, 1]
    outside = (v < 0) | (v >= 1080)
    assert outside.any()
    assert not outside.all()
    assert np.all(seen.confidence[0, 0, 0, outside] <= CONFIG.outside_confidence)
    assert seen.sigma_px[0, 0, 0, outside].min() > 2 * seen.sigma_px[0, 0, 0, ~outside].min()


def test_a_worker_in_front_hides_the_one_behind():
    true = truth(n_workers=2)
    true.joints_world[0, 1] += [-1.0, -1.0, 0.0]
    true.capsules_world[0, 1] += [-1.0, -1.0, 0.0]  # now behind the first, seen from x
    sight, _ = lines_of_sight(true, no_surroundings(1), FRONT)
    hip = JOINT["left_hip"]
    assert sight[0, 0, 0, hip] == SEEN
    assert sight[0, 0, 1, hip] == HIDDEN


def test_a_swap_exchanges_left_and_right():
    config = dataclasses.replace(EXACT, swap_share=1.0)
    state, rngs = start(1, config)
    true = truth()
    px, _ = project(projections(CAMERAS), true.joints_world)
    seen = emulate(state, rngs, true, no_surroundings(1), CAMERAS, config)
    np.testing.assert_allclose(seen.px, px[..., MIRROR, :], atol=1e-9)


def test_swaps_and_misses_take_their_share_of_the_time_and_last(tmp_path):
    half = {"swap_s": np.full(2, 0.5), "miss_s": np.array(0.5)}
    known = calibrated(tmp_path, **half, swap_share=np.zeros(SHAPES["swap_share"]))
    config = dataclasses.replace(EXACT, calibration=known.calibration, swap_share=0.1)
    config = dataclasses.replace(config, miss_share=0.2)
    state, rngs = start(64, config)
    true, swapped, missed = truth(64), [], []
    px, _ = project(projections(CAMERAS), true.joints_world)
    for _ in range(300):
        seen = emulate(state, rngs, true, no_surroundings(64), CAMERAS, config).px
        swapped.append((np.abs(seen - px[..., MIRROR, :]) < 1e-6).all((-1, -2)))
        missed.append(np.isnan(seen[..., 0]).all(-1))
    looked = ~np.array(missed)
    assert np.array(swapped)[looked].mean() == pytest.approx(0.1, abs=0.02)
    assert np.mean(missed) == pytest.approx(0.2, abs=0.03)
    lag = 5
    both = (np.array(missed)[lag:] & np.array(missed)[:-lag]).mean() / np.mean(missed)
    again = multivariate_normal([0, 0], [[1, r := np.exp(-lag * DT / 0.5)], [r, 1]])
    assert both == pytest.approx(again.cdf([norm.ppf(0.2)] * 2) / 0.2, abs=0.05)


@pytest.mark.parametrize("batch", [1, 3, 7])
def test_an_environment_sees_the_same_in_any_company(batch):
    """Environment 0 of a batch is the batch of one, bit for bit."""
    alone, crowd = start(1, CONFIG), start(batch, CONFIG)
    for _ in range(20):
        one = emulate(*alone, truth(1), no_surroundings(1), CAMERAS, CONFIG)
        many = emulate(*crowd, truth(batch), no_surroundings(batch), CAMERAS, CONFIG)
        np.testing.assert_array_equal(one.px[0], many.px[0])
        np.testing.assert_array_equal(one.sigma_px[0], many.sigma_px[0])


def test_a_copied_state_replays_the_same_errors():
    state, rngs = start(2, CONFIG)
    emulate(state, rngs, truth(2), no_surroundings(2), CAMERAS, CONFIG)
    saved = copy.deepcopy((state, rngs))
    first = emulate(state, rngs, truth(2), no_surroundings(2), CAMERAS, CONFIG)
    again = emulate(*saved, truth(2), no_surroundings(2), CAMERAS, CONFIG)
    np.testing.assert_array_equal(first.px, again.px)


def test_a_reset_touches_only_its_own_environments():
    state, rngs = start(3, CONFIG)
    before = copy.deepcopy(state)
    reset(state, np.array([1]), rngs)
    np.testing.assert_array_equal(state.errors["slow"][[0, 2]], before.errors["slow"][[0, 2]])
    assert not np.array_equal(state.errors["slow"][1], before.errors["slow"][1])


def test_a_room_without_workers_has_no_keypoints():
    state, rngs = start(2, CONFIG, n_workers=0)
    seen = emulate(state, rngs, truth(2, 0), no_surroundings(2), CAMERAS, CONFIG)
    assert seen.px.shape == (2, 4, 0, N_JOINTS, 2)


def test_settings_and_shapes_that_cannot_work_are_explained():
    with pytest.raises(ConfigError, match="swap_share must be in"):
        EmulatorConfig(swap_share=1.5)
    with pytest.raises(ConfigError, match="error_scale must not be negative"):
        EmulatorConfig(error_scale=-1.0)
    state, rngs = start(1, CONFIG)
    with pytest.raises(ConfigError, match="capsules_world must have shape"):
        emulate(state, rngs, truth(), no_surroundings(2), CAMERAS, CONFIG)
