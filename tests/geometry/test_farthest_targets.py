"""How far an arm gets is worked out by hand here, and is where spots begin to be refused."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.geometry.chains import SerialChain
from hrc_env.geometry.reach import ReachTarget, Triple, check_reach
from hrc_env.scene.build import build
from hrc_env.scene.robot import Robot, make_chain
from hrc_env.world import FOOT_WORLD

FOOT = (0.1, -0.2, 0.3)
UPPER_ARM_M, FOREARM_M = 0.5, 0.3
TOOL_M = np.array([0.3, 0.04, 0.12])
"""Of the test's own arms: from the last joint to the tool point, which points along the first."""
ACROSS_M = float(np.hypot(0.04, 0.12))
DIAGONAL = (0.48, -0.6, 0.64)
WAYS = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), DIAGONAL)


def arm_of(*ranges_rad: tuple[float, float], slide: bool = False) -> SerialChain:
    """Return an arm that turns, then lifts and bends as often as there are ranges left."""
    joints, ends, servos, names = "", "", {"intvelocity": "", "velocity": ""}, []
    at_m = (0.1, 0.2, UPPER_ARM_M, FOREARM_M)
    for k, (low, high) in enumerate(ranges_rad):
        kind, axis = "hinge", "0 1 0" if k else "0 0 1"
        if slide and k == len(ranges_rad) - 1:
            kind = "slide"
        joints += (
            f'<body pos="0 0 {at_m[k]}"><inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/>'
            f'<joint name="j{k}" type="{kind}" axis="{axis}" range="{low} {high}"/>'
        )
        ends, names = ends + "</body>", [*names, f"j{k}"]
        servos["intvelocity"] += (
            f'<intvelocity joint="j{k}" kp="9" actrange="{low} {high}" ctrlrange="-1 1"/>'
        )
        servos["velocity"] += f'<velocity joint="j{k}" kv="9" ctrlrange="-1 1"/>'
    tip = (
        f'<site name="tip" pos="{" ".join(map(str, TOOL_M))}" xyaxes="0 0 1 0 -1 0"/>'
        '<geom name="rod" type="capsule" size=".01" fromto="0 0 0 0 0 .1"/>'
    )
    text = (
        f'<mujoco><compiler angle="radian"/><worldbody>{joints}{tip}{ends}</worldbody>'
        f"<actuator>{''.join(servos.values())}</actuator></mujoco>"
    )
    home = tuple(low for low, _ in ranges_rad)
    return make_chain(Robot("own", text, tuple(names), ("rod",), (), "tip", home, home), FOOT)


def farthest_m(chain: SerialChain, shoulder: Triple, way: Triple, **spot: object) -> float:
    """Return how far from the shoulder, in one direction, the last spot is that is not refused."""
    low, high = 0.0, 4.0
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        at = np.array(shoulder) + middle * np.array(way)
        try:
            check_reach("T-v0", "own", chain, [ReachTarget("it", at, **spot)])
            low = middle
        except ConfigError:
            high = middle
    return low


FREE, HALF = (-2.5, 2.5), 0.5 * np.pi
SHOULDER = (0.1, -0.2, 0.6)  # of two links; the foot is 0.3 m high
THREE, FOUR = arm_of(FREE, FREE, FREE), arm_of(FREE, FREE, FREE, FREE)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("along", "expected_m"),
    [
        (0, UPPER_ARM_M + float(np.linalg.norm(TOOL_M))),  # any way
        (1, UPPER_ARM_M + ACROSS_M + 0.3),  # as the arm is stretched out
        (-1, UPPER_ARM_M + ACROSS_M - 0.3),  # back to the arm
    ],
)
def test_a_spot_is_as_far_as_links_and_tool_are_long(way, along, expected_m):
    given = {"along_world": tuple(along * np.array(way))} if along else {}
    assert farthest_m(THREE, SHOULDER, way, **given) == pytest.approx(expected_m, abs=1e-6)
    near = farthest_m(THREE, SHOULDER, way, within_m=0.07, **given)
    assert near == pytest.approx(expected_m + 0.07, abs=1e-6)


@pytest.mark.parametrize(
    ("way", "along"), [(WAYS[0], WAYS[2]), (WAYS[1], WAYS[0]), (DIAGONAL, (0.8, 0.0, -0.6))]
)
def test_a_tool_that_points_across_takes_the_wrist_aside(way, along):
    expected_m = np.sqrt((UPPER_ARM_M + ACROSS_M) ** 2 - 0.3**2)
    assert np.dot(way, along) == pytest.approx(0.0)
    far_m = farthest_m(THREE, SHOULDER, way, along_world=along)
    assert far_m == pytest.approx(expected_m, abs=1e-6)


