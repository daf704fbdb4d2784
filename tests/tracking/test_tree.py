"""The Gaussian on the tree against the same Gaussian written out in 90 dimensions."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated import DT

from hrc_env.core.skeleton import BONES, N_JOINTS, TORSO
from hrc_env.tracking.tree.gaussian import EDGE_BONE, ORDER, PARENT, ROOT, invert
from hrc_env.tracking.tree.learning import learn_lengths
from hrc_env.tracking.tree.predict import (
    MotionModel,
    discretise_joints,
    make_motion_model,
    make_shared_noise,
    predict_tree,
)
from hrc_env.tracking.tree.state import STANDING_M, TREE, WORK, make_bone_prior
from hrc_env.tracking.tree.update import update_tree

J = N_JOINTS
_I3 = np.eye(3)
seeds = st.integers(0, 2**32 - 1)


def random_covariance(rng, n=6, scale=0.2):
    root = rng.normal(size=(n, n)) * scale
    return root @ root.T + 0.01 * scale * np.eye(n)


def random_tree(rng):
    """A random Gaussian on the tree, of a standing body."""
    tree = np.zeros(1, TREE).view(np.recarray)[0]
    body, cov, slope = tree.body, tree.cov, tree.slope
    body[:, :3], body[:, 3:] = STANDING_M + 0.05 * rng.normal(size=(J, 3)), rng.normal(size=(J, 3))
    tree.offset, tree.offset_count = STANDING_M, 5.0
    for j in ORDER:
        cov[j] = random_covariance(rng)
        if j != ROOT:
            slope[j] = 0.5 * rng.normal(size=(6, 6))
            cov[j] += slope[j] @ cov[PARENT[j]] @ slope[j].T
    return tree


def work():
    return np.zeros(1, WORK).view(np.recarray)[0]


def dense(cov, slope):
    """(90, 90) covariance of the same Gaussian: Cov(x_j, x_k) = B_j Cov(x_parent, x_k)."""
    full = np.zeros((J, J, 6, 6))
    for n, j in enumerate(ORDER):
        full[j, j] = cov[j]
        for k in ORDER[:n]:
            full[j, k] = slope[j] @ full[PARENT[j], k]
            full[k, j] = full[j, k].T
    return full.transpose(0, 2, 1, 3).reshape(6 * J, 6 * J)


def block(full, j, k):
    return full[6 * j : 6 * j + 6, 6 * k : 6 * k + 6]


def assert_is_projection(full, cov, slope):
    """Marginals and edges of the tree are those of the dense covariance."""
    for j in range(J):
        np.testing.assert_allclose(cov[j], block(full, j, j), atol=1e-8)
        if j != ROOT:
            edge = slope[j] @ cov[PARENT[j]]
            np.testing.assert_allclose(edge, block(full, j, PARENT[j]), atol=1e-7)


def test_every_edge_is_a_bone_and_parents_come_first():
    for j in range(J):
        if j != ROOT:
            assert set(BONES[EDGE_BONE[j]]) == {j, PARENT[j]}
            assert ORDER.index(PARENT[j]) < ORDER.index(j)


@settings(max_examples=20, deadline=None)
@given(seed=seeds)
def test_the_inverse_is_the_inverse_and_says_when_there_is_none(seed):
    matrix, inverse = random_covariance(np.random.default_rng(seed)), np.empty((6, 6))
    assert invert(matrix, inverse)
    np.testing.assert_allclose(inverse @ matrix, np.eye(6), atol=1e-6)
    matrix[2, 2] = -1e-3
    assert not invert(matrix, inverse)
    assert not invert(np.full((6, 6), np.nan), inverse)


@settings(max_examples=15, deadline=None)
@given(seed=seeds)
def test_an_update_is_the_dense_gaussian_update(seed):
    rng = np.random.default_rng(seed)
    tree, w = random_tree(rng), work()
    body, cov, slope = tree.body, tree.cov, tree.slope
    prior, mean = dense(cov, slope), body.copy().ravel()
    precision, gradient = np.linalg.inv(prior), np.zeros(6 * J)
    for j in range(J):
        w.camera_information[j] = random_covariance(rng, 3, 5.0) * rng.integers(0, 2)
        w.camera_gradient[j] = rng.normal(size=3)
        precision[6 * j : 6 * j + 3, 6 * j : 6 * j + 3] += w.camera_information[j]
        gradient[6 * j : 6 * j + 3] += w.camera_gradient[j]
        if j != ROOT:
            information, q = random_covariance(rng, 3, 20.0), PARENT[j]
            difference = np.zeros((3, 6 * J))
            difference[:, 6 * j : 6 * j + 3], difference[:, 6 * q : 6 * q + 3] = _I3, -_I3
            w.edge_information[j], w.edge_gradient[j] = information, rng.normal(size=3)
            precision += difference.T @ information @ difference
            gradient += difference.T @ w.edge_gradient[j]
    for j in ORDER[1:]:
        w.edge[j] = slope[j] @ cov[PARENT[j]]
    update_tree(tree, w)
    posterior = np.linalg.inv(precision)
    np.testing.assert_allclose(body.ravel(), mean + posterior @ gradient, atol=1e-7)
    assert_is_projection(posterior, cov, slope)
    np.testing.assert_allclose(dense(cov, slope), posterior, atol=1e-7)  # nothing is lost


@settings(max_examples=15, deadline=None)
@given(seed=seeds)
def test_a_prediction_is_the_dense_one_projected_on_the_tree(seed):
    rng = np.random.default_rng(seed)
    tree = random_tree(rng)
    body, cov, slope = tree.body, tree.cov, tree.slope
    prior, mean = dense(cov, slope), body.copy()
    F, Q = discretise_joints(DT, 0.5, 4.0)
    shared = make_shared_noise(DT, 4.0)
    travel = np.array([[1, DT], [0, 1]]) - F
    predict_tree(tree, MotionModel(F, travel, Q, shared), DT, work())
    moves, noise = np.zeros((J, 6, J, 6)), np.zeros((J, 6, J, 6))
    for j in range(J):
        moves[j, :, j] += np.kron(F[j], _I3)
        for k in TORSO:
            moves[j, :, k] += np.kron(travel[j], _I3) / 4
        noise[j] += np.kron(shared, _I3)[:, None]
        noise[j, :, j] += np.kron(Q[j] - shared, _I3)
    moves, noise = moves.reshape(6 * J, 6 * J), noise.reshape(6 * J, 6 * J)
    assert_is_projection(moves @ prior @ moves.T + noise, cov, slope)
    sideways = mean[[1, 7], :2].sum(0) - mean[[2, 8], :2].sum(0)
    left = np.append(sideways / np.linalg.norm(sideways), 0)
    place = tree.offset @ np.array([[left[1], -left[0], 0], left, [0, 0, 1]])
    pulled = (travel[:, :, :1] * place[:, None]).ravel()  # (J, 2, 3): damped to its place
    np.testing.assert_allclose(body.ravel(), moves @ mean.ravel() + pulled, atol=1e-9)


def test_a_body_that_nobody_sees_keeps_its_shape_but_not_its_place():
    """Damping towards the torso must not make smaller what the torso does not know."""
    rng = np.random.default_rng(0)
    tree = random_tree(rng)
    tree.body[:, 3:], tree.slope[:] = 0.0, 0.0
    tree.cov[:] = 1e-4 * np.eye(6)
    model = make_motion_model(DT, 0.5, 4.0)
    for _ in range(50):
        predict_tree(tree, model, DT, work())
    full = dense(tree.cov, tree.slope)
    spread = np.sqrt(np.diagonal(full).reshape(J, 6)[:, :3].mean(-1))
    assert (spread > 2.0).all()  # two seconds of 4 m^2/s^3: sqrt(4 * 8 / 3) = 3.3 m
    q, j = 5, 6  # wrists know where the other is better than where they are
    apart = block(full, j, j) + block(full, q, q) - block(full, j, q) - block(full, q, j)
    assert np.sqrt(apart[:3, :3].trace() / 3) < 0.35 * spread[j]


def test_lengths_are_learnt_although_errors_across_a_bone_lengthen_it():
    rng = np.random.default_rng(1)
    tree = np.zeros(1, TREE).view(np.recarray)[0]
    tree.bone_length, tree.bone_variance = make_bone_prior()
    true, std = 1.07 * tree.bone_length, 0.03
    tree.cov = 1e-6 * np.eye(6)
    tree.cov[:, range(3), range(3)] = std**2
    for _ in range(1500):
        body = np.zeros((J, 6))
        for j in ORDER[1:]:
            body[j, :3] = body[PARENT[j], :3] + [true[j], 0, 0]
        body[:, :3] += std * rng.normal(size=(J, 3))
        tree.body = body
        learn_lengths(tree, np.full(J, 4))
    error = np.delete(tree.bone_length - true, ROOT)
    assert np.abs(error).max() < 0.01
    assert np.abs(error.mean()) < 0.003
    seen = tree.bone_length.copy()
    learn_lengths(tree, np.ones(J, int))
    np.testing.assert_array_equal(tree.bone_length, seen)  # one view teaches no length
