"""What the motion model does not expect: jerks, falls, sides that are exchanged at first sight."""

import numpy as np
import pytest
from simulated import DT, LAB, Damage, detections, track, walk

from hrc_env.core.skeleton import JOINT, MIRROR
from hrc_env.geometry.rotations import about_axis
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.tree.predict import TorsoState, measure_lean, set_axes

gaussian = pytest.mark.parametrize("name", ["kalman", "particle"])
WRIST, N = JOINT["left_wrist"], 60
AT = 40
"""The frame of the surprise."""


def followed(name, joints, px, config=None):
    """Errors (T, J, 3) [m] and covariances (T, J, 3, 3) while px (T, C, J, 2) are tracked."""
    estimates = track(make_estimator(name, LAB, DT, config), px[:, None])
    assert all(e.tracked.all() for e in estimates)
    mean = np.stack([e.mean_world[0, 0] for e in estimates])
    return mean - joints, np.stack([e.cov_world[0, 0] for e in estimates])


def jerked():
    """A wrist that is suddenly 25 cm away, and stays there; bones give."""
    joints = walk(4, N)
    joints[AT:, WRIST] += [0.15, 0.0, 0.2]
    return joints


@gaussian
def test_a_joint_that_all_views_see_elsewhere_is_there_at_once(name):
    joints = jerked()
    error, cov = followed(name, joints, detections(joints, Damage(), 4))
    at = error[AT : AT + 3, WRIST]
    assert np.linalg.norm(at, axis=-1).max() < 0.06
    squared = np.einsum("ti,tij,tj->t", at, np.linalg.inv(cov[AT : AT + 3, WRIST]), at)
    assert squared.max() < 16.0


@gaussian
def test_two_views_that_are_wrong_alike_are_no_jump(name):
    joints = walk(4, N)
    px = detections(joints, Damage(), 4)
    px[AT : AT + 2, 2:, WRIST] = detections(jerked(), Damage(), 4)[AT : AT + 2, 2:, WRIST]
    error, _ = followed(name, joints, px)
    assert np.linalg.norm(error[AT:, WRIST], axis=-1).max() < 0.08


def laid_down(joints, share):
    """A body (T, J, 3) that falls forward, by a share of a right angle, and lies on the floor."""
    hips = joints[:, [7, 8]].mean(1, keepdims=True)
    body = np.einsum("tij,tkj->tki", about_axis("y", 0.5 * np.pi * share), joints - hips) + hips
    body[..., 2] -= np.maximum(body[..., 2].min(1) - 0.02, 0.0)[:, None]
    body[..., 2] += np.maximum(0.02 - body[..., 2].min(1), 0.0)[:, None]
    return body


def fallen(seed=5, n_frames=120):
    still = np.repeat(walk(seed, 1), n_frames, axis=0)
    return laid_down(still, np.clip((np.arange(n_frames) - 25) / 20, 0.0, 1.0))


@gaussian
def test_who_falls_is_followed_by_four_cameras_as_who_stands_is(name):
    joints = fallen()
    error, cov = followed(name, joints, detections(joints, Damage(), 5))
    rmse_m = np.sqrt((error[30:] ** 2).sum(-1).mean())
    assert rmse_m < 0.025
    assert 0.8 < np.sqrt(np.trace(cov[30:], axis1=-2, axis2=-1).mean()) / rmse_m < 1.5


@gaussian
def test_of_who_lies_before_one_camera_little_is_known_and_that_is_said(name):
    joints = fallen()
    px = detections(joints, Damage(), 5)
    px[30:, 1:] = np.nan
    error, cov = followed(name, joints, px)
    said_m = np.sqrt(np.trace(cov[60:], axis1=-2, axis2=-1).mean())
    assert said_m > 0.6 * np.sqrt((error[60:] ** 2).sum(-1).mean())


def test_reports_of_who_lies_are_wider_by_the_setting_and_of_who_stands_are_not():
    for joints, factor in ((fallen(), 2.0), (walk(5, N), 1.0)):
        px = detections(joints, Damage(), 5)
        px[30:, 1:] = np.nan
        narrow, wide = (
            followed("kalman", joints, px, ParticleConfig(lying_inflation=lying, min_std_m=1e-4))[1]
            for lying in (1.0, 2.0)
        )
        ratio = np.trace(wide[50], axis1=-2, axis2=-1) / np.trace(narrow[50], axis1=-2, axis2=-1)
        np.testing.assert_allclose(ratio, factor, rtol=0.02)


@pytest.mark.parametrize("angle_deg", [0.0, 20.0, 90.0, 150.0])
def test_axes_are_upright_until_a_trunk_lies(angle_deg):
    body = laid_down(walk(6, 1), np.array([angle_deg / 90]))[0]
    root = TorsoState(*body[[1, 2, 7, 8]].mean(0), 0.0, 0.0, 0.0)
    axes = np.empty((2, 3, 3))
    assert set_axes(body, root, np.zeros((15, 3)), axes)
    np.testing.assert_allclose(axes[0].T @ axes[0], np.eye(3), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(axes[0]), 1.0)
    lies, along = measure_lean(body)
    np.testing.assert_allclose(axes[0][:, 2], along if lies == 1.0 else [0.0, 0.0, 1.0], atol=1e-9)
    assert lies == (angle_deg > 45.0)
    left = body[1] - body[2]
    assert axes[0][:, 1] @ left > 0.9 * np.linalg.norm(left)


@gaussian
@pytest.mark.parametrize("exchanged", [(0, 1), (0, 2), (3,), (1, 2)])
def test_cameras_that_exchange_sides_in_the_first_frame_do_not_mirror_the_body(name, exchanged):
    joints = walk(7, 30)
    px = detections(joints, Damage(), 7)
    for c in exchanged:
        px[0, c] = px[0, c][MIRROR]
    error, _ = followed(name, joints, px)
    assert np.linalg.norm(error[0], axis=-1).max() < 0.15
    assert np.linalg.norm(error[1:], axis=-1).mean() < 0.03


@gaussian
def test_a_body_that_was_begun_mirrored_is_turned_as_soon_as_all_views_say_so(name):
    joints = walk(8, 30)
    px = detections(joints, Damage(), 8)
    px[0] = px[0][:, MIRROR]  # all cameras agree: nothing tells it then
    error, _ = followed(name, joints, px)
    assert np.linalg.norm(error[3:], axis=-1).mean() < 0.03
