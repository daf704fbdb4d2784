"""The house that is being built on the site: two walls on a slab, a scaffold; far neighbours."""

import itertools
from typing import Any

import mujoco
import numpy as np

from assets.scenes import textures
from assets.scenes.primitives import HIDES, Painted, add_mesh, box, cylinder, yaw_quaternion
from hrc_env.scene.primitives import LOOKS_ONLY

SLAB_X_M, SLAB_Y_M = (-4.5, 4.3), (-3.7, 4.9)
WEST_X_M, NORTH_Y_M = -4.2, 4.6
WALL_M = 2.5
"""Height of the frames [m]."""
OPEN_STUDS = ((WEST_X_M, -0.1, 1.2, 0.06, np.pi / 2), (1.0, NORTH_Y_M, 1.03, 0.06, 0.0))
"""Stretches of open studs, through which nobody walks: x, y, half length, half width, yaw."""
STUD = (0.045, 0.095)
"""Width and depth of a stud [m]."""
SCAFFOLD_X_M, SCAFFOLD_Y_M = (-4.2, 0.6), (5.1, 6.1)
LIFTS_M = (2.15, 4.15)
"""Heights of the scaffold's decks [m]; one walks under the first."""

COLOURS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "zinc": ((0.66, 0.68, 0.69), 0.6, 0.5),
    "membrane": ((0.80, 0.84, 0.86), 0.15, 0.2),
    "render": ((0.86, 0.83, 0.76), 0.05, 0.1),
    "render_warm": ((0.80, 0.70, 0.58), 0.05, 0.1),
    "roof_red": ((0.52, 0.27, 0.21), 0.1, 0.1),
    "roof_grey": ((0.34, 0.35, 0.38), 0.1, 0.1),
    "pane": ((0.30, 0.38, 0.45), 0.5, 0.5),
    "leaves": ((0.30, 0.42, 0.20), 0.05, 0.05),
    "leaves_dark": ((0.23, 0.35, 0.18), 0.05, 0.05),
    "bark": ((0.33, 0.26, 0.20), 0.05, 0.05),
}
"""Name: colour, specular, shininess."""
PAINTED = {
    "sheathing": Painted(lambda: textures.strand_board((2.8, 2.5), 130)),
    "planks": Painted(lambda: textures.wood((186, 156, 112), 66)),
}
"""Materials that carry a picture."""


def add_house(world: Any) -> None:
    """Walls and scaffold."""
    _west_wall(world)
    _north_wall(world)
    _scaffold(world)


def _west_wall(world: Any) -> None:
    """Open studs beside the robot's back, sheathed further on."""
    x, (y0, y1) = WEST_X_M, (-1.24, 3.6)
    for z in (STUD[0] / 2, WALL_M - STUD[0] / 2):
        box(world, (x, (y0 + y1) / 2, z), (STUD[1], y1 - y0, STUD[0]), "pine_dark")
    for y in np.arange(-1.2, 1.0, 0.4):
        size = (STUD[1], STUD[0], WALL_M - 2 * STUD[0])
        box(world, (x, float(y), WALL_M / 2), size, "pine", **HIDES)
    for y in (-1.0, -0.2, 0.6):
        box(world, (x, y, 1.25), (STUD[1], 0.36, STUD[0]), "pine_dark")
    _sheathed(world, (x, 2.4), 2.4, along_x=False)


def _north_wall(world: Any) -> None:
    """Sheathed, a doorway with its lintel, open studs."""
    y, (x0, x1) = NORTH_Y_M, (-4.2, 2.02)
    top = WALL_M - STUD[0] / 2
    box(world, ((x0 + x1) / 2, y, top), (x1 - x0, STUD[1], STUD[0]), "pine_dark")
    for left, right in ((x0, -1.4), (-0.2, x1)):
        size = (right - left, STUD[1], STUD[0])
        box(world, ((left + right) / 2, y, STUD[0] / 2), size, "pine_dark")
    _sheathed(world, (-2.8, y), 2.8, along_x=True)
    box(world, (-0.8, y, 2.29), (1.2, 0.12, 0.33), "pine", name="lintel", **HIDES)
    for x in np.arange(0.0, 2.2, 0.4):
        size = (STUD[0], STUD[1], WALL_M - 2 * STUD[0])
        box(world, (float(x), y, WALL_M / 2), size, "pine", **HIDES)
    for x in (-1.38, -0.22):
        box(world, (x, y, 1.06), (STUD[0], STUD[1], 2.12), "pine_dark")
    for x in (0.2, 1.0, 1.8):
        box(world, (x, y, 1.25), (0.36, STUD[1], STUD[0]), "pine_dark")


