"""Poses that no track explains."""

import numpy as np
import pytest

from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import JOINT, N_JOINTS
from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.tracking.contradiction import (
    EXPLAINED_M,
    LEAST_JOINTS,
    SEEN_WELL,
    SIGMAS,
    find_unexplained,
)

EYES = np.array([(3.0, 3.0, 2.0), (-3.0, 3.0, 2.0)])
CAMERAS = tuple(
    pinhole(f"c{k}", eye, np.array([0.0, 0.0, 1.0]), 60.0, 1920, 1080) for k, eye in enumerate(EYES)
)
P, FOCAL_PX = projections(CAMERAS), np.array([camera.K[0, 0] for camera in CAMERAS])


def people(n_workers=1, tracked=True, velocity=(0.0, 0.0, 0.0), size=1.0):
    """A belief of people near each other, and what two cameras show of them."""
    rng = np.random.default_rng(0)
    mean = rng.uniform((-0.3, -0.3, 0.2), (0.3, 0.3, 1.7), (1, n_workers, N_JOINTS, 3))
    for name, height_m in (("shoulder", 1.4), ("hip", 0.9), ("knee", 0.48), ("ankle", 0.07)):
        both = [JOINT[f"{side}_{name}"] for side in ("left", "right")]
        mean[:, :, both] = mean[:, :, :1] * (1.0, 1.0, 0.0) + (0.0, 0.0, height_m)
    mean *= size
    estimate = PoseEstimate(
        mean, np.tile(np.eye(3) * 1e-4, (*mean.shape[:3], 1, 1)), np.full(mean.shape, velocity),
        np.zeros(mean.shape[:3]), np.full((1, n_workers), tracked),
    )  # fmt: skip
    px, _ = project(P, mean.reshape(1, -1, 3))
    px = px.reshape(1, 2, n_workers, N_JOINTS, 2)
    return estimate, Keypoints(px, np.ones(px.shape[:-1]), np.ones(px.shape[:-1]))


def told(estimate, seen, age_s=0.0):
    shown = find_unexplained(seen, np.full((1, 2), age_s), estimate, P, FOCAL_PX)
    return shown.poses[0].tolist(), shown.unexplained[0].tolist()


@pytest.mark.parametrize("n_workers", [1, 2])
def test_a_track_explains_what_cameras_show_of_it(n_workers):
    assert told(*people(n_workers)) == ([True, True], [False, False])


@pytest.mark.parametrize("worker", [0, 1])
def test_a_pose_is_explained_up_to_a_distance_across_the_line_of_sight(worker):
    estimate, _ = people(2)
    camera, (_, depth_m) = 1, project(P, estimate.mean_world[0, worker][None])
    for share, expected in ((0.98, False), (1.02, True)):
        _, moved = people(2)
        off_px = share * EXPLAINED_M * FOCAL_PX[camera] / depth_m[0, camera]
        moved.px[0, camera, worker, :, 1] += off_px
        assert told(estimate, moved)[1] == [False, expected]
        moved.sigma_px[:] = 1.05 * off_px / SIGMAS
        assert told(estimate, moved)[1] == [False, False]


@pytest.mark.parametrize(
    ("size", "strange"), [(0.65, True), (0.86, False), (1.2, False), (1.45, True)]
)
def test_a_body_of_no_persons_size_explains_nothing(size, strange):
    assert told(*people(size=size))[1] == [strange, strange]


def test_what_nobody_is_tracked_for_is_not_explained():
    assert told(*people(tracked=False)) == ([True, True], [True, True])


def test_few_joints_or_faint_ones_are_no_pose_and_half_of_them_may_be_off():
    estimate, seen = people(tracked=False)
    seen.confidence[0, 0, 0, LEAST_JOINTS - 1 :] = 0.0
    seen.confidence[0, 1] = SEEN_WELL - 0.01
    assert told(estimate, seen) == ([False, False], [False, False])
    estimate, seen = people()
    seen.confidence[0, :, 0, LEAST_JOINTS:] = 0.0
    seen.px[0, 0, 0, : LEAST_JOINTS // 2] += 500.0
    seen.px[0, 1, 0, : LEAST_JOINTS // 2 + 1] += 500.0
    assert told(estimate, seen) == ([True, True], [False, True])


@pytest.mark.parametrize("velocity", 1.5 * np.eye(3))
def test_late_images_show_where_people_were(velocity):
    estimate, seen = people(velocity=velocity)
    later = people(velocity=velocity)[0]
    later.mean_world[:] += 0.2 * velocity
    assert told(later, seen)[1] == [True, True]
    assert told(later, seen, age_s=0.2)[1] == [False, False]
    assert told(estimate, seen, age_s=np.nan)[1] == [False, False]


def test_somebody_believed_behind_a_camera_is_not_whom_it_shows():
    estimate, seen = people()
    behind = 2 * CAMERAS[0].eye_world - estimate.mean_world
    estimate.mean_world[:] = behind
    assert told(estimate, seen)[1][0]
