"""The laboratory: a workshop where a wall is being built. Floor, walls, ceiling, light.

The room is the size of the paper's laboratory. Walls are planes, which are hardly drawn
from behind, so that one can look in from outside; the arm does not reach them.
"""

from typing import Any

import mujoco
import numpy as np

from assets.rotations import quaternion_from_matrix
from assets.scenes import furniture, textures
from assets.scenes.markings import WHITE, blend, mark_cell
from assets.scenes.pedestal import MOUNT_WORLD
from assets.scenes.primitives import (
    HIDES,
    SOLID_SCENE,
    Painted,
    add_painted,
    box,
    cylinder,
    paint_materials,
)
from assets.scenes.textures import Paint
from hrc_env.scene.primitives import LOOKS_ONLY, OVERHEAD

LENGTH_M, DEPTH_M, HEIGHT_M = 6.09, 5.48, 2.59
FLOOR_PX_PER_M = 220
WALL_PX_PER_M = 180

COLOURS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "hazard_red": ((0.72, 0.10, 0.08), 0.4, 0.4),
    "white_gloss": ((0.90, 0.90, 0.88), 0.4, 0.5),
    "grey_steel": ((0.55, 0.57, 0.60), 0.7, 0.6),
    "dark_steel": ((0.20, 0.21, 0.23), 0.5, 0.4),
    "cart_red": ((0.62, 0.12, 0.10), 0.55, 0.55),
    "machine_blue": ((0.16, 0.30, 0.47), 0.4, 0.4),
    "rubber": ((0.07, 0.07, 0.075), 0.2, 0.1),
    "cone_orange": ((0.93, 0.36, 0.08), 0.3, 0.3),
    "bucket": ((0.88, 0.87, 0.82), 0.3, 0.3),
    "skirting": ((0.36, 0.37, 0.38), 0.2, 0.2),
    "door_green": ((0.30, 0.42, 0.40), 0.3, 0.3),
    "copper": ((0.72, 0.45, 0.25), 0.7, 0.6),
}
"""Name: colour, specular, shininess."""


def _floor() -> Paint:
    """Concrete with the robot's cell, its reach and the walkway, worn by boots."""
    paint = textures.concrete_floor((LENGTH_M, DEPTH_M), FLOOR_PX_PER_M)
    height, width = paint.shape[:2]
    x = (np.arange(width) + 0.5)[None] / FLOOR_PX_PER_M - LENGTH_M / 2
    y = DEPTH_M / 2 - (np.arange(height) + 0.5)[:, None] / FLOOR_PX_PER_M
    worn = mark_cell(paint, x - MOUNT_WORLD[0], y - MOUNT_WORLD[1], FLOOR_PX_PER_M)
    walkway = np.abs(y) < 2.12
    lines = (np.abs(np.abs(y) - 2.08) < 0.03) & (np.abs(x) < 2.4)
    ends = (np.abs(np.abs(x) - 2.40) < 0.03) & walkway
    blend(paint, (lines | ends) & worn, WHITE)
    return paint


def _blocks() -> Paint:
    upper, lower = (204, 206, 203), (112, 130, 142)
    return textures.blockwork((DEPTH_M, HEIGHT_M), WALL_PX_PER_M, upper, lower)


PAINTED = {
    "floor": Painted(_floor, specular=0.12, shininess=0.2),
    "wall_north": Painted(
        lambda: textures.plaster((LENGTH_M, HEIGHT_M), WALL_PX_PER_M, (206, 205, 198))
    ),
    "wall_south": Painted(lambda: textures.strand_board((LENGTH_M, HEIGHT_M), WALL_PX_PER_M)),
    "wall_blocks": Painted(_blocks),
    "ceiling": Painted(
        lambda: textures.plaster((LENGTH_M, DEPTH_M), 60, (222, 222, 218)),
        specular=0.0,
        emission=0.3,
    ),
}
"""Materials of the room that carry a picture."""


def add_lab(spec: Any, clutter: bool) -> None:
    """Build the laboratory; without clutter only the room itself and its light."""
    _add_light(spec)
    for name, (colour, specular, shininess) in COLOURS.items():
        spec.add_material(name=name, rgba=[*colour, 1], specular=specular, shininess=shininess)
    add_painted(spec, PAINTED)
    _add_floor(spec)
    _add_walls(spec)
    _add_ceiling(spec)
    if clutter:
        furniture.add_furniture(spec)


