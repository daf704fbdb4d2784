"""What stands about in the laboratory, off the workers' way and out of the arm's goals.

Solid things (group 0) hide the worker, and stop the arm where it reaches them; there are few
of them, since every line of sight is tested against each. The rest is decoration.
"""

import itertools
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from assets.scenes import textures
from assets.scenes.primitives import (
    HIDES,
    SOLID_SCENE,
    Painted,
    add_mesh,
    add_painted,
    box,
    cylinder,
    ellipsoid,
)
from hrc_env.scene.primitives import LOOKS_ONLY, capsule


def _drawing() -> textures.Paint:
    """A construction drawing on paper."""
    paint = np.full((256, 362, 3), 236.0)
    ink = np.array([60.0, 78, 120])
    for row in (18, 90, 150, 236):
        paint[row : row + 2, 20:342] = ink
    for column in (20, 76, 132, 188, 244, 340):
        paint[18:238, column : column + 2] = ink
    paint[150:154, 20:250] = paint[90:93, 132:342] = ink
    paint[170:230:9, 256:330] = 150
    return paint


PAINTED = {
    "pine": Painted(lambda: textures.wood((206, 170, 120), 3)),
    "pine_dark": Painted(lambda: textures.wood((176, 136, 90), 4)),
    "beech": Painted(lambda: textures.wood((198, 160, 112), 5)),
    "cardboard": Painted(textures.cardboard),
    "drywall": Painted(lambda: textures.drywall((2.4, 2.4), 140)),
    "board_edges": Painted(lambda: textures.stacked_boards(22, (212, 209, 200), (120, 118, 112))),
    "plywood_edges": Painted(lambda: textures.stacked_boards(9, (190, 152, 102), (96, 70, 44))),
    "insulation": Painted(
        lambda: textures.mottled(np.random.default_rng(7), (256, 128), (214, 178, 92), 9)
    ),
    "plan": Painted(_drawing),
    "glass_sky": Painted(textures.sky, specular=0.3, emission=0.55),
}
"""Materials of the furniture that carry a picture."""

STUD = (0.038, 0.089)
"""Width and depth of a sawn stud [m]."""


def add_furniture(spec: Any) -> None:
    """Everything, wall by wall."""
    add_painted(spec, PAINTED)
    _add_bright(spec)
    world = spec.worldbody
    _stud_wall(world)
    _table(world)
    _board_stack(world)
    _lumber(world)
    _cart(world)
    _controller(world)
    _cartons(world)
    _trestles(world)
    _buckets(world)
    _window(world, -1.35)
    _window(world, 1.0)
    _door(world)
    _ladder(world)
    _on_the_walls(world)
    add_cones(spec, ((-1.62, 0.86), (-2.05, 0.0), (0.28, -2.2)))


def add_workbench(spec: Any) -> None:
    """What stands at the robot in other scenes too: a table beside it, its control box behind."""
    _add_bright(spec)
    _table(spec.worldbody)
    _controller(spec.worldbody)


def _add_bright(spec: Any) -> None:
    """Materials that glow."""
    spec.add_material(name="e_stop_yellow", rgba=[0.93, 0.77, 0.10, 1], specular=0.4)
    spec.add_material(name="led_green", rgba=[0.2, 0.9, 0.35, 1], emission=0.8)
    spec.add_material(name="screen", rgba=[0.16, 0.32, 0.45, 1], emission=0.5, specular=0.7)


def _stud_wall(world: Any) -> None:
    """The wall under construction on the south side: studs, insulation, and boards so far."""
    y_stud, depth = -2.74 + STUD[1] / 2, STUD[1]
    for z in (STUD[0] / 2, 2.5 - STUD[0] / 2):
        box(world, (0, y_stud, z), (5.2, depth, STUD[0]), "pine")
    for i, x in enumerate(np.arange(-2.6, 2.61, 0.4)):
        material = "pine" if i % 3 else "pine_dark"
        box(world, (float(x), y_stud, 1.25), (STUD[0], depth, 2.424), material)
    for x in np.arange(-0.4, 1.3, 0.4):
        box(world, (float(x), -2.716, 1.25), (0.36, 0.04, 2.42), "insulation")
    for x in (1.4, 1.8, 2.2):
        box(world, (x, y_stud, 1.22), (0.362, depth, STUD[0]), "pine_dark")
    y_board = -2.74 + depth + 0.00625
    box(world, (-1.4, y_board, 1.26), (2.4, 0.0125, 2.4), "drywall")
    box(world, (0.3, y_board + 0.001, 0.66), (0.6, 0.0125, 1.2), "drywall")
    for x, z in ((1.6, 0.4), (1.2, 1.2), (2.0, 1.2)):  # cables and sockets to come
        box(world, (x + 0.06, y_stud + 0.02, z), (0.08, 0.05, 0.08), "machine_blue")
        cylinder(
            world, (x + 0.06, y_stud + 0.02, z), (x + 0.06, y_stud + 0.02, 2.45), 0.006, "rubber"
        )


