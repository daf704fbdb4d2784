"""Lenses: there and back, what they cannot show, and the paper's GoPro."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrc_env.core.errors import ConfigError
from hrc_env.geometry.camera_config import MAKES, CameraConfig, intrinsics
from hrc_env.geometry.lens import Lens, distort, magnification, rays_cam, undistort

GOPRO = MAKES["gopro_hero8_wide"]
LENSES = (
    Lens(),
    Lens("brown_conrady", (-0.28, 0.07, 0.001, -0.002, 0.01)),
    Lens("kannala_brandt", (0.0667,)),
    Lens("kannala_brandt", (-0.01, -0.05, 0.02)),
)
PLACE = st.floats(-1.2, 1.2)


@pytest.mark.parametrize("lens", LENSES, ids=str)
@settings(deadline=None, max_examples=50)
@given(PLACE, PLACE)
def test_bent_and_straightened_is_where_it_was(lens, x, y):
    place = np.array([x, y])
    np.testing.assert_allclose(undistort(lens, distort(lens, place)), place, atol=1e-8)


def test_both_models_are_opencvs():
    straight = np.random.default_rng(0).uniform(-0.9, 0.9, (50, 2))
    brown, fisheye = (-0.2, 0.05, 0.002, -0.001, 0.003), (0.05, -0.01, 0.002, 0.001)
    points, nowhere, K = np.column_stack([straight, np.ones(50)]), np.zeros(3), np.eye(3)
    theirs, _ = cv2.projectPoints(points, nowhere, nowhere, K, np.array(brown))
    np.testing.assert_allclose(
        distort(Lens("brown_conrady", brown), straight), theirs[:, 0], atol=1e-9
    )
    theirs = cv2.fisheye.distortPoints(straight[:, None], K, np.array(fisheye))
    np.testing.assert_allclose(
        distort(Lens("kannala_brandt", fisheye), straight), theirs[:, 0], atol=1e-9
    )


def test_a_fisheye_sees_behind_itself_and_a_pinhole_has_no_place_for_it():
    lens = Lens("kannala_brandt")  # radius = angle
    ray = rays_cam(lens, np.array([1.8, 0.0]))
    np.testing.assert_allclose(ray, [np.sin(1.8), 0.0, np.cos(1.8)])
    assert np.isnan(undistort(lens, np.array([1.8, 0.0]))).all()


def test_beyond_the_fold_nothing_is_seen_and_nothing_falls_back_into_the_image():
    lens = Lens("brown_conrady", (-0.3,))  # folds at radius 1.05
    assert np.isnan(rays_cam(lens, np.array([0.8, 0.0]))).all()
    assert np.abs(distort(lens, np.array([1.8, 0.0]))).max() > 100


@pytest.mark.parametrize("lens", LENSES, ids=str)
def test_the_stretch_is_the_ratio_of_areas(lens):
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * 1e-4 + [0.5, 0.3]
    area = [
        cv2.contourArea(np.float32((q - q[0]) * 1e4)) for q in (corners, distort(lens, corners))
    ]
    assert magnification(lens, corners[0]) == pytest.approx(np.sqrt(area[0] / area[1]), rel=1e-3)


def test_the_gopro_sees_what_the_paper_says():
    K = intrinsics(GOPRO)
    assert K[0, 0] == pytest.approx(869.0, abs=0.2)
    edges = np.array([[GOPRO.width_px - K[0, 2], 0], [0, GOPRO.height_px - K[1, 2]]]) / K[0, 0]
    half_deg = np.degrees(np.arccos(rays_cam(GOPRO.lens, edges * (1 - 1e-9))[:, 2]))
    np.testing.assert_allclose(2 * half_deg, (118.2, 69.5), atol=0.05)


def test_a_camera_of_an_unknown_make_is_told_those_that_there_are():
    with pytest.raises(ConfigError, match="gopro_hero8_wide"):
        CameraConfig.from_make("gopro", "left", (0.0, 0.0, 2.0))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"hfov_deg": 200.0, "lens": Lens()}, "field of view"),
        ({"width_px": 0}, "width_px"),
        ({"focal_px": (0.0, 900.0)}, "focal lengths must be positive"),
        ({"focal_px": (900.0,)}, "two numbers"),
        ({"centre_px": (2000.0, 540.0)}, "principal point"),
        ({"lens": Lens("brown_conrady", (-0.5,))}, "be monotonic"),
        ({"lens": Lens("brown_conrady", (-0.5,)), "focal_px": (600.0, 600.0)}, "reach the center"),
        ({"target_world": (0.0, 0.0, 2.4)}, "must differ from its position"),
        ({"eye_world": (float("nan"), 0.0, 1.0)}, "finite"),
    ],
)
def test_impossible_cameras_are_refused_in_words(change, said):
    with pytest.raises(ConfigError, match=said):
        replace(GOPRO, **change)


@pytest.mark.parametrize(
    "lens", [("fisheye", ()), ("none", (0.1,)), ("kannala_brandt", (0.1,) * 5)]
)
def test_lenses_of_no_model_are_refused(lens):
    with pytest.raises(ConfigError, match="model"):
        Lens(*lens)


def test_a_plain_camera_needs_a_name_and_a_place_only():
    assert intrinsics(CameraConfig("a", (1.0, 1.0, 2.0)))[0, 0] == pytest.approx(960.0)
