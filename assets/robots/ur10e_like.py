"""A UR10e-like arm: kinematics, masses, servos, capsules.

Lengths, limits, offsets and masses: the maker's public ROS description (ur_description,
UR10e). Body i has the axis of joint i as its z; the next body stands at Tz(d) Tx(a) Rx(alpha)
of it. The description's inertias are placeholders, so links carry explicit inertias of
the right order; the rotors' armature dominates them anyway.

Each joint has two servos on one command [rad/s]: one holds the integral of the command
(`intvelocity`, stiffness), one follows the command itself (`velocity`, damping). Measured
against one servo of either kind: 0.1 mm of tool error instead of 3-20, no sag under load.
"""

from typing import Any

import mujoco
import numpy as np

from assets.robots import hands
from assets.robots.ur10e_looks import add_arm_materials, add_base_looks, add_link_looks
from hrc_env.geometry.rotations import about_axis
from hrc_env.scene.primitives import (
    OBJECT_BIT,
    ROBOT_BIT,
    ROBOT_CAPSULES,
    SCENE_BIT,
    WORKER_BIT,
    capsule,
)

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")

HALF_TURN = np.pi / 2
DH_A_M = np.array([0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0])
DH_D_M = np.array([0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655])
DH_ALPHA_RAD = np.array([HALF_TURN, 0.0, 0.0, HALF_TURN, -HALF_TURN, 0.0])
RANGE_RAD = np.array([[-2.0, 2.0], [-2.0, 2.0], [-1.0, 1.0]] + [[-2.0, 2.0]] * 3) * np.pi
VELOCITY_LIMIT_RAD_S = np.radians([120.0, 120.0, 180.0, 180.0, 180.0, 180.0])
TORQUE_LIMIT_NM = np.array([330.0, 330.0, 150.0, 56.0, 56.0, 56.0])
MASS_KG = (7.369, 13.051, 3.989, 2.1, 1.98, 0.615)
CENTRE_OF_MASS_M = (
    (0.021, 0.0, 0.027), (0.38, 0.0, 0.158), (0.24, 0.0, 0.068),
    (0.0, 0.007, 0.018), (0.0, 0.007, 0.018), (0.0, 0.0, -0.026),
)  # fmt: skip
"""In the Denavit-Hartenberg frame of each link's far end."""
INERTIA_KGM2 = (
    (0.0341, 0.0353, 0.0216), (0.0281, 0.771, 0.769), (0.0101, 0.309, 0.307),
    (0.0030, 0.0022, 0.0026), (0.0030, 0.0022, 0.0026), (0.0004, 0.00041, 0.00034),
)  # fmt: skip
"""Principal moments about the centre of mass."""
ARMATURE_KGM2 = (2.0, 2.0, 1.0, 0.3, 0.3, 0.3)
STIFFNESS_NM_RAD = (20000.0, 20000.0, 10000.0, 3000.0, 3000.0, 3000.0)
DAMPING_NMS_RAD = (1400.0, 1400.0, 600.0, 150.0, 150.0, 150.0)

UPPER_ARM_OFFSET_M = 0.1762
FOREARM_OFFSET_M = 0.0393
"""How far the tubes stand to the side of their joints, along z."""

FLANGE = DH_D_M[5]

CAPSULES: tuple[tuple[str, int, tuple[float, ...], tuple[float, ...], float], ...] = (
    # The first starts above the pedestal, or it would touch it for ever.
    ("shoulder", 0, (0, 0, 0.095), (0, 0, DH_D_M[0]), 0.082),
    ("shoulder_lift", 1, (0, 0, 0), (0, 0, 0.186), 0.078),
    ("upper_arm", 1, (0, 0, UPPER_ARM_OFFSET_M), (DH_A_M[1], 0, UPPER_ARM_OFFSET_M), 0.066),
    ("elbow", 2, (0, 0, FOREARM_OFFSET_M), (0, 0, 0.166), 0.066),
    ("forearm", 2, (0, 0, FOREARM_OFFSET_M), (DH_A_M[2], 0, FOREARM_OFFSET_M), 0.054),
    ("wrist_1", 3, (0, 0, FOREARM_OFFSET_M), (0, 0, DH_D_M[3]), 0.053),
    ("wrist_2", 4, (0, 0, 0), (0, 0, DH_D_M[4]), 0.053),
    ("wrist_3", 5, (0, 0, -0.012), (0, 0, FLANGE - 0.045), 0.052),
)
"""(name, link, one end, other end, radius), link frame [m]."""