def bent_m(angle_rad: float) -> float:
    """Return how far apart the ends of upper arm and forearm are (law of cosines)."""
    inside = np.cos(np.pi - angle_rad)
    return float(np.sqrt(0.5**2 + 0.3**2 - 2 * UPPER_ARM_M * FOREARM_M * inside))


@pytest.mark.parametrize(
    ("elbow_rad", "expected_m"),
    [
        (FREE, UPPER_ARM_M + FOREARM_M),
        ((-0.1, 0.0), UPPER_ARM_M + FOREARM_M),
        ((0.0, 0.1), UPPER_ARM_M + FOREARM_M),
        ((-2.5, -0.3), bent_m(HALF)),
        ((0.3, 2.5), bent_m(HALF)),
        ((0.4, 1.1), bent_m(0.4)),
        ((-1.2, -0.7), bent_m(0.7)),
        ((2.0, 3.2), bent_m(np.pi)),
        ((HALF, 1.6), bent_m(HALF)),
        ((-1.6, -HALF), bent_m(HALF)),
    ],
)
def test_an_elbow_stretches_as_far_as_it_may(elbow_rad, expected_m):
    """At a right angle if it comes to one, else at an end of its range."""
    chain = arm_of(FREE, FREE, elbow_rad, FREE)
    far_m = farthest_m(chain, SHOULDER, DIAGONAL)
    assert far_m == pytest.approx(expected_m + float(np.linalg.norm(TOOL_M)), abs=1e-6)


@pytest.mark.parametrize(("n_joints", "foot_m"), [(1, 0.4), (2, 0.6)])
def test_a_short_arm_gets_as_far_as_its_tool(n_joints, foot_m):
    chain = arm_of(*[FREE] * n_joints)
    far_m = farthest_m(chain, (0.1, -0.2, foot_m), DIAGONAL)
    assert far_m == pytest.approx(np.linalg.norm(TOOL_M), abs=1e-6)


def test_a_spot_that_is_just_as_far_is_taken():
    """Of an arm of one joint, with its tool point on it, this is the joint itself."""
    chain = replace(arm_of(FREE), link_from_tool=np.eye(4))
    x, y, z = chain.T_world_from_base[:3, 3] + [0.0, 0.0, 0.1]
    check_reach("T-v0", "own", chain, [ReachTarget("it", (x, y, z))])
    with pytest.raises(ConfigError, match="out of reach"):
        check_reach("T-v0", "own", chain, [ReachTarget("it", (x, y, z + 1e-12))])


def test_of_what_slides_nothing_is_said():
    """Even where only one joint does."""
    chain = arm_of(FREE, FREE, (0.0, 3.0), slide=True)
    assert farthest_m(chain, SHOULDER, DIAGONAL) == pytest.approx(4.0)


def test_one_spot_of_several_is_enough_and_is_told():
    x, y, z = SHOULDER
    near, far = ReachTarget("a", (x, y, z)), ReachTarget("b", (x, y, z + 2.0))
    check_reach("T-v0", "own", FOUR, [near, near])
    check_reach("T-v0", "own", FOUR, [])
    for spots in ((near, far), (far, near)):
        with pytest.raises(ConfigError, match=r"T-v0: b at \(0\.10, -0\.20, 2\.60\) m is out of"):
            check_reach("T-v0", "own", FOUR, spots)


REACH_M = float(np.hypot(0.6127 + 0.57155 + 0.11985, 0.17415))
"""Of a UR10e from its second joint to its last one, by its data sheet."""


@pytest.mark.parametrize("way", [WAYS[0], DIAGONAL])
@pytest.mark.parametrize("name", ["ur10e_like", "ur10e_gripper", "ur10e_cups"])
def test_the_packages_arms_get_as_far_as_the_data_sheet_and_the_tool_say(name, way):
    """MuJoCo says where the last joint is as the tool sees it."""
    scene = build(robot=name)
    data = mujoco.MjData(scene.model)
    data.qpos[:6] = 0.3, -1.1, 0.7, -0.4, 1.3, 0.2
    mujoco.mj_kinematics(scene.model, data)
    tool = data.site(f"robot/{scene.robot.tool_site}")
    last = data.joint(f"robot/{scene.robot.joints[-1]}").xanchor
    wrist = tool.xmat.reshape(3, 3).T @ (last - tool.xpos)
    shoulder = tuple(FOOT_WORLD + np.array([0.0, 0.0, 0.1807]))
    stretched = REACH_M + np.hypot(*wrist[:2]) - wrist[2]
    assert farthest_m(scene.chain, shoulder, way, along_world=way) == pytest.approx(
        stretched, abs=1e-6
    )
    assert farthest_m(scene.chain, shoulder, way) == pytest.approx(
        REACH_M + np.linalg.norm(wrist), abs=1e-6
    )
