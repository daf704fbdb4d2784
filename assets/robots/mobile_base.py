"""A site carrier: a low base on four mecanum wheels, a stack of studs strapped to its bed.

Mecanum wheels drive it to any side and turn it at once, which is what two slides and a hinge are:
its joints are x and y of its middle in the world [m], and its yaw [rad]. Each has the two servos
of the arm's joints. Lengths in metres; its front looks to its +x, the floor is z = 0.
"""

from typing import Any

import mujoco
import numpy as np

from assets.scenes.primitives import box, cylinder, ellipsoid
from hrc_env.scene.primitives import ROBOT_CAPSULES, ROBOT_LOOKS, capsule

LOOKS = {"group": ROBOT_LOOKS}
JOINTS = ("drive_x", "drive_y", "turn")
ROOM_M, TURNS_RAD = 9.2, 6 * np.pi
"""How far the middle may be from the world's, along x and along y; how far it may turn."""
SPEED_M_S, TURN_RAD_S = 1.5, 1.2
BASE_KG, LOAD_KG = 120.0, 60.0
FORCE_N, TORQUE_NM = 600.0, 200.0
"""With which wheels push the base along and round at most."""
STIFFNESS, DAMPING = (12000.0, 12000.0, 3000.0), (3000.0, 3000.0, 520.0)
"""Of the servos [N/m, N m/rad; N s/m, N m s/rad]: critical for 180 kg."""
LENGTH_M, WIDTH_M, DECK_M = 1.0, 0.72, 0.36
"""Outline, wheels included; height of the bed."""
WHEEL_RADIUS_M, WHEEL_WIDTH_M, AXLE_M = 0.135, 0.12, 0.32
"""Wheels, and how far ahead and behind their axles are."""
LOAD_M = (0.88, 0.60, 0.33)
"""Edges of the stack with its bearers."""
MAST_M = (-0.47, 0.325, 1.12)
"""Where the mast with the warning light ends."""

CAPSULES: tuple[tuple[str, tuple[float, ...], tuple[float, ...], float], ...] = (
    ("side_left", (-0.33, 0.19, 0.20), (0.33, 0.19, 0.20), 0.17),
    ("side_right", (-0.33, -0.19, 0.20), (0.33, -0.19, 0.20), 0.17),
    ("load_left", (-0.30, 0.14, 0.54), (0.30, 0.14, 0.54), 0.16),
    ("load_right", (-0.30, -0.14, 0.54), (0.30, -0.14, 0.54), 0.16),
    ("load_front", (0.0, 0.0, 0.54), (0.25, 0.0, 0.54), 0.16),
    ("load_back", (0.0, 0.0, 0.54), (-0.25, 0.0, 0.54), 0.16),
    ("mast", (*MAST_M[:2], 0.40), MAST_M, 0.035),
)
"""(name, one end, other end, radius) in the frame of the base."""

MATERIALS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "carrier_yellow": ((0.95, 0.72, 0.08), 0.45, 0.5),
    "carrier_dark": ((0.16, 0.17, 0.19), 0.35, 0.3),
    "carrier_black": ((0.05, 0.05, 0.055), 0.2, 0.2),
    "carrier_steel": ((0.70, 0.72, 0.74), 0.8, 0.7),
    "carrier_roller": ((0.24, 0.24, 0.25), 0.15, 0.15),
    "carrier_light": ((1.0, 0.52, 0.06), 0.8, 0.8),
    "carrier_lamp": ((0.92, 0.96, 1.0), 0.8, 0.8),
    "carrier_stud": ((0.86, 0.70, 0.47), 0.08, 0.1),
    "carrier_end": ((0.70, 0.50, 0.30), 0.05, 0.1),
    "carrier_strap": ((0.12, 0.30, 0.52), 0.2, 0.2),
}
"""Name: colour, specular, shininess."""


