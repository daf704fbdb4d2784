"""How Gaussians on a body look after their tracks, whatever the number of hypotheses."""

import numpy as np
import pytest
from simulated import DT, LAB, Damage, detections, generators, keypoints, track, walk

from hrc_env.core.skeleton import MIRROR
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.tracks import least_eigenvalue
from hrc_env.tracking.tree.gaussian import PARENT
from hrc_env.tracking.tree.predict import SPEED_M_S, SPREAD_M, discretise_joints

gaussian = pytest.mark.parametrize("name", ["kalman", "particle"])


def rmse(error):
    return np.sqrt((error**2).sum(-1).mean())


@gaussian
def test_swapped_views_are_undone(name):
    joints = walk(0, 150)
    px = detections(joints, Damage(), 0)[:, None]
    swapped = px.copy()
    swapped[60:90, :, 1] = px[60:90, :, 1][:, :, MIRROR]
    e = make_estimator(name, LAB, DT)
    clean = np.stack([x.mean_world for x in track(e, px)])
    dirty = np.stack([x.mean_world for x in track(e, swapped)])
    assert np.abs(clean - dirty)[60:].max() < 0.02
    state, rngs = e.init(1, 1), generators(1)
    for t, frame in enumerate(swapped):
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
        if t == 75:
            assert state.views["swap_chance"][0, 0, 0, 1] > 0.9
            assert state.views["swap_chance"][0, 0, 0, [0, 2, 3]].max() < 0.1
    assert state.views["swap_chance"].max() < 0.1


@gaussian
def test_a_phantom_in_one_camera_does_not_pull_the_estimate(name):
    joints = walk(1, 80)
    px = detections(joints, Damage(), 1)[:, None]
    haunted = px.copy()
    haunted[40:, :, 2] = px[40:, :, 2] + [250.0, -120.0]
    e = make_estimator(name, LAB, DT)
    mean = np.stack([x.mean_world[0, 0] for x in track(e, haunted)])
    assert rmse(mean[45:] - joints[45:]) < 0.03


@gaussian
def test_one_camera_leaves_the_rays_variance_large(name):
    joints = np.repeat(walk(2, 1), 60, axis=0)
    px = detections(joints, Damage(), 2)[:, None]
    px[40:, :, 1:] = np.nan
    estimates = track(make_estimator(name, LAB, DT), px)
    widest = [np.sqrt(np.linalg.eigvalsh(e.cov_world[0, 0])) for e in estimates]
    assert (widest[55][:, 2] > 2 * widest[39][:, 2]).all()
    assert (widest[55][:, 2] > 2.5 * widest[55][:, 0]).all()


@gaussian
def test_a_joint_that_was_followed_wrongly_is_found_again(name):
    joints = walk(3, 60)
    px = detections(joints, Damage(), 3)[:, None]
    px[40:, :, 2:, 5] = np.nan  # two views do not overrule the track at once
    e, rngs = make_estimator(name, LAB, DT), generators(1)
    state = e.init(1, 1)
    for t, frame in enumerate(px):
        if t == 40:
            state.trees["body"][0, 0, 0, 5, :3] += [0.4, 0.4, 0.3]
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
        if t == 40:
            assert np.linalg.norm(state.trees["body"][0, 0, 0, 5, :3] - joints[t, 5]) > 0.2
    assert np.linalg.norm(state.trees["body"][0, 0, 0, 5, :3] - joints[-1, 5]) < 0.05


def test_bone_lengths_are_learnt_from_population_values():
    joints = walk(4, 250) * 1.08  # a tall worker in a room as much larger
    e, rngs = make_estimator("kalman", LAB, DT), generators(1)
    state = e.init(1, 1)
    first = state.trees["bone_length"][0, 0, 0].copy()
    for frame in detections(joints, Damage(), 4)[:, None]:
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
    parent = np.array(PARENT)
    bones = np.flatnonzero(parent >= 0)
    true = np.linalg.norm(joints[:, bones] - joints[:, parent[bones]], axis=-1)
    rigid = bones[true.std(0) < 0.005]
    true = dict(zip(bones.tolist(), true.mean(0), strict=True))
    before, after = (
        np.array([abs(lengths[j] - true[j]) for j in rigid])
        for lengths in (first, state.trees["bone_length"][0, 0, 0])
    )
    assert len(rigid) > 4
    assert after.max() < 0.015
    assert after.mean() < 0.3 * before.mean()


def test_the_motion_model_keeps_its_stationary_spread():
    F, Q = discretise_joints(DT, 0.5, 1e-12)
    stationary = np.zeros_like(F)
    stationary[:, 0, 0], stationary[:, 1, 1] = SPREAD_M**2, SPEED_M_S**2
    np.testing.assert_allclose(F @ stationary @ F.swapaxes(1, 2) + Q, stationary, atol=1e-9)
    assert (np.abs(np.linalg.eigvals(F)) < 1).all()


def test_two_half_steps_of_the_motion_model_are_one_step():
    F, Q = discretise_joints(DT, 0.5, 1e-12)
    half, noise = discretise_joints(DT / 2, 0.5, 1e-12)
    np.testing.assert_allclose(half @ half, F, atol=1e-12)
    np.testing.assert_allclose(half @ noise @ half.swapaxes(1, 2) + noise, Q, atol=1e-12)


def test_the_least_eigenvalue_is_the_least_eigenvalue():
    rng = np.random.default_rng(0)
    for _ in range(50):
        root = rng.normal(size=(3, 3)) * rng.uniform(0.01, 1, 3)
        matrix = root @ root.T
        np.testing.assert_allclose(
            least_eigenvalue(matrix), np.linalg.eigvalsh(matrix)[0], atol=1e-9
        )
    assert least_eigenvalue(2.0 * np.eye(3)) == 2.0