def paint_lab(spec: Any) -> None:
    """Paint what `add_lab` has built."""
    paint_materials(spec, PAINTED | furniture.PAINTED)


def _add_light(spec: Any) -> None:
    """Bright and even for the cameras; one sun casts shadows in pictures for people."""
    headlight = spec.visual.headlight
    headlight.ambient[:] = 0.50
    headlight.diffuse[:] = 0.12
    headlight.specular[:] = 0.05
    directional = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    spec.worldbody.add_light(
        name="daylight", type=directional, pos=[0.8, 1.6, 6.0], dir=[-0.22, -0.40, -1.0],
        diffuse=[0.44, 0.43, 0.40], specular=[0.25] * 3, ambient=[0, 0, 0], castshadow=True,
    )  # fmt: skip
    spec.worldbody.add_light(
        name="lamps", type=directional, pos=[0, 0, 6.0], dir=[0.50, 0.60, -0.55],
        diffuse=[0.19, 0.20, 0.22], specular=[0.05] * 3, ambient=[0, 0, 0], castshadow=False,
    )  # fmt: skip
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.80, 0.86, 0.92], rgb2=[0.62, 0.70, 0.78], width=64, height=384,
    )  # fmt: skip
    spec.stat.extent = 4.0
    spec.stat.center = [0.0, 0.0, 1.0]
    spec.visual.map.znear, spec.visual.map.zfar = 0.012, 10.0
    spec.visual.map.shadowscale, spec.visual.map.shadowclip = 0.9, 1.0


def _add_floor(spec: Any) -> None:
    spec.worldbody.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[LENGTH_M / 2, DEPTH_M / 2, 0.1],
        material="floor", castshadow=False, **SOLID_SCENE,
    )  # fmt: skip


def _add_walls(spec: Any) -> None:
    half_x, half_y = LENGTH_M / 2, DEPTH_M / 2
    _wall(spec, "north", "wall_north", (0, half_y), (0, -1), half_x)
    _wall(spec, "south", "wall_south", (0, -half_y), (0, 1), half_x)
    _wall(spec, "east", "wall_blocks", (half_x, 0), (-1, 0), half_y)
    _wall(spec, "west", "wall_blocks", (-half_x, 0), (1, 0), half_y)
    world = spec.worldbody
    for sign in (-1, 1):
        box(world, (0, sign * (half_y - 0.006), 0.05), (LENGTH_M, 0.012, 0.1), "skirting")
        box(world, (sign * (half_x - 0.006), 0, 0.05), (0.012, DEPTH_M, 0.1), "skirting")


def _wall(
    spec: Any,
    name: str,
    material: str,
    xy: tuple[float, float],
    normal: tuple[float, float],
    half_width: float,
) -> None:
    """A wall that faces `normal`, its texture upright."""
    facing, up = np.array([*normal, 0.0]), np.array([0.0, 0.0, 1.0])
    axes = np.stack([np.cross(up, facing), up, facing], -1)
    spec.worldbody.add_geom(
        name=f"wall_{name}", type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[half_width, HEIGHT_M / 2, 0.1], pos=[*xy, HEIGHT_M / 2],
        quat=quaternion_from_matrix(axes), material=material, castshadow=False, **HIDES,
    )  # fmt: skip


def _add_ceiling(spec: Any) -> None:
    """White, with four lamp panels, beams and a cable tray; left out when seen from above."""
    spec.add_material(name="lamp", rgba=[1.0, 0.99, 0.95, 1], emission=1.0)
    world, above = spec.worldbody, LOOKS_ONLY | {"group": OVERHEAD, "castshadow": False}
    world.add_geom(
        name="ceiling", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[LENGTH_M / 2, DEPTH_M / 2, 0.1],
        pos=[0, 0, HEIGHT_M], quat=[0, 1, 0, 0], material="ceiling", **above,
    )  # fmt: skip
    for x in (-1.5, 1.5):
        for y in (-1.2, 1.2):
            box(world, (x, y, 2.555), (1.26, 0.36, 0.03), "white_gloss", **above)
            box(world, (x, y, 2.538), (1.18, 0.28, 0.006), "lamp", **above)
    cylinder(world, (-3.04, 0.35, 2.50), (3.04, 0.35, 2.50), 0.022, "copper", **above)
    cylinder(world, (-3.04, 0.43, 2.50), (3.04, 0.43, 2.50), 0.03, "grey_steel", **above)
