"""Hypotheses with a Gaussian each: one while the views agree, the right one when they do not."""

import numpy as np
import pytest
from simulated import DT, HARD, LAB, Damage, detections, generators, keypoints, track, walk

from hrc_env.core.errors import ConfigError
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.tree.branching import (
    find_lone_camera,
    find_other_turn,
    has_same_heading,
    measure_depth_std,
    reflect,
    turn_body,
)
from hrc_env.tracking.tree.evidence import (
    exchange_slots,
    measure_change,
    merge_close,
    normalise_weights,
    score_pose,
)
from hrc_env.tracking.tree.gaussian import ORDER, PARENT
from hrc_env.tracking.tree.state import WORK, WorkerHypotheses

EYES = -np.linalg.solve(LAB[:, :, :3], LAB[:, :, 3:])[..., 0]


def one_camera(seeds, seconds=4.0, after_s=0.4):
    """Joints (T, B, J, 3) and pixels: all cameras for 1 s, one for `seconds`, all again."""
    n_alone = round(seconds / DT)
    n_frames = 25 + n_alone + round(after_s / DT)
    joints = np.stack([walk(s, n_frames) for s in seeds], 1)
    px = np.stack([detections(joints[:, k], Damage(), s) for k, s in enumerate(seeds)], 1)
    for k, s in enumerate(seeds):
        px[25 : 25 + n_alone, k, [c for c in range(4) if c != s % 4]] = np.nan
    return joints, px


def left(joints):
    """From right to left across the torso, on the ground."""
    return joints[..., 1, :2] - joints[..., 2, :2] + joints[..., 7, :2] - joints[..., 8, :2]


def followed(px, config=None):
    """The estimator, its last state, and how many hypotheses it had after each frame."""
    e, rngs = make_estimator("particle", LAB, DT, config), generators(px.shape[1])
    state, n_alive = e.init(px.shape[1], 1), []
    for frame in px:
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
        n_alive.append(state.n_alive[:, 0].copy())
    return e, state, np.array(n_alive)


def slots(state):
    """The first worker's hypotheses alone."""
    return WorkerHypotheses(
        *(array[0, 0] for array in state[:3]),
        state.n_alive[0],
        state.since_search_s[0],
        state.pace[0],
    )


