"""What lies about on the site: timber, blocks, boards, sand, barriers, cones, a step."""

from typing import Any

import numpy as np

from assets.scenes import textures
from assets.scenes.furniture import add_cones
from assets.scenes.primitives import HIDES, Painted, box, cylinder, ellipsoid, yaw_quaternion
from hrc_env.scene.primitives import LOOKS_ONLY, capsule

TIMBER_XY_M = (7.2, 2.6)
BLOCKS_XY_M, BLOCKS_YAW_RAD = (5.2, -2.2), 0.1
PANEL_XY_M, PANEL_YAW_RAD = (2.8, -5.0), 0.12
HOP_UP_XY_M, HOP_UP_M = (-2.9, 3.9), (1.2, 0.4, 0.22)
"""A step to reach the top of the wall: middle and size."""
SAND_XY_M = (-6.3, -5.6)
CARTONS_XY_M = (4.9, 5.6)
BARRIERS = ((5.4, -6.6, 0.0), (3.2, -6.6, 0.0), (-3.2, -6.5, 0.05), (-7.2, 3.6, 1.5))
"""(x, y, yaw) of the plastic barriers that keep walkers from truck and container."""
BARRIER_M = (1.6, 0.36, 0.95)
CONES = ((4.55, -3.95), (4.55, 5.15), (-4.75, -3.95), (2.0, -6.9), (6.6, -6.2), (-1.62, 0.86))

COLOURS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "barrier_red": ((0.66, 0.15, 0.11), 0.35, 0.35),
    "barrier_white": ((0.88, 0.88, 0.86), 0.35, 0.35),
    "sand": ((0.76, 0.64, 0.45), 0.0, 0.0),
    "sand_dark": ((0.66, 0.55, 0.38), 0.0, 0.0),
    "site_concrete": ((0.62, 0.61, 0.58), 0.05, 0.1),
    "strap": ((0.12, 0.30, 0.52), 0.2, 0.2),
    "foil": ((0.86, 0.88, 0.90), 0.4, 0.5),
}
"""Name: colour, specular, shininess."""


def _blocks() -> textures.Paint:
    """The side of a pallet of concrete blocks."""
    rng = np.random.default_rng(81)
    paint = textures.mottled(rng, (280, 240), (168, 166, 160), 5.0)
    for i in range(7):
        paint[i * 40 : i * 40 + 3] = 92
        shift = (i % 2) * 40
        for k in range(4):
            column = (k * 80 + shift) % 240
            paint[i * 40 : i * 40 + 40, column : column + 3] = 96
            paint[i * 40 + 3 : i * 40 + 40, column + 3 : column + 80] += rng.normal(0, 6)
    return paint


def _plywood() -> textures.Paint:
    """Formwork boards: brown film, scuffed by concrete."""
    rng = np.random.default_rng(82)
    paint = textures.mottled(rng, (200, 256), (150, 104, 60), 5.0)
    splash = np.clip(textures.noise(rng, (200, 256), (26, 40)) - 0.4, 0, 1)[..., None]
    return paint + (np.array([176.0, 172, 164]) - paint) * 0.7 * splash


PAINTED = {
    "block_stack": Painted(_blocks),
    "plywood": Painted(_plywood),
}
"""Materials that carry a picture."""


def add_stock(spec: Any) -> None:
    """All of it."""
    world = spec.worldbody
    _timber(world)
    _pallet_of_blocks(world)
    _panel(world)
    _hop_up(world)
    _sand(world)
    _cartons(world)
    _tubes(world)
    for x, y, yaw in BARRIERS:
        _barrier(world, x, y, yaw)
    add_cones(spec, CONES)


def _pallet(world: Any, x: float, y: float, z: float, yaw: float) -> None:
    """A wooden pallet of 1.2 x 0.8 x 0.144 m."""
    pallet = world.add_body(pos=[x, y, z], quat=yaw_quaternion(yaw))
    for dy in (-0.35, -0.175, 0.0, 0.175, 0.35):
        box(pallet, (0, dy, 0.133), (1.2, 0.10, 0.022), "pine")
    for dy in (-0.35, 0.0, 0.35):
        box(pallet, (0, dy, 0.011), (1.2, 0.10, 0.022), "pine_dark")
        for dx in (-0.53, 0.0, 0.53):
            box(pallet, (dx, dy, 0.072), (0.14, 0.10, 0.10), "pine_dark")


