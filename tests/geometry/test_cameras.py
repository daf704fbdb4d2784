"""Pinhole cameras: +X right, +Y down, +Z forward; pixels count from the top-left corner."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrc_env.geometry.cameras import inside_image, pinhole, project, projections, rays
from hrc_env.geometry.rotations import about_axis

CAMERA = pinhole("c", np.array([2.9, 2.6, 2.45]), np.array([0.2, 0, 1.0]), 90.0, 1920, 1080)


def seen(point: np.ndarray) -> tuple[np.ndarray, float]:
    px, depth_m = project(projections((CAMERA,)), point[None])
    return px[0, 0], float(depth_m[0, 0])


def test_what_a_camera_looks_at_is_in_the_middle_of_its_image():
    px, depth_m = seen(np.array([0.2, 0.0, 1.0]))
    np.testing.assert_allclose(px, [960.0, 540.0])
    assert depth_m == pytest.approx(np.linalg.norm(CAMERA.eye_world - [0.2, 0, 1.0]))


def test_ninety_degrees_of_view_put_the_focal_length_at_half_the_width():
    assert CAMERA.K[0, 0] == pytest.approx(960.0)


def test_higher_in_the_world_is_smaller_y_in_the_image():
    assert seen(np.array([0.2, 0.0, 1.5]))[0][1] < seen(np.array([0.2, 0.0, 1.0]))[0][1]


def test_a_point_behind_the_camera_has_negative_depth():
    assert seen(2 * CAMERA.eye_world)[1] < 0


@settings(max_examples=40, deadline=None)
@given(st.floats(1, 1919), st.floats(1, 1079), st.floats(0.3, 9.0))
def test_a_ray_through_a_pixel_projects_back_onto_the_pixel(u, v, distance_m):
    direction = rays(CAMERA, np.array([u, v]))
    px, _ = seen(CAMERA.eye_world + distance_m * direction)
    np.testing.assert_allclose(px, [u, v], atol=1e-6)


@settings(max_examples=25, deadline=None)
@given(st.floats(-3, 3), st.lists(st.floats(-2, 2), min_size=3, max_size=3))
def test_moving_world_and_camera_together_changes_no_pixel(angle, shift):
    R, t = about_axis("z", angle), np.array(shift)
    eye, target = CAMERA.eye_world, np.array([0.2, 0.0, 1.0])
    moved = pinhole("m", R @ eye + t, R @ target + t, 90.0, 1920, 1080)
    point = np.array([0.5, -0.4, 1.3])
    px, _ = project(projections((moved,)), (R @ point + t)[None])
    np.testing.assert_allclose(px[0, 0], seen(point)[0], atol=1e-6)


def test_the_image_ends_at_its_size():
    corners = np.array([[0.0, 0.0], [1919.9, 1079.9], [1920.0, 5.0], [5.0, -0.1]])
    assert inside_image(CAMERA, corners).tolist() == [True, True, False, False]
