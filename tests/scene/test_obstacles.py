"""Lines of sight through a scene are those that MuJoCo's rays find."""

import mujoco
import numpy as np
import pytest

from hrc_env.core.errors import HRCError
from hrc_env.geometry.chains import capsules
from hrc_env.geometry.shapes import WIDTH
from hrc_env.geometry.sight import NEAR_POINT_M, Surroundings, find_hidden
from hrc_env.scene.build import SceneConfig, build
from hrc_env.scene.places import find_obstacles
from hrc_env.scene.primitives import ROBOT_CAPSULES, SOLID

TIE_M = 1e-9
LAB = build()
EYES = np.stack([camera.eye_world for camera in LAB.cameras])
EMPTY = (np.zeros((1, 0, WIDTH)), np.zeros((1, 0, 2, 3)), np.zeros(0))
HIDING = np.isin(np.arange(mujoco.mjNGROUP), [SOLID, ROBOT_CAPSULES]).astype(np.uint8)


def by_mujoco(model, data, eyes, points):
    """(C, J) how much farther than the line of sight the first surface is [m]."""
    beyond = np.empty((len(eyes), len(points)))
    for c, j in np.ndindex(beyond.shape):
        ray = points[j] - eyes[c]
        length = np.linalg.norm(ray)
        geom = np.zeros(1, np.int32)
        far = mujoco.mj_ray(model, data, eyes[c], ray / length, HIDING, 1, -1, geom)
        beyond[c, j] = np.inf if far < 0 else far - (length - NEAR_POINT_M)
    return beyond


def assert_same(surroundings, model, data, eyes, points):
    beyond = by_mujoco(model, data, eyes, points)
    clear = np.abs(beyond) > TIE_M
    ours = find_hidden(surroundings, eyes, points[None])[0]
    np.testing.assert_array_equal(ours[clear], (beyond < 0)[clear])
    return ours.mean()


@pytest.mark.parametrize("clutter", [True, False])
def test_a_room_and_an_arm_in_any_pose_hide_what_rays_do_not_reach(clutter):
    scene, rng = build(SceneConfig(clutter=clutter)), np.random.default_rng(4)
    data, shares = mujoco.MjData(scene.model), []
    low, high = [-3.2, -2.9, -0.1], [3.2, 2.9, 2.7]
    for k in range(60):
        q = rng.uniform(-3, 3, (1, 6))
        data.qpos[:6] = q
        mujoco.mj_kinematics(scene.model, data)
        eyes = np.concatenate([EYES, rng.uniform(low, high, (3, 3))])
        worker = rng.uniform(low, high) + rng.uniform(-0.8, 0.8, (15, 3))
        points = worker if k % 2 else rng.uniform([-1.6, -1, 0], [0.8, 1, 1.8], (15, 3))
        shares.append(assert_same(scene.surroundings(q), scene.model, data, eyes, points))
    assert 0.05 < np.mean(shares) < 0.6


@pytest.mark.parametrize("kind", ["plane", "box", "cylinder", "capsule", "sphere"])
def test_every_kind_of_geom_hides_as_for_mujoco(kind):
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><geom type="{kind}" size="0.4 0.3 0.2" pos="0.1 0 0.2" '
        'euler="30 40 50"/></worldbody></mujoco>'
    )
    data, rng = mujoco.MjData(model), np.random.default_rng(6)
    mujoco.mj_kinematics(model, data)
    alone = Surroundings(find_obstacles(model), *EMPTY)
    eyes, points = rng.uniform(-1, 1, (40, 3)), rng.uniform(-1, 1, (60, 3))
    assert assert_same(alone, model, data, eyes, points) > 0.03


def test_what_cannot_be_asked_is_refused():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><geom name="egg" type="ellipsoid" size="1 2 3"/></worldbody></mujoco>'
    )
    with pytest.raises(HRCError, match="'egg' cannot block lines of sight"):
        find_obstacles(model)


def test_a_point_behind_the_pedestal_is_hidden_and_one_beside_it_is_not():
    points = np.array([[[-1.5, 0.0, 0.4], [-1.5, 0.5, 0.4]]])
    between = LAB.surroundings(LAB.home_q[None])
    seen = find_hidden(between, np.array([[2.0, 0.0, 0.4]]), points)
    np.testing.assert_array_equal(seen, [[[True, False]]])


def test_the_arm_hides_what_is_behind_it():
    elbow, aside = capsules(LAB.chain, LAB.home_q)[2].mean(0), np.array([0.0, 1.0, 0.0])
    eye, beyond = elbow - aside, elbow + aside
    assert find_hidden(LAB.surroundings(LAB.home_q[None]), eye[None], beyond[None, None]).all()


def test_what_a_joint_touches_does_not_hide_it():
    sole = np.array([[[1.0, 0.5, -0.02]]])
    assert not find_hidden(LAB.surroundings(LAB.home_q[None]), EYES[:1], sole).any()


def test_an_environment_has_the_same_lines_of_sight_in_any_company():
    rng = np.random.default_rng(2)
    q, points = rng.uniform(-2, 2, (4, 6)), rng.uniform(-1.5, 1.5, (4, 15, 3))
    ids = [1, 3]
    np.testing.assert_array_equal(
        find_hidden(LAB.surroundings(q), EYES, points)[ids],
        find_hidden(LAB.surroundings(q[ids]), EYES, points[ids]),
    )