def _timber(world: Any) -> None:
    """Studs of 4 m in two bundles on bearers, strapped; some loose ones on top."""
    x, y = TIMBER_XY_M
    box(world, (x, y, 0.08 + 0.5), (1.16, 3.96, 1.0), "pine_dark", name="timber", **HIDES)
    rng = np.random.default_rng(83)
    for dy in (-1.3, 0.0, 1.3):
        for z in (0.04, 0.62):
            box(world, (x, y + dy, z), (1.2, 0.1, 0.08), "pine_dark")
        box(world, (x, y + 0.9 * dy + 0.2, 0.60), (1.215, 0.04, 1.04), "strap")
    for layer in range(22):
        z = 0.105 + 0.0455 * layer
        if 0.56 < z < 0.66:
            continue
        for side in (-1, 1):
            tone = "pine" if rng.random() < 0.6 else "pine_dark"
            slip = float(rng.normal(0, 0.02))
            box(
                world, (x + side * 0.557, y + slip, z), (0.09, 4.0, 0.043), tone, np.pi * (side > 0)
            )
    for k in range(12):
        tone = "pine" if rng.random() < 0.6 else "pine_dark"
        slip = float(rng.normal(0, 0.03))
        _stud(world, (x - 0.54 + 0.098 * k, y + slip, 1.102), tone)
    _stud(world, (x - 0.2, y + 0.15, 1.145), "pine", 1.50)
    _stud(world, (x + 0.25, y - 0.1, 1.145), "pine_dark", 1.62)


def _stud(world: Any, centre: tuple[float, float, float], tone: str, yaw: float = np.pi / 2):
    """A stud of 4 m, grain along it."""
    box(world, centre, (4.0, 0.092, 0.044), tone, yaw)


def _pallet_of_blocks(world: Any) -> None:
    x, y = BLOCKS_XY_M
    _pallet(world, x, y, 0.0, BLOCKS_YAW_RAD)
    size = (1.18, 0.98, 1.35)
    at = (x, y, 0.144 + 0.675)
    box(world, at, size, "block_stack", BLOCKS_YAW_RAD, name="blocks", **HIDES)
    box(world, (x - 0.1, y + 0.05, 1.50), (0.4, 0.2, 0.2), "site_concrete", 0.3)


def _panel(world: Any) -> None:
    """A formwork panel that stands in its struts."""
    panel = world.add_body(pos=[*PANEL_XY_M, 0.0], quat=yaw_quaternion(PANEL_YAW_RAD))
    box(panel, (0, 0, 0.97), (2.4, 0.12, 1.86), "plywood", name="formwork", **HIDES)
    for x in np.arange(-1.1, 1.2, 0.44):
        box(panel, (float(x), -0.09, 0.97), (0.05, 0.08, 1.88), "barrier_red")
    for z in (0.08, 0.66, 1.25, 1.86):
        box(panel, (0, -0.10, z), (2.42, 0.06, 0.06), "barrier_red")
    for x in (-0.85, 0.85):
        capsule(panel, (x, -0.14, 1.6), (x, -1.15, 0.05), 0.03, material="zinc", **LOOKS_ONLY)
        capsule(panel, (x, -0.14, 0.5), (x, -1.10, 0.05), 0.025, material="zinc", **LOOKS_ONLY)
        box(panel, (x, -1.15, 0.02), (0.18, 0.18, 0.04), "dark_steel")


