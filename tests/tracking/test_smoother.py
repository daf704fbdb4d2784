"""A clip in view of its whole: exact where all is linear, better than the filter where not."""

import numpy as np
import pytest
from simulated import DT, HARD, LAB, Damage, detections, keypoints, track, walk

from hrc_env.core.errors import ConfigError
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.smoother import (
    Moments,
    expand_covariance,
    make_linear_motion,
    rts_step,
    smooth,
)
from hrc_env.tracking.tree.gaussian import ORDER, PARENT

INSIDE_95 = 7.815


def walks(seeds, n_frames, damage):
    """Joints (T, B, J, 3) and pixels (T, B, C, J, 2) of several walks."""
    joints = np.stack([walk(s, n_frames) for s in seeds], 1)
    return joints, np.stack([detections(joints[:, k], damage, s) for k, s in enumerate(seeds)], 1)


def judged(mean, cov, joints):
    """RMSE [m], coverage of the 95 % region, reported deviation over RMSE."""
    error = mean - joints
    rmse = np.sqrt((error**2).sum(-1).mean())
    nees = np.einsum("...i,...ij,...j->...", error, np.linalg.inv(cov), error)
    return rmse, (nees < INSIDE_95).mean(), np.sqrt(np.trace(cov, axis1=-2, axis2=-1).mean()) / rmse


def both(joints, px, window):
    """What filter and smoother make of the same frames."""
    estimates = track(make_estimator("kalman", LAB, DT), px)
    smoothed = smooth(LAB, [keypoints(frame) for frame in px], DT)
    mean, cov = (np.stack([getattr(e, n) for e in estimates]) for n in ("mean_world", "cov_world"))
    cut = slice(*window)
    filtered = judged(mean[cut, :, 0], cov[cut, :, 0], joints[cut])
    return filtered, judged(
        smoothed.mean_world[cut, :, 0], smoothed.cov_world[cut, :, 0], joints[cut]
    )


def test_steps_back_are_the_conditional_gaussian_of_the_whole():
    """Against one big Gaussian over all times, for a small linear system."""
    rng, d, n_steps = np.random.default_rng(0), 4, 6
    F = np.eye(d) + 0.2 * rng.standard_normal((d, d))
    H, R, Q = rng.standard_normal((2, d)), 0.3 * np.eye(2), 0.1 * np.eye(d)
    z = rng.standard_normal((n_steps, 2))
    mean, cov, filtered, predicted = np.zeros(d), np.eye(d), [], []
    for t in range(n_steps):
        if t > 0:
            mean, cov = F @ mean, F @ cov @ F.T + Q
        predicted.append(mean)
        gain = cov @ H.T @ np.linalg.inv(H @ cov @ H.T + R)
        mean, cov = mean + gain @ (z[t] - H @ mean), cov - gain @ H @ cov
        filtered.append(Moments(mean[None], cov[None]))
    smoothed = filtered[-1]
    for t in range(n_steps - 2, -1, -1):
        smoothed = rts_step(filtered[t], predicted[t + 1][None], smoothed, F, Q)
    information, right = np.zeros((n_steps * d,) * 2), np.zeros(n_steps * d)
    for t in range(n_steps):
        at = slice(t * d, (t + 1) * d)
        information[at, at] += H.T @ np.linalg.inv(R) @ H + (np.eye(d) if t == 0 else 0)
        right[at] += H.T @ np.linalg.inv(R) @ z[t]
        if t > 0:
            pair = slice((t - 1) * d, (t + 1) * d)
            step = np.hstack([-F, np.eye(d)])
            information[pair, pair] += step.T @ np.linalg.inv(Q) @ step
    whole = np.linalg.inv(information)
    np.testing.assert_allclose(smoothed[0][0], (whole @ right)[:d], atol=1e-9)
    np.testing.assert_allclose(smoothed[1][0], whole[:d, :d], atol=1e-9)


