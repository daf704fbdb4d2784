"""One Gaussian on the kinematic tree: as accurate as the best, and honest with one camera."""

import numpy as np
import pytest
from simulated import DT, HARD, LAB, Damage, detections, generators, keypoints, track, walk

from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.tree.gaussian import ORDER, PARENT

INSIDE_95 = 7.815
"""95 % of chi-squared with 3 degrees of freedom."""


def rmse(error):
    return np.sqrt((error**2).sum(-1).mean())


def judged(estimates, joints):
    """RMSE [m], coverage of the 95 % region, and reported deviation over RMSE."""
    error = np.stack([e.mean_world[:, 0] for e in estimates]) - joints
    cov = np.stack([e.cov_world[:, 0] for e in estimates])
    nees = np.einsum("...i,...ij,...j->...", error, np.linalg.inv(cov), error)
    reported = np.sqrt(np.trace(cov, axis1=-2, axis2=-1).mean())
    return rmse(error), (nees < INSIDE_95).mean(), reported / rmse(error)


def walks(seeds, n_frames, damage):
    """Joints (T, B, J, 3) and pixels (T, B, C, J, 2) of several walks."""
    joints = np.stack([walk(s, n_frames) for s in seeds], 1)
    return joints, np.stack([detections(joints[:, k], damage, s) for k, s in enumerate(seeds)], 1)


def one_camera(seeds, seconds=4.0, after_s=1.4):
    """As `walks`: all cameras for 1 s, then one for `seconds`, then all again."""
    n_alone = round(seconds / DT)
    joints, px = walks(seeds, 25 + n_alone + round(after_s / DT), Damage())
    for k, s in enumerate(seeds):
        blind = [c for c in range(4) if c != s % 4]
        px[25 : 25 + n_alone, k, blind] = np.nan
    return joints, px


@pytest.mark.parametrize("damage", [Damage(), Damage(occlusions=True), HARD])
def test_four_cameras_are_accurate_and_honest(damage):
    joints, px = walks(range(100, 124), 200, damage)
    error_m, coverage, ratio = judged(
        track(make_estimator("kalman", LAB, DT), px)[25:], joints[25:]
    )
    assert error_m < (0.035 if damage.occlusions else 0.016)
    assert 0.93 < coverage < 0.985
    assert 0.7 < ratio < 1.5


def test_one_camera_for_the_whole_body_is_honest_and_its_return_forgives_everything():
    joints, px = one_camera(range(100, 108))
    estimates = track(make_estimator("kalman", LAB, DT), px)
    for first, last in [(25, 75), (25, 125)]:  # the first 2 s, and all 4
        error, coverage, ratio = judged(estimates[first:last], joints[first:last])
        assert error < 0.22
        assert coverage > 0.90
        assert 0.65 < ratio < 1.5  # now and then a body is mirrored, which it cannot hold
    clean, _, _ = judged(estimates[12:25], joints[12:25])
    back, coverage, _ = judged(estimates[150:], joints[150:])  # 1 s after the return
    assert back < 1.2 * clean
    assert coverage > 0.93


def test_without_the_mean_correction_the_body_runs_to_the_lens():
    joints, px = one_camera(range(100, 104), 4.0, 0.0)
    eyes = -np.linalg.solve(LAB[:, :, :3], LAB[:, :, 3:])[..., 0]
    distance = np.linalg.norm(joints - eyes[:, None], axis=-1)

    def judge(share):
        """How much too near to its camera the body is on average, and its error [m]."""
        config = ParticleConfig(mean_correction=share)
        estimates = track(make_estimator("kalman", LAB, DT, config), px)
        mean = np.stack([e.mean_world[:, 0] for e in estimates])
        nearer = distance - np.linalg.norm(mean - eyes[:, None], axis=-1)
        return nearer[25:].mean(), np.sqrt(((mean - joints)[25:] ** 2).sum(-1).mean())

    (too_near, plain), (left, corrected) = judge(0.0), judge(0.8)
    assert too_near > 0.12
    assert abs(left) < 0.06
    assert corrected < 0.75 * plain


