"""Rotations: matrices and quaternions (scalar first) say the same thing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from assets.rotations import matrix_from_quaternion, quaternion_from_matrix
from hrc_env.geometry.rotations import about_axis, look_at

components = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(
    lambda values: np.linalg.norm(values) > 0.1
)


def unit(values: list[float]) -> np.ndarray:
    quaternion = np.array(values) / np.linalg.norm(values)
    return quaternion if quaternion[0] >= 0 else -quaternion


@settings(max_examples=50, deadline=None)
@given(components)
def test_a_quaternion_comes_back_from_its_matrix(values):
    quaternion = unit(values)
    back = quaternion_from_matrix(matrix_from_quaternion(quaternion))
    assert abs(float(quaternion @ back)) == pytest.approx(1.0, abs=1e-9)


@settings(max_examples=50, deadline=None)
@given(components)
def test_a_matrix_of_a_quaternion_keeps_lengths_and_handedness(values):
    R = matrix_from_quaternion(unit(values))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_half_turns_have_no_scalar_part_and_still_come_back(axis):
    R = about_axis(axis, np.pi)
    np.testing.assert_allclose(matrix_from_quaternion(quaternion_from_matrix(R)), R, atol=1e-12)


def test_a_quarter_turn_about_z_takes_x_to_y():
    np.testing.assert_allclose(about_axis("z", np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-12)


def test_leading_axes_pass_through():
    angles = np.linspace(-2, 2, 6).reshape(2, 3)
    assert quaternion_from_matrix(about_axis("y", angles)).shape == (2, 3, 4)


def test_a_camera_that_looks_along_x_has_y_of_the_world_to_its_left_and_z_up():
    right, down, forward = look_at(np.zeros(3), np.array([1.0, 0, 0])).T
    np.testing.assert_allclose(right, [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(down, [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(forward, [1, 0, 0], atol=1e-12)


def test_a_camera_can_look_straight_down():
    R = look_at(np.array([0, 0, 3.0]), np.zeros(3))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(R[:, 2], [0, 0, -1], atol=1e-12)