def _sheathed(world: Any, middle: tuple[float, float], length: float, along_x: bool) -> None:
    """A solid piece of wall: strand board inside, membrane with battens outside."""
    x, y = middle
    size = np.array([length, 0.12, WALL_M] if along_x else [0.12, length, WALL_M])
    box(world, (x, y, WALL_M / 2), size, "sheathing", name=f"wall_{x:.0f}_{y:.0f}", **HIDES)
    out = np.array([0.0, 0.066] if along_x else [-0.066, 0.0])
    sheet = np.where(size == 0.12, 0.008, size)
    box(world, (x + out[0], y + out[1], WALL_M / 2), sheet, "membrane")
    for k in np.arange(-length / 2 + 0.1, length / 2, 0.52):
        at = (x + k, y + 0.08) if along_x else (x - 0.08, y + k)
        batten = (0.045, 0.022, WALL_M) if along_x else (0.022, 0.045, WALL_M)
        box(world, (*at, WALL_M / 2), batten, "pine")


def _scaffold(world: Any) -> None:
    """Two lifts of tubes with decks, rails, toe boards and a ladder, outside the north wall."""
    (x0, x1), (y0, y1) = SCAFFOLD_X_M, SCAFFOLD_Y_M
    middle, length, depth = (x0 + x1) / 2, x1 - x0, y1 - y0
    bays = np.linspace(x0, x1, 3)
    for x in bays:
        for y in (y0, y1):
            top = 5.3 if y == y1 else 4.35
            cylinder(world, (x, y, 0.0), (x, y, top), 0.024, "zinc", **HIDES)
            box(world, (x, y, 0.012), (0.15, 0.15, 0.024), "zinc")
        for z in LIFTS_M:
            cylinder(world, (x, y0 - 0.1, z - 0.08), (x, y1 + 0.1, z - 0.08), 0.024, "zinc")
    for k, z in enumerate(LIFTS_M):
        name = f"scaffold_deck_{k + 1}"
        box(world, (middle, (y0 + y1) / 2, z), (length, depth, 0.05), "planks", name=name, **HIDES)
        for y in np.arange(y0 + 0.01, y1 + 0.01, 0.245):
            box(world, (middle, float(y), z), (length + 0.01, 0.006, 0.053), "dark_steel")
        box(world, (middle, y1 - 0.02, z + 0.10), (length, 0.025, 0.15), "pine")
        for dz in (-0.08, 0.5, 1.0):
            cylinder(world, (x0 - 0.1, y1, z + dz), (x1 + 0.1, y1, z + dz), 0.024, "zinc")
    for left, right in itertools.pairwise(bays):
        cylinder(world, (left, y1 + 0.03, 0.1), (right, y1 + 0.03, 4.1), 0.022, "zinc")
    _ladder(world, (x1 + 0.25, y1 - 0.35), 0.0, 3.2)


def _ladder(world: Any, xy: tuple[float, float], low: float, high: float) -> None:
    """Leaning a little to -x."""
    x, y = xy
    for side in (-0.2, 0.2):
        cylinder(world, (x + 0.45, y + side, low), (x - 0.15, y + side, high), 0.02, "zinc")
    for share in np.arange(0.06, 0.98, 0.085):
        at, z = x + 0.45 - 0.6 * share, low + share * (high - low)
        cylinder(world, (at, y - 0.2, z), (at, y + 0.2, z), 0.013, "zinc")


def add_gable_mesh(spec: Any) -> None:
    """A roof of unit size."""
    vertices = [(x, y, z) for x in (-0.5, 0.5) for y, z in ((-0.5, 0), (0.5, 0), (0, 1))]
    faces = [(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)]
    size = np.array([11.5, 9.4, 3.4])
    add_mesh(spec, "gable", np.array(vertices) * size, np.array(faces))


def add_far_house(world: Any, xy: tuple[float, float], yaw: float, i: int) -> None:
    """A neighbour beyond the fence, looks only."""
    plain = {"castshadow": False}
    house = world.add_body(pos=[*xy, 0.0], quat=yaw_quaternion(yaw + (i % 2) * np.pi / 2))
    wall, roof = ("render", "roof_red") if i % 3 else ("render_warm", "roof_grey")
    height = 5.2 if i % 2 else 3.2
    box(house, (0, 0, height / 2), (10.6, 8.4, height), wall, **plain)
    house.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname="gable", material=roof, pos=[0, 0, height],
        castshadow=False, **LOOKS_ONLY,
    )  # fmt: skip
    for z in np.arange(1.7, height, 2.6):
        for k in (-3.4, 0.0, 3.4):
            box(house, (k, 0, z), (1.2, 8.44, 1.2), "pane", **plain)
            box(house, (0, 0.7 * k, z), (10.64, 1.1, 1.2), "pane", **plain)