def test_joints_share_the_depth_that_one_camera_leaves_open():
    _, px = one_camera([100], 2.0, 0.0)
    e, rngs = make_estimator("kalman", LAB, DT), generators(1)
    state = e.init(1, 1)
    for frame in px:
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
    cov, slope, ray = state.trees["cov"][0, 0, 0], state.trees["slope"][0, 0, 0], LAB[0, 2, :3]
    q, j = 1, 7  # left shoulder, left hip
    own = [ray @ cov[k, :3, :3] @ ray for k in (q, j)]
    shared = ray @ (slope[j] @ cov[q])[:3, :3] @ ray
    assert shared / np.sqrt(own[0] * own[1]) > 0.9


def test_what_a_joint_does_not_share_with_its_parent_stays_positive_definite():
    _, px = walks([3], 150, HARD)
    e, rngs = make_estimator("kalman", LAB, DT), generators(1)
    state = e.init(1, 1)
    for frame in px:
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
        cov, slope = state.trees["cov"][0, 0, 0], state.trees["slope"][0, 0, 0]
        for j in ORDER[1:]:
            rest = cov[j] - slope[j] @ cov[PARENT[j]] @ slope[j].T
            assert np.linalg.eigvalsh(rest).min() > 0


def test_a_body_that_nobody_sees_spreads_and_is_found_where_it_went():
    joints, px = walks(range(100, 108), 75, Damage())
    px[40:52] = np.nan
    estimates = track(make_estimator("kalman", LAB, DT), px)
    spread = [np.trace(e.cov_world[:, 0], axis1=-2, axis2=-1).mean() for e in estimates[39:52]]
    assert (np.diff(spread) > 0).all()
    _, coverage, _ = judged(estimates[40:52], joints[40:52])
    assert coverage > 0.90
    error, _, _ = judged(estimates[-10:], joints[-10:])
    assert error < 0.015


def test_a_worker_who_is_left_to_one_camera_is_reported_as_less_certain_than_is_kept():
    _, px = walks([100], 60, Damage())
    px[30:45, :, 1:] = np.nan  # one camera for the whole body
    px[:, :, 1:, 5] = (
        np.nan
    )  # and for one wrist all the time, which the tree knows what to think of
    e, rngs = make_estimator("kalman", LAB, DT), generators(1)
    state, ratios = e.init(1, 1), []
    for frame in px:
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
        kept = np.trace(state.trees["cov"][0, 0, 0, :, :3, :3], axis1=-2, axis2=-1)
        ratios.append(np.trace(e.estimate(state).cov_world[0, 0], axis1=-2, axis2=-1) / kept)
    assert ratios[29][5] == pytest.approx(1.0)
    assert ratios[37][5] == pytest.approx(1.0)  # cameras may be out of step: not at once
    assert ratios[44][5] == pytest.approx(1.21)
    assert ratios[45][5] == pytest.approx(1.0)


def test_two_predictions_without_frames_between_are_possible():
    _, px = walks([100], 20, Damage())
    e, rngs = make_estimator("kalman", LAB, DT), generators(1)
    state = e.init(1, 1)
    for frame in px:
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
    e.predict(state, DT, rngs)
    near = np.trace(e.estimate(state).cov_world[0, 0], axis1=-2, axis2=-1)
    e.predict(state, DT, rngs)
    assert (np.trace(e.estimate(state).cov_world[0, 0], axis1=-2, axis2=-1) > near).all()


def test_a_body_that_is_believed_elsewhere_altogether_is_acquired_anew():
    joints, px = walks([100], 60, Damage())
    e, rngs = make_estimator("kalman", LAB, DT), generators(1)
    state = e.init(1, 1)
    for t, frame in enumerate(px):
        if t == 40:
            state.trees["body"][0, 0, 0, :, :3] += [1.5, -1.5, 0.0]
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
    assert rmse(state.trees["body"][0, 0, 0, :, :3] - joints[-1, 0]) < 0.03
