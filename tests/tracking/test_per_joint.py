"""The estimator `per_joint`: accuracy, honesty, and the parts it is made of."""

import numpy as np
import pytest
from simulated import DT, HARD, LAB, Damage, detections, generators, keypoints, track, walk

from hrc_env.core.skeleton import BONES, MIRROR
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.joints.importance import exp_of_negative, make_noise
from hrc_env.tracking.models.motion import SPEED_M_S, SPREAD_M, damped_joints
from hrc_env.tracking.tracks import least_eigenvalue

gaussian = pytest.mark.parametrize("name", ["per_joint", "kalman"])
"""Both estimators that keep Gaussians look after their tracks in the same way."""


def errors(damage, seeds=range(4), n_frames=250, warm_up=25):
    """Errors (T, B, J, 3) and NEES (T, B, J) of `per_joint` on simulated walks."""
    joints = np.stack([walk(s, n_frames) for s in seeds], 1)
    px = np.stack([detections(joints[:, k], damage, s) for k, s in enumerate(seeds)], 1)
    estimates = track(make_estimator("per_joint", LAB, DT), px)[warm_up:]
    error = np.stack([e.mean_world[:, 0] for e in estimates]) - joints[warm_up:]
    precision = np.linalg.inv(np.stack([e.cov_world[:, 0] for e in estimates]))
    return error, np.einsum("...i,...ij,...j->...", error, precision, error)


def rmse(error):
    return np.sqrt((error**2).sum(-1).mean())


@pytest.mark.parametrize(
    ("damage", "bound_m"), [(Damage(), 0.016), (Damage(occlusions=True), 0.034), (HARD, 0.035)]
)
def test_four_cameras_give_a_few_centimetres_and_honest_covariances(damage, bound_m):
    error, nees = errors(damage)
    assert rmse(error) < bound_m
    assert 0.93 < (nees < 7.815).mean() < 0.985  # 95 % of chi-squared with 3 degrees of freedom
    assert 0.7 < np.median(nees) / 2.366 < 1.1


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
            assert state.swap_chance[0, 0, 1] > 0.9
            assert state.swap_chance[0, 0, [0, 2, 3]].max() < 0.1
    assert state.swap_chance.max() < 0.1


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
    e, rngs = make_estimator(name, LAB, DT), generators(1)
    state = e.init(1, 1)
    for t, frame in enumerate(px):
        if t == 40:
            state.body[0, 0, 5, :3] += [0.4, 0.4, 0.3]
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
        if t == 40:
            assert np.linalg.norm(state.body[0, 0, 5, :3] - joints[t, 5]) > 0.2
    assert np.linalg.norm(state.body[0, 0, 5, :3] - joints[-1, 5]) < 0.05


def test_bone_lengths_are_learnt_from_population_values():
    joints = walk(4, 250)
    joints = joints * 1.08  # a tall worker in a room as much larger
    e, rngs = make_estimator("per_joint", LAB, DT), generators(1)
    state = e.init(1, 1)
    first = state.bone_length[0, 0].copy()
    for frame in detections(joints, Damage(), 4)[:, None]:
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
    true = np.linalg.norm(joints[:, BONES[:, 0]] - joints[:, BONES[:, 1]], axis=-1)
    rigid = true.std(0) < 0.005
    before, after = np.abs(first - true.mean(0)), np.abs(state.bone_length[0, 0] - true.mean(0))
    assert after[rigid].max() < 0.015
    assert after[rigid].mean() < 0.3 * before[rigid].mean()


def test_the_motion_model_keeps_its_stationary_spread():
    F, Q = damped_joints(DT, 0.5, 1e-12)
    stationary = np.zeros_like(F)
    stationary[:, 0, 0], stationary[:, 1, 1] = SPREAD_M**2, SPEED_M_S**2
    np.testing.assert_allclose(F @ stationary @ F.swapaxes(1, 2) + Q, stationary, atol=1e-9)
    assert (np.abs(np.linalg.eigvals(F)) < 1).all()


def test_two_half_steps_of_the_motion_model_are_one_step():
    F, Q = damped_joints(DT, 0.5, 1e-12)
    half, noise = damped_joints(DT / 2, 0.5, 1e-12)
    np.testing.assert_allclose(half @ half, F, atol=1e-12)
    np.testing.assert_allclose(half @ noise @ half.swapaxes(1, 2) + noise, Q, atol=1e-12)


def test_the_tables_of_noise_have_no_mean_and_unit_covariance():
    tables = make_noise(8, 84, 16).astype(float)
    for part in (tables[:, :, :84], tables[:, :, 84:]):
        np.testing.assert_allclose(part.mean(-1), 0.0, atol=1e-6)
        covariance = part @ part.swapaxes(1, 2) / part.shape[-1]
        np.testing.assert_allclose(covariance, np.tile(np.eye(3), (8, 1, 1)), atol=1e-5)


def test_the_fast_exponential_is_the_exponential():
    x = np.linspace(-59, 0, 4001, dtype=np.float32)
    out = np.empty_like(x)
    exp_of_negative(x.copy(), out, out.view(np.int32))
    np.testing.assert_allclose(out, np.exp(x.astype(float)), rtol=1e-5)


def test_the_least_eigenvalue_is_the_least_eigenvalue():
    rng = np.random.default_rng(0)
    for _ in range(50):
        root = rng.normal(size=(3, 3)) * rng.uniform(0.01, 1, 3)
        matrix = root @ root.T
        np.testing.assert_allclose(
            least_eigenvalue(matrix), np.linalg.eigvalsh(matrix)[0], atol=1e-9
        )
    assert least_eigenvalue(2.0 * np.eye(3)) == 2.0


def test_particles_are_well_spent_when_all_cameras_agree():
    e, rngs = make_estimator("per_joint", LAB, DT), generators(1)
    state = e.init(1, 1)
    for frame in detections(walk(5, 30), Damage(), 5)[:, None]:
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
    assert state.ess.min() > 40
