"""The arm: what it weighs, where it ends, what it may touch."""

import mujoco
import numpy as np
import pytest

from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.scene.build import build, drawing_model
from hrc_env.scene.places import SCENES

SCENE = build()
HOME_Q = SCENE.home_q
MASS_KG = {
    "shoulder": 7.369, "upper_arm": 13.051, "forearm": 3.989,
    "wrist_1": 2.1, "wrist_2": 1.98, "wrist_3": 0.615,
}  # fmt: skip
TORQUE_LIMIT_NM = [330.0, 330.0, 150.0, 56.0, 56.0, 56.0]
"""Of the UR10e, from its maker's public ROS description (ur_description)."""


def at_home() -> mujoco.MjData:
    data = mujoco.MjData(SCENE.model)
    data.qpos[:] = HOME_Q
    data.act[:] = HOME_Q
    mujoco.mj_forward(SCENE.model, data)
    return data


def test_at_home_the_tool_is_in_front_of_the_base_points_down_and_touches_nothing():
    data = at_home()
    tool = data.site("robot/tool_point")
    assert tool.xpos[0] - SCENES["lab"].mount_world[0] > 0.3
    np.testing.assert_allclose(tool.xmat.reshape(3, 3)[:, 2], [0, 0, -1], atol=1e-2)
    assert data.ncon == 0


def test_links_weigh_what_the_maker_says():
    masses = [SCENE.model.body(f"robot/{name}").mass[0] for name in MASS_KG]
    np.testing.assert_allclose(masses, list(MASS_KG.values()))


def test_looks_weigh_nothing():
    assert drawing_model(SCENE).body_mass.sum() == pytest.approx(SCENE.model.body_mass.sum())


def test_the_arm_does_not_sag():
    data = at_home()
    for _ in range(250):
        mujoco.mj_step(SCENE.model, data)
    np.testing.assert_allclose(data.qpos, HOME_Q, atol=1e-6)


def test_each_joint_has_a_holding_and_a_rate_servo_and_a_torque_limit():
    names = [SCENE.model.actuator(i).name for i in range(SCENE.model.nu)]
    assert names == [f"robot/{j}_{kind}" for kind in ("hold", "rate") for j in SCENE.robot.joints]
    np.testing.assert_allclose(SCENE.model.jnt_actfrcrange[:, 1], TORQUE_LIMIT_NM)


def test_the_last_capsule_ends_at_the_tool_point():
    ends = chains.capsules(SCENE.chain, HOME_Q)[-1]
    tool = chains.tool_frame(SCENE.chain, HOME_Q)[:3, 3]
    radius = SCENE.chain.capsule_radius_m[-1]
    assert np.linalg.norm(tool - ends[1]) == pytest.approx(radius)


def test_a_folded_arm_touches_itself():
    data = mujoco.MjData(SCENE.model)
    data.qpos[:] = [0.0, -1.57, 2.9, 0.0, 0.0, 0.0]
    mujoco.mj_forward(SCENE.model, data)
    own = {f"robot/{name}" for name in SCENE.robot.capsules}
    touching = [
        {SCENE.model.geom(contact.geom1).name, SCENE.model.geom(contact.geom2).name}
        for contact in data.contact[: data.ncon]
    ]
    assert any(pair <= own for pair in touching)


def test_mujoco_and_the_geometry_room_agree_on_the_gap_between_tool_and_upper_arm():
    data = at_home()
    ends, radius = chains.capsules(SCENE.chain, HOME_Q), SCENE.chain.capsule_radius_m
    names = SCENE.robot.capsules
    first, second = names.index("tool"), names.index("upper_arm")
    fromto = np.zeros(6)
    expected = mujoco.mj_geomDistance(
        SCENE.model, data, SCENE.model.geom("robot/tool").id,
        SCENE.model.geom("robot/upper_arm").id, 5.0, fromto,
    )  # fmt: skip
    gap = least_separation(ends[[first]], radius[[first]], ends[[second]], radius[[second]])
    assert float(gap.distance_m) == pytest.approx(expected, abs=1e-6)
