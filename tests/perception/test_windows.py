"""Windows round predicted workers are the regions of interest that BlazePose would take."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from people import STANDING

from hrc_env.core.records import Roi
from hrc_env.core.skeleton import BLAZEPOSE_INDEX
from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.perception.blazepose import wrap_angle
from hrc_env.perception.windows import steady_window, window_from_joints

CAMERA = pinhole("camera", np.array([4.0, 0, 1.0]), np.array([0, 0, 1.0]), 60, 1920, 1080)


def window(joints_world, camera=CAMERA):
    px, depth_m = project(projections((camera,)), joints_world[None])
    return window_from_joints(px[0, 0], depth_m[0, 0], camera)


def test_an_upright_worker_gets_an_upright_window_round_the_hips():
    found = window(STANDING)
    px, _ = project(projections((CAMERA,)), STANDING[None])
    assert found is not None
    np.testing.assert_allclose(found.centre_px, px[0, 0, [7, 8]].mean(0))
    assert abs(found.rotation_rad) < 0.05


def test_the_window_holds_the_whole_worker_with_a_quarter_to_spare():
    found = window(STANDING)
    px, depth_m = project(projections((CAMERA,)), STANDING[None])
    stature_px = 1.75 * CAMERA.K[0, 0] / depth_m.mean()
    assert found is not None
    assert 1.2 * stature_px < found.side_px < 1.45 * stature_px
    assert np.abs(px[0, 0] - found.centre_px).max() < found.side_px / 2 / 1.2


@settings(max_examples=30, deadline=None)
@given(st.floats(-math.pi, math.pi), st.floats(0.3, 3.0), st.floats(-200, 200))
def test_a_turned_and_enlarged_image_turns_and_enlarges_the_window(angle, scale, shift):
    px = np.array([[960, 540]]) + 200 * STANDING[:, 1:] * [1, -1] + [0, 150]
    c, s = math.cos(angle), math.sin(angle)
    moved = (px - [960, 540]) @ np.array([[c, s], [-s, c]]) * scale + [960 + shift, 540]
    # the image is large enough for all of it; depth goes with the scale
    camera = pinhole("camera", np.array([4.0, 0, 1]), np.array([0, 0, 1.0]), 60, 1920, 1080)
    depth = np.full(15, camera.K[0, 0] / 200)
    first = window_from_joints(px, depth, camera)
    second = window_from_joints(moved, depth / scale, camera)
    if first is None or second is None:  # turned out of the image
        return
    assert second.side_px == pytest.approx(scale * first.side_px, rel=1e-6)
    assert abs(wrap_angle(second.rotation_rad - first.rotation_rad - angle)) < 1e-6


def test_a_torso_seen_end_on_still_has_a_window():
    folded = STANDING.copy()
    folded[[1, 2]] = STANDING[[7, 8]] + [0.4, 0, 0]  # bent straight towards the camera
    found = window(folded)
    assert found is not None
    assert math.isfinite(found.rotation_rad)
    assert found.side_px > 100


@pytest.mark.parametrize(
    "shift", [(4.0, 0, 0), (6.0, 0, 0), (0, 6.0, 0)], ids=["too close", "behind", "outside"]
)
def test_a_worker_out_of_sight_has_no_window(shift):
    assert window(STANDING + np.array(shift)) is None


def test_joints_of_a_picture_give_about_the_region_that_the_network_uses(reference):
    """The worker fills two thirds of the stored pictures; only the one who lifts is bent."""
    for name, marks in reference.items():
        joints_px = marks[BLAZEPOSE_INDEX, :2] + [800, 400]
        found = window_from_joints(joints_px, np.full(15, 1.75 * CAMERA.K[0, 0] / 165), CAMERA)
        assert found is not None, name
        assert 150 < found.side_px < 280, name
        assert (abs(found.rotation_rad) < 0.4) == (name != "lift.png"), name


def test_a_window_stays_until_the_wanted_one_has_moved_away():
    kept = Roi((500.0, 400.0), 300.0, 0.1)
    near = Roi((520.0, 410.0), 330.0, -0.05)
    assert steady_window(kept, near) is kept
    for wanted in (
        Roi((535.0, 400.0), 300.0, 0.1),
        Roi((500.0, 400.0), 360.0, 0.1),
        Roi((500.0, 400.0), 300.0, 0.31),
    ):
        assert steady_window(kept, wanted) is wanted
    assert steady_window(None, near) is near
    assert steady_window(kept, None) is None