SELF_COLLISIONS = (
    *(("tool", other) for other in ("upper_arm", "shoulder", "shoulder_lift", "forearm")),
    ("wrist_2", "upper_arm"), ("wrist_2", "shoulder"), ("wrist_3", "upper_arm"),
)  # fmt: skip
"""The pairs of the arm's own capsules, and of its tool's, that can meet in its joint ranges."""


def add_arm(spec: Any, hand: hands.Hand = hands.SCREWDRIVER) -> None:
    """Build the arm, the middle of its foot at the origin; it reaches to +x, along its own -x."""
    add_arm_materials(spec)
    base = spec.worldbody.add_body(name="base", quat=[np.cos(HALF_TURN), 0, 0, np.sin(HALF_TURN)])
    add_base_looks(base)
    links = _add_links(base)
    tool = (
        "tool",
        5,
        (0, 0, FLANGE + 0.02),
        (0, 0, FLANGE + hand.length_m - hand.before_m),
        hand.radius_m,
    )
    for name, link, start, end, radius in (*CAPSULES, tool):
        _add_capsule(links[link], name, start, end, radius)
    for first, second in SELF_COLLISIONS:
        spec.add_pair(geomname1=first, geomname2=second, condim=3)
    _add_tool(links[-1], hand)
    _add_servos(spec)
    hand.drive(spec)


def _add_links(base: Any) -> list[Any]:
    links, parent = [], base
    pos, quat = np.zeros(3), np.array([1.0, 0, 0, 0])
    for i, (link_name, joint_name) in enumerate(zip(LINKS, JOINTS, strict=True)):
        link = parent.add_body(name=link_name, pos=pos, quat=quat, gravcomp=1)
        link.add_joint(
            name=joint_name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0, 0, 1],
            limited=1,
            range=RANGE_RAD[i],
            armature=ARMATURE_KGM2[i],
            actfrclimited=1,
            actfrcrange=[-TORQUE_LIMIT_NM[i], TORQUE_LIMIT_NM[i]],
        )
        pos = np.array([DH_A_M[i], 0.0, DH_D_M[i]])
        quat = np.array([np.cos(DH_ALPHA_RAD[i] / 2), np.sin(DH_ALPHA_RAD[i] / 2), 0.0, 0.0])
        link.explicitinertial = 1
        link.mass = MASS_KG[i]
        link.ipos = pos + about_axis("x", DH_ALPHA_RAD[i]) @ np.array(CENTRE_OF_MASS_M[i])
        link.iquat = quat
        link.inertia = INERTIA_KGM2[i]
        links.append(link)
        parent = link
    add_link_looks(*links)
    return links


def _add_capsule(link: Any, name: str, start: Any, end: Any, radius: float) -> None:
    capsule(
        link,
        start,
        end,
        radius,
        name=name,
        contype=ROBOT_BIT,
        conaffinity=SCENE_BIT | WORKER_BIT | OBJECT_BIT,
        group=ROBOT_CAPSULES,
        density=0,
        condim=3,
        friction=[0.5, 0.005, 0.0001],
        rgba=[1.0, 0.4, 0.3, 0.4],
    )


def _add_tool(wrist: Any, hand: hands.Hand) -> None:
    """What is bolted to the flange; its mass is compensated like the arm's."""
    tool = wrist.add_body(name="tool", pos=[0, 0, FLANGE], gravcomp=1)
    tool.explicitinertial = 1
    tool.mass, tool.ipos, tool.inertia = hand.mass_kg, [0, 0, 0.06], hand.inertia_kgm2
    hand.build(tool)
    tool.add_site(name="tool_point", pos=[0, 0, hand.length_m], size=[0.004] * 3, group=4)


def _add_servos(spec: Any) -> None:
    """All holding servos first (their integrated commands are `act`), then all rate servos."""
    for i, joint in enumerate(JOINTS):
        hold = spec.add_actuator(
            name=f"{joint}_hold", target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT
        )
        hold.set_to_intvelocity(kp=STIFFNESS_NM_RAD[i], kv=0.0)
        hold.actlimited, hold.actrange = 1, RANGE_RAD[i]
        _limit_command(hold, i)
    for i, joint in enumerate(JOINTS):
        rate = spec.add_actuator(
            name=f"{joint}_rate", target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT
        )
        rate.set_to_velocity(kv=DAMPING_NMS_RAD[i])
        _limit_command(rate, i)


def _limit_command(actuator: Any, joint: int) -> None:
    actuator.ctrllimited = 1
    actuator.ctrlrange = [-VELOCITY_LIMIT_RAD_S[joint], VELOCITY_LIMIT_RAD_S[joint]]
