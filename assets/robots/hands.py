"""What is bolted to the flange: a screwdriver, a gripper with two parallel fingers, or four cups.

Lengths in metres, in the frame of the flange, whose z points away from the arm.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco

from assets.robots.ur10e_looks import LOOKS
from assets.scenes.primitives import box, cylinder, ellipsoid
from hrc_env.scene.primitives import ROBOT_LOOKS, capsule

FINGERS = ("finger_left", "finger_right")
STROKE_M, FINGER_KG = 0.055, 0.12
"""Way of each finger from closed to open."""
PAD_M, PADS_END_M = (0.012, 0.032, 0.052), 0.191
"""Edges of the pads that touch what is gripped; where they end, 26 mm beyond the tool point."""
GRIP_KP, GRIP_KV, GRIP_N = 20000.0, 160.0, 280.0
"""Servo of the opening [N/m, N s/m]; both fingers together press with so much at most."""


@dataclass(frozen=True, slots=True)
class Hand:
    """A tool."""

    length_m: float
    """From the flange to the tool point."""
    before_m: float
    radius_m: float
    """Its capsule's axis ends so far before that, and is so thick."""
    mass_kg: float
    inertia_kgm2: tuple[float, float, float]
    build: Callable[[Any], None]
    """Adds its parts to the body at the flange,"""
    drive: Callable[[Any], None]
    """and its motors to the model, after the arm's."""


def _add_screwdriver(tool: Any) -> None:
    """Adapter, motor shell with a grip ring, chuck, bit."""
    length = 0.15
    cylinder(tool, (0, 0, 0), (0, 0, 0.012), 0.040, "arm_steel", **LOOKS)
    cylinder(tool, (0, 0, 0.012), (0, 0, 0.022), 0.034, "arm_black", **LOOKS)
    cylinder(tool, (0, 0, 0.022), (0, 0, 0.074), 0.033, "tool_shell", **LOOKS)
    cylinder(tool, (0, 0, 0.040), (0, 0, 0.046), 0.0338, "arm_black", **LOOKS)
    ellipsoid(tool, (0, 0, 0.074), (0.033, 0.033, 0.014), "tool_shell", **LOOKS)
    box(tool, (0.031, 0, 0.050), (0.022, 0.030, 0.046), "arm_dark", **LOOKS)
    cylinder(tool, (0, 0, 0.080), (0, 0, 0.104), 0.018, "arm_dark", **LOOKS)
    cylinder(tool, (0, 0, 0.104), (0, 0, 0.116), 0.011, "arm_steel", **LOOKS)
    cylinder(tool, (0, 0, 0.116), (0, 0, length - 0.006), 0.005, "arm_steel", **LOOKS)
    cylinder(tool, (0, 0, length - 0.006), (0, 0, length), 0.0032, "arm_black", **LOOKS)


def _add_gripper(tool: Any) -> None:
    """A body as wide as the fingers' way, and the fingers, which slide along x."""
    cylinder(tool, (0, 0, 0), (0, 0, 0.014), 0.040, "arm_steel", **LOOKS)
    cylinder(tool, (0, 0, 0.014), (0, 0, 0.022), 0.036, "arm_black", **LOOKS)
    box(tool, (0, 0, 0.054), (0.086, 0.070, 0.064), "tool_shell", **LOOKS)
    box(tool, (0, 0, 0.094), (0.150, 0.060, 0.020), "arm_dark", **LOOKS)
    box(tool, (0, 0.0352, 0.056), (0.050, 0.0015, 0.030), "arm_black", **LOOKS)
    cylinder(tool, (0.043, 0, 0.050), (0.058, 0, 0.050), 0.008, "arm_black", **LOOKS)
    capsule(
        tool, (-0.075, 0, 0.150), (0.075, 0, 0.150), 0.022, name="fingers",
        group=3, density=0, contype=0, conaffinity=0, rgba=[1.0, 0.4, 0.3, 0.4],
    )  # fmt: skip
    for name, sign in zip(FINGERS, (1.0, -1.0), strict=True):
        _add_finger(tool, name, sign)