def _table(world: Any) -> None:
    """A trestle table with work on it, beside the robot."""
    x, y, height = -1.15, 1.86, 0.80
    top = (x, y, height - 0.02)
    box(world, top, (1.5, 0.62, 0.04), "beech", name="table_top", **SOLID_SCENE)
    for sx in (-1, 1):
        legs_x = x + 0.55 * sx
        box(world, (legs_x, y, height - 0.065), (0.09, 0.58, 0.05), "pine_dark")
        for sy in (-1, 1):
            for lean in (-1, 1):
                foot = (legs_x + 0.14 * lean, y + 0.25 * sy, 0.0)
                head = (legs_x + 0.02 * lean, y + 0.22 * sy, height - 0.05)
                cylinder(world, foot, head, 0.022, "pine")
    for i, (dy, length, turn) in enumerate(((0.22, 1.15, 0.01), (0.12, 1.0, -0.03))):
        box(world, (x - 0.1, y + dy, height + 0.019), (length, 0.089, 0.038), "pine", turn)
        box(world, (x - 0.2 + 0.1 * i, y + dy, height + 0.057), (0.7, 0.089, 0.038), "pine_dark")
    box(world, (x + 0.14, y - 0.10, height + 0.05), (0.30, 0.20, 0.10), "machine_blue", 0.3)
    cylinder(
        world, (x + 0.05, y - 0.15, height + 0.12), (x + 0.23, y - 0.05, height + 0.12),
        0.012, "rubber",
    )  # fmt: skip
    cylinder(
        world, (x - 0.13, y - 0.18, height), (x - 0.13, y - 0.18, height + 0.11), 0.04, "hazard_red"
    )
    box(world, (x - 0.45, y - 0.15, height + 0.003), (0.42, 0.30, 0.003), "plan", 0.15)


def _board_stack(world: Any) -> None:
    """Plasterboards on timbers, in the corner."""
    x, y = -2.42, 2.36
    for dx in (-0.42, 0.0, 0.42):
        box(world, (x + dx, y, 0.04), (0.08, 0.6, 0.08), "pine_dark")
    box(
        world, (x, y, 0.08 + 0.15), (1.2, 0.6, 0.30), "board_edges", name="board_stack",
        **HIDES,
    )  # fmt: skip
    box(world, (x, y, 0.386), (1.2, 0.6, 0.012), "drywall")
    box(world, (x + 0.06, y + 0.01, 0.40), (0.62, 0.5, 0.016), "plywood_edges", 0.12)


def _lumber(world: Any) -> None:
    """Studs on a rack along the west wall."""
    x = -2.80
    for y in (-1.1, 0.0, 1.1):
        box(world, (x, y, 0.06), (0.42, 0.08, 0.12), "dark_steel")
        box(world, (x - 0.2, y, 0.36), (0.05, 0.05, 0.72), "dark_steel")
    box(
        world, (x + 0.01, 0.0, 0.12 + 0.095), (0.36, 2.9, 0.19), "pine_dark", name="lumber",
        **HIDES,
    )  # fmt: skip
    rng = np.random.default_rng(9)
    for layer in range(5):
        for row in range(4):
            slip, tone = rng.normal(0, 0.04), "pine" if rng.random() < 0.65 else "pine_dark"
            centre = (x - 0.13 + 0.092 * row, float(slip), 0.14 + 0.0395 * layer)
            box(world, centre, (STUD[1], 2.9, STUD[0]), tone)


def _cart(world: Any) -> None:
    """A red tool cart with drawers."""
    x, y, yaw = -2.42, -2.02, 0.12
    box(world, (x, y, 0.49), (0.66, 0.44, 0.74), "cart_red", yaw, name="tool_cart", **HIDES)
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])

    def at(dx: float, dy: float, z: float) -> tuple[float, float, float]:
        shift = turn @ np.array([dx, dy])
        return x + float(shift[0]), y + float(shift[1]), z

    box(world, at(0, 0, 0.87), (0.69, 0.47, 0.025), "dark_steel", yaw)
    for z in (0.24, 0.38, 0.50, 0.62, 0.73):
        box(world, at(0, 0.221, z), (0.58, 0.006, 0.095), "cart_red", yaw)
        box(world, at(0, 0.232, z + 0.034), (0.50, 0.016, 0.012), "grey_steel", yaw)
        box(world, at(0, 0.2225, z - 0.052), (0.60, 0.006, 0.008), "rubber", yaw)
    for dx in (-0.27, 0.27):
        for dy in (-0.17, 0.17):
            foot = np.array(at(dx, dy, 0.055))
            axle = np.array([0.015, 0, 0])
            cylinder(world, foot - axle, foot + axle, 0.055, "rubber")
    cylinder(world, at(-0.18, 0.05, 0.90), at(0.12, 0.0, 0.90), 0.014, "grey_steel")
    box(world, at(0.2, -0.08, 0.925), (0.16, 0.12, 0.085), "e_stop_yellow", yaw + 0.4)