def test_the_dense_covariance_has_the_trees_marginals_and_edges_and_nothing_else():
    rng = np.random.default_rng(1)
    cov, slope = np.zeros((1, 15, 6, 6)), 0.5 * rng.standard_normal((1, 15, 6, 6))
    for j in ORDER:
        a = rng.standard_normal((6, 6))
        own = a @ a.T + np.eye(6)
        q = PARENT[j]
        cov[0, j] = own if q < 0 else own + slope[0, j] @ cov[0, q] @ slope[0, j].T
    whole = expand_covariance(cov, slope)[0]
    assert np.linalg.eigvalsh(whole).min() > 0
    inverse = np.linalg.inv(whole).reshape(15, 6, 15, 6)
    for j in range(15):
        np.testing.assert_allclose(whole[6 * j : 6 * j + 6, 6 * j : 6 * j + 6], cov[0, j])
        for k in range(15):  # no edge: independent given all others
            if j != k and PARENT[j] != k and PARENT[k] != j:
                np.testing.assert_allclose(inverse[j, :, k], 0, atol=1e-9)


def test_its_motion_is_the_filters():
    e = make_estimator("kalman", LAB, DT)
    _, px = walks([100], 20, Damage())
    state = e.init(1, 1)
    for frame in px:
        e.predict(state, DT, [])
        e.update(state, keypoints(frame), [])
    F, Q = make_linear_motion(DT, ParticleConfig())
    before = expand_covariance(state.trees["cov"][0, 0], state.trees["slope"][0, 0])[0]
    e.predict(state, DT, [])
    after = F @ before @ F.T + Q
    for j in range(15):
        own = after[6 * j : 6 * j + 6, 6 * j : 6 * j + 6]
        np.testing.assert_allclose(own, state.trees["cov"][0, 0, 0, j], atol=1e-12)


@pytest.mark.parametrize("damage", [Damage(), Damage(occlusions=True), HARD])
def test_it_is_nearer_than_the_filter_and_honest(damage):
    joints, px = walks(range(100, 103), 120, damage)
    filtered, smoothed = both(joints, px, (25, 115))
    assert smoothed[0] < 0.9 * filtered[0]
    assert smoothed[1] > 0.95
    assert 0.8 < smoothed[2] < 1.8


def test_four_seconds_of_one_camera_are_seen_from_both_ends():
    seeds = range(100, 106)
    joints, px = walks(seeds, 160, Damage())
    for k, s in enumerate(seeds):
        px[25:125, k, [c for c in range(4) if c != s % 4]] = np.nan
    filtered, smoothed = both(joints, px, (25, 125))
    assert smoothed[0] < 0.8 * filtered[0]
    assert smoothed[1] > 0.93
    assert 0.8 < smoothed[2] < 1.5


def test_velocities_are_those_of_the_way_forward():
    joints, px = walks([101], 60, Damage())
    truth = np.gradient(joints[:, 0], DT, axis=0)
    smoothed = smooth(LAB, [keypoints(frame) for frame in px], DT)
    torso = [1, 2, 7, 8]
    error = (smoothed.velocity_world[5:-5, 0, 0, torso] - truth[5:-5][:, torso]).mean(1)
    assert np.sqrt((error**2).sum(-1).mean()) < 0.15


def test_a_worker_is_known_before_they_were_found():
    joints, px = walks([100], 40, Damage())
    px[:6, :, 1:] = np.nan  # one camera finds nobody; the clip read backwards already knows them
    smoothed = smooth(LAB, [keypoints(frame) for frame in px], DT)
    assert smoothed.tracked.all()
    error = np.linalg.norm(smoothed.mean_world[:, 0, 0] - joints[:, 0], axis=-1)
    assert error[:6].max() < 0.5
    assert np.median(error[6:]) < 0.02


def test_nobody_and_nothing_are_data():
    nothing = [keypoints(np.full((2, 4, 15, 2), np.nan))] * 3
    smoothed = smooth(LAB, nothing, DT)
    assert smoothed.mean_world.shape == (3, 2, 1, 15, 3)
    assert not smoothed.tracked.any()
    assert np.linalg.eigvalsh(smoothed.cov_world).min() > 0
    with pytest.raises(ConfigError, match="a clip must have frames"):
        smooth(LAB, [], DT)


def test_asked_for_as_an_estimator_it_says_that_it_needs_the_future():
    with pytest.raises(ConfigError, match=r"is an offline method.*tracking\.smoother\.smooth"):
        make_estimator("smoother", LAB, DT)