def _hop_up(world: Any) -> None:
    """A low platform of aluminium."""
    (x, y), (length, depth, height) = HOP_UP_XY_M, HOP_UP_M
    at = (x, y, height - 0.02)
    box(world, at, (length, depth, 0.04), "zinc", name="hop_up", **HIDES)
    for k in np.arange(-0.55, 0.6, 0.1):
        box(world, (x + float(k), y, height + 0.001), (0.012, depth - 0.04, 0.004), "dark_steel")
    for sx in (-0.54, 0.54):
        for sy in (-0.17, 0.17):
            foot = (x + 1.04 * sx, y + 1.1 * sy, 0.0)
            cylinder(world, foot, (x + sx, y + sy, height - 0.03), 0.02, "zinc")


def _sand(world: Any) -> None:
    """A heap with a shovel in it."""
    x, y = SAND_XY_M
    cylinder(world, (x, y, 0.0), (x, y, 0.5), 0.75, "sand_dark", name="sand_heap", **HIDES)
    ellipsoid(world, (x, y, 0.0), (1.55, 1.4, 0.82), "sand")
    ellipsoid(world, (x + 0.7, y + 0.5, 0.0), (1.0, 0.8, 0.42), "sand")
    ellipsoid(world, (x - 0.8, y + 0.4, 0.0), (0.8, 0.9, 0.36), "sand_dark")
    grip = (x + 0.62, y + 0.42, 1.55)
    cylinder(world, (x + 0.35, y + 0.25, 0.55), grip, 0.017, "beech")
    capsule(
        world, (grip[0] - 0.05, grip[1] + 0.06, grip[2]), (grip[0] + 0.05, grip[1] - 0.06, grip[2]),
        0.017, material="dark_steel", **LOOKS_ONLY,
    )  # fmt: skip


def _cartons(world: Any) -> None:
    """A pallet of cartons in foil, and insulation in rolls."""
    x, y = CARTONS_XY_M
    _pallet(world, x, y, 0.0, 0.0)
    box(world, (x, y, 0.144 + 0.4), (1.12, 0.76, 0.8), "cardboard", name="cartons", **HIDES)
    for dx in (-0.185, 0.185):
        box(world, (x + dx, y, 0.544), (0.006, 0.77, 0.80), "foil")
    box(world, (x - 0.25, y + 0.05, 1.09), (0.46, 0.5, 0.30), "cardboard", 0.2)
    for dx, z in ((1.1, 0.28), (1.68, 0.28), (1.39, 0.78)):
        cylinder(world, (x + dx, y - 0.5, z), (x + dx, y + 0.6, z), 0.28, "insulation", **HIDES)


def _tubes(world: Any) -> None:
    """Spare scaffold tubes and planks by the scaffold."""
    rng = np.random.default_rng(84)
    for k in range(14):
        y = 6.9 + 0.055 * (k % 7)
        z = 0.09 + 0.05 * (k // 7)
        x = 1.6 + float(rng.normal(0, 0.06))
        cylinder(world, (x - 1.5, y, z), (x + 1.5, y, z), 0.024, "zinc")
    for x in (0.6, 2.6):
        box(world, (x, 7.06, 0.03), (0.1, 0.6, 0.06), "pine_dark")
    for k in range(4):
        box(world, (1.5, 7.75, 0.03 + 0.048 * k), (3.0, 0.24, 0.045), "planks", 0.01 * k)


def _barrier(world: Any, x: float, y: float, yaw: float) -> None:
    """A plastic barrier filled with water, red and white."""
    barrier = world.add_body(pos=[x, y, 0.0], quat=yaw_quaternion(yaw))
    length, depth, height = BARRIER_M
    box(
        barrier, (0, 0, height / 2), (length, 0.16, height), "barrier_red",
        name=f"barrier_{x}_{y}", **HIDES,
    )  # fmt: skip
    box(barrier, (0, 0, 0.12), (length, depth, 0.24), "barrier_red")
    box(barrier, (0, 0, 0.29), (length - 0.04, 0.26, 0.10), "barrier_red")
    for z in (0.52, 0.82):
        box(barrier, (0, 0, z), (0.84 * length, 0.166, 0.14), "barrier_white")
    for dx in (-0.45, 0.45):
        box(barrier, (dx, 0, 0.03), (0.22, depth + 0.004, 0.06), "rubber")
