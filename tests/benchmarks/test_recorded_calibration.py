"""A calibration file says where real cameras are; frames and units must come out right."""

import numpy as np
import pytest
from recorded_stored import calibration

from benchmarks.recorded.calibration import (
    find_meeting_point,
    read_calibration,
    tracker_config,
)
from hrc_env.geometry.cameras import pinhole, pinhole_from_image, project

SIZES = [(1000, 2000), (1000, 2000)]


def test_a_camera_looks_ahead_and_sees_what_is_above_it_higher_in_the_image(tmp_path):
    camera = read_calibration(calibration(tmp_path / "c.txt"), SIZES)[0]
    assert np.allclose(camera.eye_world, [0, -4, 1.5])
    points = np.array([[[0, 0, 1.5], [0, 0, 2.5], [1, 0, 1.5]]])
    px, depth_m = project(camera.P[None], points)
    assert np.allclose(depth_m[0, 0], 4)
    assert np.allclose(px[0, 0, 0], [500, 1000])  # half a pixel more than the file says
    assert px[0, 0, 1, 1] < 1000  # above
    assert px[0, 0, 2, 0] > 500  # to the right
    assert np.linalg.det(camera.T_world_from_cam[:3, :3]) == pytest.approx(1)


def test_undistorting_undoes_browns_lens(tmp_path):
    camera = read_calibration(calibration(tmp_path / "c.txt"), SIZES)[0]
    assert camera.lens is not None
    K, (k1, k2, p1, p2) = camera.K, camera.lens.coefficients
    x, y = 0.3, -0.4
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2 * r2
    shown = np.array(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ]
    )
    focal, middle = np.diag(K)[:2], K[:2, 2]
    px = np.array([[middle + focal * shown, [np.nan, np.nan]]])
    straight = pinhole_from_image(camera, px)
    assert np.allclose(straight[0, 0], middle + focal * [x, y], atol=0.01)
    assert np.isnan(straight[0, 1]).all()


def test_somebody_is_expected_where_the_cameras_look():
    target = np.array([1.0, 2.0, 0.8])
    eyes = ([4.0, 2.0, 2.0], [1.0, 5.0, 2.0], [-2.0, 1.0, 2.0])
    cameras = [pinhole("c", np.array(eye), target, 60, 640, 480) for eye in eyes]
    assert np.allclose(find_meeting_point(cameras), target)
    config = tracker_config(cameras)
    assert np.allclose(config.prior_mean_world, target)
    assert 1.5 < config.prior_std_m < 1.8
