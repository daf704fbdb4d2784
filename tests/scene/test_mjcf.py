"""The files of robots and scenes are all used, and agree where two of them say the same."""

from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from hrc_env.scene.build import SceneConfig, build, drawing_model, find_visuals
from hrc_env.scene.places import SCENES
from hrc_env.scene.primitives import SOLID
from hrc_env.scene.robot import BUILT_IN
from hrc_env.worker.body import assets_dir


def named(tag):
    """The values of `file` in elements of this name, in all scenes and robots."""
    paths = [path for part in ("robots", "scenes") for path in (assets_dir() / part).rglob("*.xml")]
    roots = [ElementTree.parse(path).getroot() for path in paths]
    return {each.get("file") for root in roots for each in root.iter(tag)} - {None}


def test_every_picture_is_on_something():
    stored = {path.name for path in (assets_dir() / "scenes" / "textures").iterdir()}
    assert stored == named("texture")


def test_every_file_is_a_model_or_part_of_one():
    included = named("include")
    for part in ("robots", "scenes"):
        folder = assets_dir() / part
        for path in folder.rglob("*.xml"):
            is_part = ElementTree.parse(path).getroot().tag == "mujocoinclude"
            assert (str(path.relative_to(folder).as_posix()) in included) == is_part, path


@pytest.mark.parametrize("clutter", [True, False])
@pytest.mark.parametrize("name", SCENES)
def test_the_pedestal_ends_where_the_robot_stands(name, clutter):
    head = build(SceneConfig(clutter=clutter), name).model.geom("pedestal_head")
    top = head.pos + np.array([0.0, 0.0, head.size[1]])
    np.testing.assert_allclose(top, SCENES[name].mount_world)


def test_every_camera_of_the_site_is_at_a_mast():
    model = drawing_model(build(name="site"))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for camera in SCENES["site"].cameras:
        assert np.linalg.norm(data.geom_xpos - camera.eye_world, axis=-1).min() < 0.2, camera.name


def test_every_thing_that_can_be_held_is_drawn():
    assert (find_visuals(build(n_workers=1)).props[0] >= 0).all()


@pytest.mark.parametrize(
    "robot", sorted(BUILT_IN, key=lambda robot: robot.name), ids=lambda robot: robot.name
)
def test_both_servos_of_a_joint_take_the_same_commands_and_hold_it_in_its_range(robot):
    model, n = build(robot=robot).model, len(robot.joints)
    hold, rate = slice(0, n), slice(n, 2 * n)
    np.testing.assert_array_equal(model.actuator_actrange[hold], model.jnt_range[:n])
    np.testing.assert_array_equal(model.actuator_ctrlrange[hold], model.actuator_ctrlrange[rate])


def specifications(*patterns):
    return [
        (path.name, mujoco.MjSpec.from_file(str(path)))
        for pattern in patterns
        for path in sorted(assets_dir().glob(pattern))
        if ElementTree.parse(path).getroot().tag == "mujoco"
    ]


def test_geoms_whose_place_is_read_before_they_are_compiled_have_one():
    for name, spec in specifications("scenes/*.xml", "tasks/*.xml"):
        for geom in spec.geoms:
            if name == "props.xml" or geom.contype or geom.group == SOLID:
                assert np.isnan(geom.fromto[0]), (name, geom.name)
                assert geom.alt.type == mujoco.mjtOrientation.mjORIENTATION_QUAT, (name, geom.name)