def _add_finger(tool: Any, name: str, sign: float) -> None:
    """One that opens along `sign` x; at 0 its pad is in the middle."""
    finger = tool.add_body(name=name, gravcomp=1)
    finger.explicitinertial = 1
    finger.mass, finger.ipos = FINGER_KG, [0.02 * sign, 0, 0.14]
    finger.inertia = [1e-4, 1e-4, 4e-5]
    finger.add_joint(
        name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[sign, 0, 0], limited=1,
        range=[0.0, STROKE_M], armature=0.1, damping=2.0,
    )  # fmt: skip
    thick, wide, tall = PAD_M
    middle = sign * thick / 2, 0.0, PADS_END_M - tall / 2
    box(finger, (sign * 0.018, 0, 0.118), (0.022, 0.040, 0.030), "arm_dark", **LOOKS)
    box(finger, (sign * 0.016, 0, 0.140), (0.014, 0.026, 0.080), "arm_steel", **LOOKS)
    box(finger, middle, (0.98 * thick, 0.98 * wide, 0.98 * tall), "arm_black", **LOOKS)
    finger.add_geom(
        name=f"{name}_pad", type=mujoco.mjtGeom.mjGEOM_BOX, pos=middle, group=ROBOT_LOOKS + 1,
        size=[thick / 2, wide / 2, tall / 2], density=0, condim=4, priority=1,
        friction=[1.0, 0.02, 0.0005], solref=[0.008, 1.0], solimp=[0.95, 0.99, 0.001, 0.5, 2.0],
        rgba=[0.4, 1.0, 0.3, 0.4],
    )  # fmt: skip


def _drive_gripper(spec: Any) -> None:
    """One motor closes both fingers, which are coupled; its command is their opening [m]."""
    left, right = FINGERS
    spec.add_equality(
        type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name="fingers",
        name1=left, name2=right, data=[0.0, 1.0, *[0.0] * 10], solref=[0.008, 1.0],
    )  # fmt: skip
    tendon = spec.add_tendon(name="opening")
    for name in FINGERS:
        tendon.wrap_joint(name, 0.5)
    motor = spec.add_actuator(name="grip", target="opening", trntype=mujoco.mjtTrn.mjTRN_TENDON)
    motor.set_to_position(kp=GRIP_KP, kv=GRIP_KV)
    motor.ctrllimited, motor.ctrlrange = 1, [0.0, STROKE_M]
    motor.forcelimited, motor.forcerange = 1, [-GRIP_N, GRIP_N]


CUPS_M, CUP_M = (0.13, 0.10), 0.045
"""Where the middles of the cups are, and how wide they are."""


def _add_cups(tool: Any) -> None:
    """A frame with a cup at each corner, whose rims end at the tool point; one box round all of
    them touches."""
    cylinder(tool, (0, 0, 0), (0, 0, 0.014), 0.040, "arm_steel", **LOOKS)
    cylinder(tool, (0, 0, 0.014), (0, 0, 0.060), 0.034, "tool_shell", **LOOKS)
    x, y = CUPS_M
    for side in (-1, 1):
        box(tool, (0, y * side, 0.068), (2 * x + 0.05, 0.03, 0.022), "arm_steel", **LOOKS)
        box(tool, (0.05 * side, 0, 0.066), (0.03, 2 * y, 0.020), "arm_steel", **LOOKS)
    for at in ((-x, -y), (-x, y), (x, -y), (x, y)):
        cylinder(tool, (*at, 0.074), (*at, 0.094), 0.016, "arm_dark", **LOOKS)
        cylinder(tool, (*at, 0.094), (*at, 0.104), 0.030, "arm_black", **LOOKS)
        cylinder(tool, (*at, 0.104), (*at, 0.112), CUP_M, "arm_black", **LOOKS)
    tool.add_geom(
        name="rims", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[0, 0, 0.107], density=0,
        size=[x + 0.8 * CUP_M, y + 0.8 * CUP_M, 0.005], group=ROBOT_LOOKS + 1,
        rgba=[0.4, 1.0, 0.3, 0.4],
    )  # fmt: skip
    capsule(
        tool, (-x, 0, 0.09), (x, 0, 0.09), 0.06, name="cups",
        group=3, density=0, contype=0, conaffinity=0, rgba=[1.0, 0.4, 0.3, 0.4],
    )  # fmt: skip


def _gauge_cups(spec: Any) -> None:
    """What hangs on the cups is felt at the flange."""
    spec.add_sensor(
        name="load", type=mujoco.mjtSensor.mjSENS_FORCE, objtype=mujoco.mjtObj.mjOBJ_SITE,
        objname="tool_point",
    )  # fmt: skip


SCREWDRIVER = Hand(
    0.15, 0.034, 0.034, 1.2, (0.0025, 0.0025, 0.0008), _add_screwdriver, lambda spec: None
)
GRIPPER = Hand(0.165, 0.1, 0.048, 0.9, (0.0030, 0.0026, 0.0016), _add_gripper, _drive_gripper)
CUPS = Hand(0.112, 0.05, 0.046, 1.1, (0.0060, 0.0075, 0.0120), _add_cups, _gauge_cups)