def _controller(world: Any) -> None:
    """The robot's control box behind it, with its pendant and its cable."""
    x, y = -1.62, -0.78
    box(world, (x, y, 0.30), (0.42, 0.34, 0.52), "grey_steel", name="controller", **SOLID_SCENE)
    box(world, (x + 0.212, y, 0.32), (0.004, 0.26, 0.42), "dark_steel")
    for z in (0.18, 0.21, 0.24):
        box(world, (x + 0.215, y, z), (0.004, 0.2, 0.012), "rubber")
    cylinder(world, (x + 0.213, y + 0.07, 0.46), (x + 0.218, y + 0.07, 0.46), 0.012, "led_green")
    box(world, (x, y, 0.585), (0.30, 0.24, 0.03), "dark_steel", 0.2)
    box(world, (x, y, 0.602), (0.22, 0.16, 0.004), "screen", 0.2)
    cylinder(world, (x + 0.12, y + 0.10, 0.60), (x + 0.12, y + 0.10, 0.63), 0.02, "hazard_red")
    points = [(x + 0.2, y + 0.1, 0.08), (-1.32, -0.52, 0.012), (-1.12, -0.22, 0.012)]
    points += [(-0.95, -0.06, 0.012), (-0.855, -0.03, 0.16)]
    for start, end in itertools.pairwise(points):
        capsule(world, start, end, 0.012, material="rubber", **LOOKS_ONLY)


def _cartons(world: Any) -> None:
    """Cartons and a crate in the two east corners."""
    for name, centre, size, yaw, material in (
        ("carton_1", (2.74, 2.32, 0.22), (0.48, 0.56, 0.44), 0.1, "cardboard"),
        ("carton_2", (2.76, 2.36, 0.60), (0.40, 0.42, 0.32), -0.25, "cardboard"),
        ("crate", (2.70, -2.30, 0.30), (0.58, 0.62, 0.60), 0.05, "pine_dark"),
        ("carton_3", (2.72, -2.32, 0.74), (0.44, 0.38, 0.28), 0.35, "cardboard"),
    ):
        box(world, centre, size, material, yaw, name=name, **HIDES)
    for z in (0.06, 0.20, 0.34, 0.48):
        box(world, (2.405, -2.312, z + 0.03), (0.016, 0.64, 0.09), "pine", 0.05)
        box(world, (2.686, -1.984, z + 0.03), (0.60, 0.016, 0.09), "pine", 0.05)


def _trestles(world: Any) -> None:
    """Two trestles below the windows, on which boards lie."""
    y, height = 2.45, 0.70
    for x in (0.5, 1.9):
        box(world, (x, y, height - 0.03), (0.09, 0.50, 0.06), "pine_dark")
        for sy in (-1, 1):
            for lean in (-1, 1):
                foot = (x + 0.16 * lean, y + 0.24 * sy, 0.0)
                cylinder(world, foot, (x + 0.02 * lean, y + 0.2 * sy, height - 0.05), 0.02, "pine")


def _buckets(world: Any) -> None:
    """Filler and a roll of tape in front of the wall that is being boarded."""
    for x, y in ((-0.62, -2.42), (-0.28, -2.36)):
        cylinder(world, (x, y, 0.0), (x, y, 0.34), 0.145, "bucket")
        cylinder(world, (x, y, 0.30), (x, y, 0.345), 0.155, "machine_blue")
    cylinder(world, (0.04, -2.46, 0.0), (0.04, -2.46, 0.05), 0.07, "bucket")
    box(world, (0.75, -2.50, 0.62), (0.6, 0.014, 1.2), "drywall")
    box(world, (0.86, -2.48, 0.60), (0.6, 0.014, 1.2), "drywall")


def _window(world: Any, x: float) -> None:
    """A window in the north wall; the sky is a bright pane."""
    y, z, width, height = 2.735, 1.62, 1.35, 1.0
    bright = {"castshadow": False}  # the light comes in here
    box(world, (x, y, z), (width, 0.008, height), "glass_sky", **bright)
    for dx in (-width / 2, 0.0, width / 2):
        box(world, (x + dx, y - 0.015, z), (0.05, 0.035, height + 0.05), "white_gloss", **bright)
    for dz in (-height / 2, height / 2):
        box(world, (x, y - 0.015, z + dz), (width + 0.05, 0.035, 0.05), "white_gloss", **bright)
    box(
        world,
        (x, y - 0.06, z - height / 2 - 0.03),
        (width + 0.16, 0.14, 0.025),
        "white_gloss",
        **bright,
    )