def add_mobile_base(spec: Any) -> None:
    """Build it, the middle between its wheels over the origin."""
    for name, (colour, specular, shininess) in MATERIALS.items():
        spec.add_material(name=name, rgba=[*colour, 1], specular=specular, shininess=shininess)
    base = _add_links(spec.worldbody)
    _add_chassis(base)
    for front in (-1, 1):
        for side in (-1, 1):
            _add_wheel(base, front * AXLE_M, side, front * side)
    _add_load(base)
    _add_mast(base)
    for name, start, end, radius in CAPSULES:
        capsule(
            base, start, end, radius, name=name, group=ROBOT_CAPSULES, density=0, condim=3,
            friction=[0.4, 0.005, 0.0001], rgba=[1.0, 0.4, 0.3, 0.4],
        )  # fmt: skip
    base.add_site(name="load", pos=[0, 0, DECK_M + LOAD_M[2] / 2], size=[0.004] * 3, group=4)
    _add_servos(spec)


def _add_links(world: Any) -> Any:
    """Slides along x and y, then the base itself, which turns."""
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    axes = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    ranges, forces = (ROOM_M, ROOM_M, TURNS_RAD), (FORCE_N, FORCE_N, TORQUE_NM)
    link = world
    for k, joint in enumerate(JOINTS):
        link = link.add_body(name="base" if joint == "turn" else f"{joint}_link")
        link.add_joint(
            name=joint, type=hinge if joint == "turn" else slide, axis=axes[k], limited=1,
            range=[-ranges[k], ranges[k]], actfrclimited=1, actfrcrange=[-forces[k], forces[k]],
        )  # fmt: skip
        link.explicitinertial = 1
        link.mass, link.ipos, link.inertia = 0.1, [0, 0, 0], [1e-3] * 3
    mass = BASE_KG + LOAD_KG
    length, width, height = LENGTH_M**2, WIDTH_M**2, 0.7**2
    link.mass, link.ipos = mass, [0, 0, 0.32]
    turning = width + height, length + height, length + width
    link.inertia = [mass / 12 * each for each in turning]
    return link


def _add_servos(spec: Any) -> None:
    """All holding servos first (their integrated commands are `act`), then all rate servos."""
    speeds, ends = (SPEED_M_S, SPEED_M_S, TURN_RAD_S), (ROOM_M, ROOM_M, TURNS_RAD)
    for suffix in ("hold", "rate"):
        for k, joint in enumerate(JOINTS):
            servo = spec.add_actuator(
                name=f"{joint}_{suffix}", target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT
            )
            if suffix == "hold":
                servo.set_to_intvelocity(kp=STIFFNESS[k], kv=0.0)
                servo.actlimited, servo.actrange = 1, [-ends[k], ends[k]]
            else:
                servo.set_to_velocity(kv=DAMPING[k])
            servo.ctrllimited, servo.ctrlrange = 1, [-speeds[k], speeds[k]]


def _add_chassis(base: Any) -> None:
    """A frame between the wheels, skirts, bumpers, lamps, and the bed with its rails."""
    inner = WIDTH_M - 2 * WHEEL_WIDTH_M - 0.03
    box(base, (0, 0, 0.19), (0.92, inner, 0.20), "carrier_dark", **LOOKS)
    box(base, (0, 0, 0.305), (0.96, WIDTH_M - 0.02, 0.05), "carrier_yellow", **LOOKS)
    box(base, (0, 0, DECK_M - 0.015), (0.98, WIDTH_M, 0.03), "carrier_dark", **LOOKS)
    for end in (-1, 1):
        box(base, (end * 0.47, 0, 0.20), (0.03, inner, 0.15), "carrier_yellow", **LOOKS)
        box(base, (end * 0.49, 0, 0.105), (0.02, inner + 0.16, 0.05), "carrier_black", **LOOKS)
        box(base, (end * 0.475, 0, DECK_M + 0.02), (0.03, WIDTH_M, 0.04), "carrier_yellow", **LOOKS)
        for side in (-1, 1):
            lamp = end * 0.487, side * 0.15, 0.225
            box(
                base,
                lamp,
                (0.006, 0.09, 0.03),
                "carrier_lamp" if end > 0 else "carrier_light",
                **LOOKS,
            )
            foot = end * 0.45, side * 0.315, 0.085
            cylinder(base, foot, (*foot[:2], 0.15), 0.03, "carrier_black", **LOOKS)
        stripes = np.linspace(-0.22, 0.22, 6)
        for y in stripes.tolist():
            box(base, (end * 0.4865, y, 0.275), (0.004, 0.035, 0.03), "carrier_black", **LOOKS)
    for side in (-1, 1):
        box(
            base,
            (0, side * (WIDTH_M / 2 - 0.05), 0.20),
            (0.30, 0.07, 0.17),
            "carrier_dark",
            **LOOKS,
        )
        box(
            base,
            (0, side * (WIDTH_M / 2 - 0.013), 0.21),
            (0.20, 0.006, 0.09),
            "carrier_steel",
            **LOOKS,
        )