def standing(heading_rad=0.0, place=(0.5, 0.2, 0.0)):
    """(J, 6) a body at rest that walks nowhere."""
    joints = walk(0, 1)[0]
    across = left(joints)
    now = np.arctan2(-across[0], across[1])
    c, s = np.cos(heading_rad - now), np.sin(heading_rad - now)
    joints = (joints - joints[[1, 2, 7, 8]].mean(0)) @ np.array(
        [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    ).T
    body = np.zeros((15, 6))
    body[:, :3] = joints + np.array([*place[:2], 1.2])
    return body


def test_with_one_hypothesis_it_is_the_kalman_filter():
    px = np.stack([detections(walk(s, 60), HARD, s) for s in (3, 4)], 1)
    px[30:, :, 1:] = np.nan
    config = ParticleConfig(n_hypotheses=1)
    ours, theirs = (track(make_estimator(n, LAB, DT, config), px) for n in ("particle", "kalman"))
    for a, b in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(a.mean_world, b.mean_world, rtol=0, atol=1e-12)
        np.testing.assert_allclose(a.cov_world, b.cov_world, rtol=0, atol=1e-12)


def test_while_all_views_agree_there_is_one_hypothesis():
    px = detections(walk(5, 60), Damage(), 5)[:, None]
    _, _, n_alive = followed(px)
    assert (n_alive == 1).all()


def test_nobody_who_looks_smaller_to_one_camera_goes_through_the_floor():
    px = detections(walk(5, 70), Damage(), 5)[:, None]
    px[25:, :, 1:] = np.nan
    share = np.linspace(1.0, 0.55, 45)[:, None, None]
    middle = px[25:, 0, 0][:, [7, 8]].mean(1, keepdims=True)
    px[25:, 0, 0] = middle + share * (px[25:, 0, 0] - middle)
    lowest = {}
    for std in (0.05, np.inf):
        e = make_estimator("particle", LAB, DT, ParticleConfig(floor_std_m=std))
        lowest[std] = min(each.mean_world[0, 0, :, 2].min() for each in track(e, px)[25:])
    assert lowest[np.inf] < -0.3
    assert lowest[0.05] > -0.1


def test_cameras_that_take_turns_leave_no_second_hypothesis():
    px = detections(walk(5, 100), Damage(), 5)[:, None]
    for t in range(40, 100):  # one view in every update, another one each time
        px[t, :, [c for c in range(4) if c != t % 4]] = np.nan
    _, _, n_alive = followed(px)
    assert (n_alive == 1).mean() > 0.97


def test_predictions_without_frames_stay_where_those_of_one_hypothesis_are():
    joints = np.stack([walk(s, 100) for s in range(4)], 1)
    px = np.stack([detections(joints[:, k], Damage(), k) for k in range(4)], 1)
    for t in range(40, 100):  # lone cameras and gaps of 0.12 s
        px[t, :, [c for c in range(4) if t % 6 in (1, 2, 3) or c != t % 4]] = np.nan
    error, most = {}, 1
    for name in ("kalman", "particle"):
        e, rngs = make_estimator(name, LAB, DT), generators(4)
        state, mean = e.init(4, 1), []
        for frame in px:
            e.predict(state, DT, rngs)
            if np.isfinite(frame).any():
                e.update(state, keypoints(frame), rngs)
            if name == "particle":
                most = max(most, state.n_alive.max())
                whole = np.exp(state.trees["log_weight"][0, 0, : state.n_alive[0, 0]]).sum()
                assert whole == pytest.approx(1.0)
            mean.append(e.estimate(state).mean_world[:, 0])
        error[name] = np.sqrt(((np.stack(mean) - joints)[40:] ** 2).sum(-1).mean())
    assert most > 1  # so that the frames can tell
    assert error["particle"] < 1.1 * error["kalman"]


def test_a_worker_who_is_lost_has_one_hypothesis_which_relaxes_to_the_prior():
    _, px = one_camera([100], 3.0, 0.0)
    e, state, n_alive = followed(px)
    assert n_alive[-20:].max() > 1
    for _ in range(30):
        e.predict(state, DT, generators(1))
    assert not e.estimate(state).tracked.any()
    assert (state.n_alive == 1).all()
    assert state.trees["log_weight"][0, 0, 0] == 0.0


def test_one_camera_does_not_turn_the_body_round():
    joints, px = one_camera(range(100, 116))
    wrong = {}
    for name in ("kalman", "particle"):
        mean = np.stack([e.mean_world[:, 0] for e in track(make_estimator(name, LAB, DT), px)])
        wrong[name] = ((left(mean) * left(joints)).sum(-1) < 0)[25:125].mean()
    assert wrong["kalman"] > 0.05  # so that the sequences can tell
    assert wrong["particle"] < 0.3 * wrong["kalman"]


def test_one_camera_is_honest_and_its_return_leaves_one_hypothesis():
    joints, px = one_camera(range(100, 116))
    estimates = track(make_estimator("particle", LAB, DT), px)
    error = np.stack([e.mean_world[:, 0] for e in estimates]) - joints
    cov = np.stack([e.cov_world[:, 0] for e in estimates])
    nees = np.einsum("...i,...ij,...j->...", error, np.linalg.inv(cov), error)[25:125]
    assert (nees < 7.815).mean() > 0.90
    reported = np.trace(cov[25:125], axis1=-2, axis2=-1).mean()
    assert 0.8 < np.sqrt(reported / (error[25:125] ** 2).sum(-1).mean()) < 1.3
    _, state, n_alive = followed(px)
    assert n_alive[25:125].max() > 1
    assert (state.n_alive == 1).all()
    assert np.sqrt((error[-1] ** 2).sum(-1).mean()) < 0.03


def test_results_do_not_depend_on_the_batch():
    _, px = one_camera(range(100, 103), 1.0)
    together = track(make_estimator("particle", LAB, DT), px)
    for b in range(3):
        alone = track(make_estimator("particle", LAB, DT), px[:, b : b + 1])
        for a, t in zip(alone, together, strict=True):
            np.testing.assert_array_equal(a.mean_world[0], t.mean_world[b])
            np.testing.assert_array_equal(a.cov_world[0], t.cov_world[b])


def test_the_mixtures_moments_are_those_of_its_parts():
    _, px = one_camera([101], 3.0, 0.0)
    config = ParticleConfig(one_view_inflation=1.0)
    e, rngs = make_estimator("particle", LAB, DT, config), generators(1)
    state, most = e.init(1, 1), 1
    for frame in px:
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
        n = state.n_alive[0, 0]
        most = max(most, n)
        share = np.exp(state.trees["log_weight"][0, 0, :n])
        assert share.sum() == pytest.approx(1.0)
        assert share[0] == share.max()
        points = state.trees["body"][0, 0, :n, :, :3]
        mean = np.einsum("h,hji->ji", share, points)
        apart = points - mean
        cov = np.einsum("h,hjik->jik", share, state.trees["cov"][0, 0, :n, :, :3, :3])
        cov += np.einsum("h,hji,hjk->jik", share, apart, apart)
        estimate = e.estimate(state)
        np.testing.assert_allclose(estimate.mean_world[0, 0], mean, atol=1e-9)
        big = np.trace(cov, axis1=1, axis2=2) > 0.01
        np.testing.assert_allclose(estimate.cov_world[0, 0][big], cov[big], atol=1e-9)
    assert most > 1


def test_the_other_body_has_its_shoulders_reflected_and_its_nose_in_front():
    body, eye = standing(0.4), EYES[1]
    cov, slope = np.tile(0.01 * np.eye(6), (15, 1, 1)), np.zeros((15, 6, 6))
    other = body.copy()
    turn_body(eye, find_other_turn(eye, body), other, cov, slope)
    assert not has_same_heading(body, other)
    middle = body[[1, 2, 7, 8], :2].mean(0)
    ray = (middle - EYES[1, :2]) / np.linalg.norm(middle - EYES[1, :2])
    expected = left(body) - 2 * (left(body) @ ray) * ray
    expected *= np.linalg.norm(left(other)) / np.linalg.norm(expected)
    np.testing.assert_allclose(left(other), expected, atol=0.02)
    assert score_pose(other) == pytest.approx(score_pose(body))
    again = other.copy()
    turn_body(eye, find_other_turn(eye, other), again, cov, slope)
    np.testing.assert_allclose(again, body, atol=1e-9)


def test_a_body_that_is_inside_out_is_unlikely():
    body = standing()
    inside_out = body.copy()
    inside_out[:, 0] = 2 * body[[1, 2, 7, 8], 0].mean() - body[:, 0]  # its front behind
    assert score_pose(body) - score_pose(inside_out) > 5.0


def test_a_reflected_limb_keeps_its_pixels_nearly_and_changes_its_depth():
    body, out = standing(0.7), np.empty((15, 3))
    assert reflect(1, EYES[0], body, out)
    np.testing.assert_array_equal(out[[0, 1, 2, 4]], body[[0, 1, 2, 4], :3])
    for j in (3, 5):
        a, b = body[j, :3] - EYES[0], out[j] - EYES[0]
        assert np.linalg.norm(np.cross(a, b)) < 1e-9  # the same ray


def test_a_part_is_ambiguous_only_where_one_camera_sees_it():
    ok = np.ones((15, 4), bool)
    assert find_lone_camera(0, ok) == find_lone_camera(1, ok) == -1
    ok[[3, 5], 1:] = False
    assert find_lone_camera(1, ok) == 0
    assert find_lone_camera(0, ok) == -1
    ok[:, [0, 1, 3]] = False
    assert find_lone_camera(0, ok) == 2
    assert find_lone_camera(0, np.zeros((15, 4), bool)) == -1


def test_a_parts_depth_is_open_as_far_as_its_best_known_joint_is():
    body, cov = standing(), np.tile(1e-4 * np.eye(6), (15, 1, 1))
    assert measure_depth_std(1, EYES[0], body, cov) == pytest.approx(0.01)
    for j, std in ((3, 0.2), (5, 0.3)):  # an arm, along the camera's rays only
        ray = (body[j, :3] - EYES[0]) / np.linalg.norm(body[j, :3] - EYES[0])
        cov[j, :3, :3] += (std**2 - 1e-4) * np.outer(ray, ray)
    assert measure_depth_std(1, EYES[0], body, cov) == pytest.approx(0.2)
    assert measure_depth_std(3, EYES[0], body, cov) == pytest.approx(0.3)  # its forearm
    assert measure_depth_std(0, EYES[0], body, cov) == pytest.approx(0.01)  # the whole body


def test_the_trees_determinant_and_square_are_those_of_the_whole_matrix():
    px = detections(walk(6, 30), HARD, 6)[:, None]
    _, state, _ = followed(px)
    tree = state.trees[0, 0, 0]
    cov, slope = tree["cov"], tree["slope"]
    whole = np.zeros((15, 15, 6, 6))
    for n, j in enumerate(ORDER):
        for k in ORDER[:n]:
            whole[j, k] = slope[j] @ whole[PARENT[j], k]
            whole[k, j] = whole[j, k].T
        whole[j, j] = cov[j]
    matrix = whole.transpose(0, 2, 1, 3).reshape(90, 90)
    change = np.random.default_rng(0).normal(0, 0.05, (15, 6))
    square, log_det = measure_change(tree, change.copy(), np.zeros(1, WORK).view(np.recarray)[0])
    assert log_det == pytest.approx(np.linalg.slogdet(matrix)[1], rel=1e-6)
    expected = change.ravel() @ np.linalg.solve(matrix, change.ravel())
    assert square == pytest.approx(expected, rel=1e-5)


def test_hypotheses_that_have_come_close_are_one_and_light_ones_are_dropped():
    px = detections(walk(7, 20), Damage(), 7)[:, None]
    _, state, _ = followed(px)
    own = slots(state)
    own.trees[1:3] = own.trees[:1]
    own.trees["body"][2, :, 0] += 1.0
    own.n_alive[0] = 3
    own.trees["log_weight"][:3] = np.log([0.3, 0.4, 0.3])
    merge_close(own, 4.0, np.zeros(1, WORK).view(np.recarray)[0])
    normalise_weights(own, np.log(1e-3))
    assert own.n_alive[0] == 2
    np.testing.assert_allclose(np.exp(own.trees["log_weight"][:2]), [0.7, 0.3])
    own.trees["log_weight"][1] = -20.0
    normalise_weights(own, np.log(1e-3))
    assert own.n_alive[0] == 1


def test_exchanging_slots_exchanges_every_array():
    px = detections(walk(7, 20), Damage(), 7)[:, None]
    _, state, _ = followed(px)
    rng = np.random.default_rng(0)
    for array in state[:3]:
        for field in array.dtype.names:
            array[field][:, :, :2] = rng.integers(0, 2, array[field][:, :, :2].shape)
    before = [array[0, 0, :2].copy() for array in state[:3]]
    exchange_slots(slots(state), 0, 1)
    for was, array in zip(before, state[:3], strict=True):
        np.testing.assert_array_equal(array[0, 0, :2], was[::-1])


@pytest.mark.parametrize(
    "change",
    [
        {"n_hypotheses": 0},
        {"mirrored_parts": ("head",)},
        {"min_weight": 0.0},
        {"hypothesis_search_period_s": 0},
    ],
)
def test_settings_that_cannot_work_are_refused(change):
    with pytest.raises(ConfigError):
        ParticleConfig(**change)
