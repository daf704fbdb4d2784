"""A chain of hinges and slides: frames, the tool point, its Jacobian, capsules."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrc_env.core.errors import ConfigError
from hrc_env.geometry import chains
from hrc_env.scene.build import build
from hrc_env.scene.robot import DEFAULT, ROBOTS, make_chain

ARM = replace(make_chain(ROBOTS[DEFAULT], (0.0, 0.0, 0.0)), T_world_from_base=np.eye(4))
FLANGE = replace(ARM, link_from_tool=np.eye(4) + 0.11655 * np.eye(4, k=1)[[3, 3, 2, 3]])
angles = st.lists(st.floats(-3, 3), min_size=6, max_size=6).map(np.array)


@pytest.mark.parametrize(
    ("q_deg", "flange_m"),
    [
        ((0, 0, 0, 0, 0, 0), (-1.18425, -0.2907, 0.06085)),
        ((0, -90, 0, -90, 0, 0), (0.0, -0.2907, 1.4848)),
        ((0, -90, 90, -90, -90, 0), (-0.6914, -0.17415, 0.67685)),
    ],
)
def test_the_flange_is_where_the_makers_table_has_it(q_deg, flange_m):
    reached = chains.tool_frame(FLANGE, np.radians(q_deg))[:3, 3]
    np.testing.assert_allclose(reached, flange_m, atol=1e-5)


@settings(max_examples=25, deadline=None)
@given(angles)
def test_numbers_and_mujoco_agree_on_every_link_and_capsule(q):
    scene = build()
    data = mujoco.MjData(scene.model)
    data.qpos[:6] = q
    mujoco.mj_kinematics(scene.model, data)
    frames = chains.link_frames(scene.chain, q)
    names = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
    for name, frame in zip(names, frames, strict=True):
        np.testing.assert_allclose(data.body(f"robot/{name}").xpos, frame[:3, 3], atol=1e-9)
        np.testing.assert_allclose(
            data.body(f"robot/{name}").xmat, frame[:3, :3].ravel(), atol=1e-9
        )
    middles = chains.capsules(scene.chain, q).mean(-2)
    for name, middle in zip(scene.robot.capsules, middles, strict=True):
        np.testing.assert_allclose(data.geom(f"robot/{name}").xpos, middle, atol=1e-9)
    tool = chains.tool_frame(scene.chain, q)[:3, 3]
    np.testing.assert_allclose(data.site("robot/tool_point").xpos, tool, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(angles)
def test_the_jacobian_is_the_tools_change_per_joint(q):
    step = 1e-6
    ahead = chains.tool_frame(ARM, q + step * np.eye(6))[:, :3, 3]
    behind = chains.tool_frame(ARM, q - step * np.eye(6))[:, :3, 3]
    np.testing.assert_allclose(chains.jacobian(ARM, q), (ahead - behind).T / (2 * step), atol=1e-7)


def test_robot_state_holds_the_tool_its_velocity_and_the_capsules():
    rng = np.random.default_rng(0)
    q, qd = rng.uniform(-2, 2, (2, 3, 6)), rng.uniform(-1, 1, (2, 3, 6))
    state = chains.robot_state(ARM, q, qd)
    np.testing.assert_allclose(state.tool_world, chains.tool_frame(ARM, q)[..., :3, 3])
    expected = np.einsum("...ij,...j->...i", chains.jacobian(ARM, q), qd)
    np.testing.assert_allclose(state.tool_velocity_world, expected, atol=1e-12)
    np.testing.assert_array_equal(state.capsules_world, chains.capsules(ARM, q))


def test_one_environment_and_many_give_the_same_bits():
    q = np.random.default_rng(1).uniform(-3, 3, (64, 6))
    whole = chains.robot_state(ARM, q, q)
    alone = chains.robot_state(ARM, q[17:18], q[17:18])
    np.testing.assert_array_equal(whole.tool_velocity_world[17], alone.tool_velocity_world[0])
    np.testing.assert_array_equal(whole.capsules_world[17], alone.capsules_world[0])


def test_a_base_that_is_moved_moves_everything_with_it():
    q = np.array([0.3, -1.2, 1.0, 0.4, -0.7, 2.0])
    T = np.eye(4)
    T[:3, 3] = 1.0, -2.0, 0.5
    moved = chains.link_frames(replace(ARM, T_world_from_base=T), q)
    np.testing.assert_allclose(moved, T @ chains.link_frames(ARM, q), atol=1e-12)


def test_too_few_angles_are_refused_with_the_number_that_is_expected():
    with pytest.raises(ConfigError, match=r"\(6,\)"):
        chains.link_frames(ARM, np.zeros(5))


BASE = make_chain(ROBOTS["mobile_base"], (0.0, 0.0, 0.0))
places = st.tuples(st.floats(-8, 8), st.floats(-8, 8), st.floats(-9, 9)).map(np.array)


@settings(max_examples=25, deadline=None)
@given(places)
def test_slides_and_mujoco_agree_on_the_base_and_its_capsules(q):
    scene = build(name="site", robot="mobile_base")
    data = mujoco.MjData(scene.model)
    data.qpos[:3] = q
    mujoco.mj_kinematics(scene.model, data)
    np.testing.assert_allclose(chains.tool_frame(scene.chain, q)[:2, 3], q[:2], atol=1e-9)
    tool = chains.tool_frame(scene.chain, q)[:3, 3]
    np.testing.assert_allclose(data.site("robot/load").xpos, tool, atol=1e-9)
    middles = chains.capsules(scene.chain, q).mean(-2)
    for name, middle in zip(scene.robot.capsules, middles, strict=True):
        np.testing.assert_allclose(data.geom(f"robot/{name}").xpos, middle, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(places)
def test_the_jacobian_of_slides_is_the_tools_change_per_metre(q):
    chain = replace(BASE, link_from_tool=BASE.link_from_tool.copy())
    chain.link_from_tool[0, 3] = 0.4  # ahead of the axis, so that turning moves it
    step = 1e-6
    ahead = chains.tool_frame(chain, q + step * np.eye(3))[:, :3, 3]
    behind = chains.tool_frame(chain, q - step * np.eye(3))[:, :3, 3]
    slope = (ahead - behind).T / (2 * step)
    np.testing.assert_allclose(chains.jacobian(chain, q), slope, atol=1e-7)
    np.testing.assert_allclose(chains.angular_jacobian(chain, q), [[0, 0, 0], [0, 0, 0], [0, 0, 1]])
    moving = chains.robot_state(chain, q, np.array([0.5, -0.2, 0.3]))
    np.testing.assert_allclose(moving.tool_velocity_world, slope @ [0.5, -0.2, 0.3], atol=1e-7)
    np.testing.assert_array_equal(BASE.slides, [True, True, False])