def _add_wheel(base: Any, x: float, side: int, slant: int) -> None:
    """A hub and eight rollers that stand at 45 degrees to its axle."""
    y = side * (WIDTH_M / 2 - WHEEL_WIDTH_M / 2)
    hub = WHEEL_RADIUS_M - 0.035
    ends = (x, y - 0.045, WHEEL_RADIUS_M), (x, y + 0.045, WHEEL_RADIUS_M)
    cylinder(base, *ends, hub, "carrier_steel", **LOOKS)
    outer = y + side * 0.046
    cylinder(
        base, (x, outer, WHEEL_RADIUS_M), (x, outer + side * 0.012, WHEEL_RADIUS_M), 0.045,
        "carrier_yellow", **LOOKS,
    )  # fmt: skip
    for angle in np.linspace(0, 2 * np.pi, 8, endpoint=False):
        out = np.array([np.cos(angle), 0.0, np.sin(angle)])
        round_ = np.array([-np.sin(angle), 0.0, np.cos(angle)])
        middle = np.array([x, y, WHEEL_RADIUS_M]) + out * (WHEEL_RADIUS_M - 0.028)
        along = 0.052 * (np.array([0.0, 1.0, 0.0]) + 0.8 * slant * round_)
        cylinder(base, middle - along, middle + along, 0.027, "carrier_roller", **LOOKS)


def _add_load(base: Any) -> None:
    """Bearers, short studs in layers with ends of another colour, two straps round all."""
    length, width, height = LOAD_M
    for x in (-0.30, 0.30):
        box(base, (x, 0, DECK_M + 0.02), (0.07, width, 0.04), "carrier_end", **LOOKS)
    rows, layers = 6, 3
    wide, tall = width / rows, (height - 0.04) / layers
    for layer in range(layers):
        for row in range(rows):
            short = 0.03 * ((row * 5 + layer * 3) % 4)  # sawn to hand, not all the same
            middle = (
                (row + layer) % 2 * 0.012 - 0.006, width * ((row + 0.5) / rows - 0.5),
                DECK_M + 0.04 + (layer + 0.5) * tall,
            )  # fmt: skip
            size = length - short, wide - 0.006, tall - 0.005
            box(base, middle, size, "carrier_stud", **LOOKS)
            for end in (-1, 1):
                tip = middle[0] + end * size[0] / 2, *middle[1:]
                box(base, tip, (0.002, *size[1:]), "carrier_end", **LOOKS)
    for x in (-0.22, 0.22):
        top = DECK_M + height
        box(base, (x, 0, top), (0.045, width + 0.012, 0.005), "carrier_strap", **LOOKS)
        for side in (-1, 1):
            half = (top + DECK_M) / 2
            box(
                base,
                (x, side * (width / 2 + 0.004), half),
                (0.045, 0.005, height),
                "carrier_strap",
                **LOOKS,
            )


def _add_mast(base: Any) -> None:
    """A post with a stop button, a scanner and a warning light."""
    x, y, top = MAST_M
    cylinder(base, (x, y, DECK_M), (x, y, top - 0.09), 0.014, "carrier_steel", **LOOKS)
    box(base, (x, y, 0.74), (0.05, 0.07, 0.10), "carrier_dark", **LOOKS)
    cylinder(base, (x - 0.025, y, 0.75), (x - 0.04, y, 0.75), 0.02, "carrier_light", **LOOKS)
    cylinder(base, (x, y, top - 0.17), (x, y, top - 0.09), 0.034, "carrier_black", **LOOKS)
    cylinder(base, (x, y, top - 0.09), (x, y, top - 0.02), 0.03, "carrier_light", **LOOKS)
    ellipsoid(base, (x, y, top - 0.02), (0.03, 0.03, 0.02), "carrier_light", **LOOKS)
