"""The rig: which cameras are on, and where a rendered thing lands in their images."""

import mujoco
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.scene.build import build, drawing_model
from hrc_env.scene.rig import LAB_CAMERAS, CameraConfig, glcam_axes, make_cameras, select

NAMES = [camera.name for camera in LAB_CAMERAS]


def test_four_cameras_hang_in_the_corners_and_all_are_on_by_default():
    assert [camera.name for camera in select(LAB_CAMERAS)] == NAMES
    assert len({camera.eye_world for camera in LAB_CAMERAS}) == 4


def test_cameras_are_chosen_by_name_or_index_in_the_order_given():
    chosen = select(LAB_CAMERAS, ("camera_3", 0))
    assert [camera.name for camera in chosen] == ["camera_3", "camera_1"]


@pytest.mark.parametrize("index", [4, -1])
def test_an_index_outside_the_rig_is_told_the_valid_ones(index):
    with pytest.raises(ConfigError, match=r"camera_4.* 0 to 3"):
        select(LAB_CAMERAS, (index,))


def test_a_misspelt_name_is_told_the_nearest():
    with pytest.raises(ConfigError, match=r"Did you mean 'camera_2'\?"):
        select(LAB_CAMERAS, ("camera2",))


def test_no_camera_at_all_is_refused():
    with pytest.raises(ConfigError, match="at least one camera"):
        select(LAB_CAMERAS, ())


def test_a_camera_chosen_twice_is_refused():
    with pytest.raises(ConfigError, match="more than once"):
        select(LAB_CAMERAS, (1, "camera_2"))


def test_two_cameras_of_one_name_are_refused():
    twins = (CameraConfig("a", (1, 1, 2)), CameraConfig("a", (2, 1, 2)))
    with pytest.raises(ConfigError, match="unique"):
        select(twins)


def test_mujocos_camera_has_the_axes_of_the_pinhole_turned_to_opengl():
    scene = build(cameras=("camera_2", "camera_4"))
    model = drawing_model(scene)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for camera in scene.cameras:
        axes = data.camera(camera.name).xmat.reshape(3, 3)
        np.testing.assert_allclose(axes, glcam_axes(camera), atol=1e-9)
        np.testing.assert_allclose(axes[:, 1], -camera.T_world_from_cam[:3, 1], atol=1e-9)
        np.testing.assert_allclose(data.camera(camera.name).xpos, camera.eye_world)


def test_every_camera_has_the_shared_workspace_in_view():
    for camera in make_cameras(LAB_CAMERAS):
        ahead = np.array([0.0, 0.0, 1.1]) - camera.eye_world
        assert ahead @ camera.T_world_from_cam[:3, 2] > 1.0
