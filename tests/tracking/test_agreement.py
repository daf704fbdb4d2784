"""How many views locate a joint, and how far their measurements are from it."""

import numpy as np
import pytest

from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.tracking.agreement import MAX_SIGMAS, SUPPORTING_M, add_agreement

EYES = np.array([(3.0, 3.0, 2.0), (-3.0, 3.0, 2.0), (0.0, -4.0, 2.0)])
CAMERAS = tuple(
    pinhole(f"c{k}", eye, np.array([0.0, 0.0, 1.0]), 60.0, 1920, 1080) for k, eye in enumerate(EYES)
)
P, FOCAL_PX = projections(CAMERAS), np.array([camera.K[0, 0] for camera in CAMERAS])
SIGMA_PX = 4.0
CAMERA, JOINT = 1, 6


def somebody(velocity=(0.0, 0.0, 0.0)):
    """A belief, and measurements that agree with it exactly."""
    mean = np.random.default_rng(0).uniform((-0.3, -0.3, 0.2), (0.3, 0.3, 1.7), (1, 1, N_JOINTS, 3))
    estimate = PoseEstimate(
        mean, np.tile(np.eye(3) * 1e-4, (1, 1, N_JOINTS, 1, 1)), np.full(mean.shape, velocity),
        np.zeros((1, 1, N_JOINTS)), np.ones((1, 1), bool),
    )  # fmt: skip
    px = project(P, mean[0]).px.reshape(1, len(P), 1, N_JOINTS, 2)
    return estimate, Keypoints(px, np.ones(px.shape[:-1]), np.full(px.shape[:-1], SIGMA_PX))


def measured(estimate, keypoints, age_s=0.0):
    """Views and misfit of the joint that tests change, and the number of joints unlike the rest."""
    found = add_agreement(estimate, keypoints, np.full((1, len(P)), age_s), P, FOCAL_PX)
    others = np.arange(N_JOINTS) != JOINT
    np.testing.assert_array_equal(found.n_views[0, 0, others], len(P))
    np.testing.assert_allclose(found.misfit[0, 0, others], 0.0, atol=1e-12)
    return found.n_views[0, 0, JOINT], found.misfit[0, 0, JOINT]


def test_measurements_that_agree_locate_every_joint():
    assert measured(*somebody()) == (len(P), pytest.approx(0.0, abs=1e-12))


@pytest.mark.parametrize(
    ("off", "n_views", "misfit"),
    [(2.5, 3, 6.25), (3.5, 2, 12.25), (40.0, 2, MAX_SIGMAS**2)],
)
def test_a_measurement_that_is_off_adds_its_squared_distance_up_to_a_limit(off, n_views, misfit):
    estimate, keypoints = somebody()
    keypoints.px[0, CAMERA, 0, JOINT] += off * SIGMA_PX * np.array([0.6, -0.8])
    assert measured(estimate, keypoints) == (n_views, pytest.approx(misfit))


@pytest.mark.parametrize(("share", "n_views"), [(0.98, 3), (1.02, 2)])
def test_a_vague_measurement_does_not_locate(share, n_views):
    estimate, keypoints = somebody()
    depth_m = project(P, estimate.mean_world[0]).depth_m[0, CAMERA, JOINT]
    vague_px = share * SUPPORTING_M * FOCAL_PX[CAMERA] / depth_m
    keypoints.sigma_px[0, CAMERA, 0, JOINT] = vague_px
    assert measured(estimate, keypoints)[0] == n_views


def test_a_missing_measurement_counts_for_nothing():
    estimate, keypoints = somebody()
    keypoints.px[0, CAMERA, 0, JOINT] = np.nan
    keypoints.confidence[0, CAMERA, 0, JOINT] = 0.0
    keypoints.sigma_px[0, CAMERA, 0, JOINT] = np.inf
    assert measured(estimate, keypoints) == (len(P) - 1, pytest.approx(0.0, abs=1e-12))


def test_an_older_image_is_compared_with_where_the_joint_was():
    velocity, age_s = np.array([0.5, -0.2, 0.1]), 0.2
    moving, keypoints = somebody(velocity)
    moving.mean_world[:] += age_s * velocity
    assert measured(moving, keypoints, age_s) == (len(P), pytest.approx(0.0, abs=1e-12))


def test_an_estimate_without_cameras_has_none():
    estimate, _ = somebody()
    assert (estimate.n_views == 0).all()
    assert np.isnan(estimate.misfit).all()