def _door(world: Any) -> None:
    """A steel door in the east wall."""
    x, y = 3.04, -0.75
    box(world, (x, y, 1.03), (0.02, 0.92, 2.06), "door_green")
    for dy in (-0.49, 0.49):
        box(world, (x - 0.005, y + dy, 1.05), (0.05, 0.06, 2.1), "grey_steel")
    box(world, (x - 0.005, y, 2.10), (0.05, 1.04, 0.06), "grey_steel")
    cylinder(world, (x - 0.03, y + 0.36, 1.02), (x - 0.03, y + 0.24, 1.02), 0.011, "grey_steel")
    box(world, (x - 0.012, y, 1.55), (0.006, 0.22, 0.16), "e_stop_yellow")
    box(world, (x - 0.012, y, 2.26), (0.02, 0.36, 0.13), "led_green")


def _ladder(world: Any) -> None:
    """A ladder that leans on the east wall."""
    feet, heads = 2.60, 2.98
    for y in (0.62, 1.02):
        cylinder(world, (feet, y, 0.0), (heads, y, 2.2), 0.02, "grey_steel")
    for share in np.linspace(0.10, 0.93, 8):
        x, z = feet + share * (heads - feet), 2.2 * share
        cylinder(world, (x, 0.62, z), (x, 1.02, z), 0.014, "grey_steel")


def _on_the_walls(world: Any) -> None:
    """Extinguisher, drawing, shelf, conduits, switches."""
    x, y = 2.97, 1.62
    capsule(world, (x, y, 0.62), (x, y, 1.02), 0.07, material="hazard_red", **LOOKS_ONLY)
    cylinder(world, (x, y, 1.08), (x, y, 1.16), 0.02, "rubber")
    cylinder(world, (x, y, 1.13), (x - 0.02, y + 0.10, 0.95), 0.009, "rubber")
    box(world, (3.035, y, 1.42), (0.006, 0.2, 0.2), "hazard_red")
    box(world, (-3.035, 0.9, 1.62), (0.008, 1.15, 0.82), "plan")
    box(world, (-3.0, -1.0, 1.72), (0.24, 1.5, 0.026), "beech")
    for y, height, material in (
        (-1.55, 0.24, "bucket"), (-1.27, 0.18, "cardboard"), (-1.0, 0.15, "machine_blue"),
        (-0.75, 0.21, "cone_orange"), (-0.48, 0.13, "grey_steel"),
    ):  # fmt: skip
        box(world, (-2.99, y, 1.733 + height / 2), (0.17, 0.19, height), material)
    for y in (0.25, 2.0):
        cylinder(world, (-3.03, y, 0.1), (-3.03, y, 2.55), 0.013, "grey_steel")
        box(world, (-3.025, y, 1.1), (0.04, 0.09, 0.14), "white_gloss")
    ellipsoid(world, (3.03, -1.55, 1.30), (0.02, 0.045, 0.045), "white_gloss")


def add_cones(spec: Any, places: Sequence[tuple[float, float]]) -> None:
    """Traffic cones: one lathe-turned mesh."""
    profile = np.array([(0.0, 0.46), (0.022, 0.455), (0.115, 0.03), (0.115, 0.0), (0.0, 0.0)])
    count = 20
    angles = 2 * np.pi * np.arange(count) / count
    rings = [(r * np.cos(a), r * np.sin(a), z) for r, z in profile[1:-1] for a in angles]
    vertices = np.array([(0, 0, profile[0, 1]), *rings, (0, 0, 0)])
    last, faces = len(vertices) - 1, []
    for i in range(count):
        j = (i + 1) % count
        faces.append((0, 1 + i, 1 + j))
        for ring in range(2):
            a, b = 1 + ring * count, 1 + (ring + 1) * count
            faces += [(a + i, b + i, b + j), (a + i, b + j, a + j)]
        faces.append((last, 1 + 2 * count + j, 1 + 2 * count + i))
    add_mesh(spec, "cone", vertices, np.array(faces))
    for x, y in places:
        box(spec.worldbody, (x, y, 0.012), (0.27, 0.27, 0.024), "rubber", 0.2)
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH, meshname="cone", material="cone_orange",
            pos=[x, y, 0.024], **LOOKS_ONLY,
        )  # fmt: skip
        cylinder(spec.worldbody, (x, y, 0.25), (x, y, 0.33), 0.068, "white_gloss")
