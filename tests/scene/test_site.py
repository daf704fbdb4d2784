"""The construction site: its cameras, and poses in which its arm touches nothing."""

import mujoco
import numpy as np
import pytest

from hrc_env.geometry.chains import capsules
from hrc_env.scene.build import SceneConfig, build, drawing_model
from hrc_env.scene.places import SCENES
from hrc_env.scene.rig import CameraConfig
from hrc_env.scene.robot_chain import capsule_reach_m

SITE = build(name="site")
EYES = np.stack([camera.eye_world for camera in SITE.cameras])


def test_four_cameras_hang_in_the_corners_at_five_metres():
    assert EYES.shape == (4, 3)
    np.testing.assert_allclose(np.abs(EYES), np.tile([9.6, 9.6, 5.0], (4, 1)))


def test_other_cameras_can_hang_there():
    config = SceneConfig(cameras=(CameraConfig("mine", (0.0, -8.0, 4.0)),))
    assert [camera.name for camera in build(config, "site").cameras] == ["mine"]


def test_the_arm_never_reaches_beyond_the_reach_that_its_pairs_allow_for():
    """Contacts are only looked for within `reach_m`; no pose goes farther."""
    chain, rng = SITE.chain, np.random.default_rng(4)
    low, high = chain.range_rad.T
    q = rng.uniform(low, high, (4000, 6))
    ends = capsules(chain, q) - chain.T_world_from_base[:3, 3]
    farthest = np.linalg.norm(ends, axis=-1).max((0, 2)) + chain.capsule_radius_m
    assert (farthest <= capsule_reach_m(chain) + 1e-9).all()


@pytest.mark.parametrize("scene", SCENES)
def test_what_is_said_to_be_out_of_reach_is_met_in_no_pose(scene):
    place = build(name=scene, n_workers=0)
    model = drawing_model(place)
    data, rng = mujoco.MjData(model), np.random.default_rng(5)
    pairs = [(model.geom(f"robot/{a}").id, model.geom(b).id) for a, b in place.robot.never_touch]
    for q in rng.uniform(*place.chain.range_rad.T, (4000, 6)):
        data.qpos[:6] = q
        mujoco.mj_kinematics(model, data)
        gaps_m = [mujoco.mj_geomDistance(model, data, *pair, 1.0, None) for pair in pairs]
        assert min(gaps_m) > 0.01
