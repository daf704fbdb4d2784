"""A stand with a tool in it: `HRCHandover-v0`.

Lengths in metres from the middle of the robot's foot, on the pedestal's head.
"""

from typing import Any

import mujoco

from assets.scenes.primitives import LOOKS_ONLY, SOLID_SCENE, box, cylinder
from hrc_env.scene.primitives import DECORATION, OBJECT_BIT, SCENE_BIT
from hrc_env.tasks.handover import BAR_KG, BAR_M, HANDLE_UP_M, STAND_M

FLOOR_M, WALL_M, SLACK_M, DEEP_M = -0.75, 0.02, 0.003, 0.05
"""The floor; the socket's walls, their play, its depth."""
COLOURS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "stand": ((0.30, 0.33, 0.37), 0.5, 0.4),
    "socket": ((0.88, 0.42, 0.10), 0.3, 0.3),
    "bar": ((0.72, 0.74, 0.77), 0.8, 0.7),
    "handle": ((0.13, 0.32, 0.62), 0.2, 0.2),
}
"""Name: colour, specular, shininess."""


def add_handover(spec: Any) -> None:
    """Everything."""
    for name, (colour, specular, shininess) in COLOURS.items():
        spec.add_material(name=name, rgba=[*colour, 1], specular=specular, shininess=shininess)
    _add_stand(spec.worldbody)
    _add_bar(spec.worldbody)


def _add_stand(world: Any) -> None:
    """A column with a head, and four walls on it round the tool's lower end."""
    x, y, z = STAND_M
    cylinder(world, (x, y, FLOOR_M), (x, y, FLOOR_M + 0.02), 0.18, "stand")
    cylinder(world, (x, y, FLOOR_M + 0.02), (x, y, z - 0.03), 0.03, "stand")
    box(world, (x, y, z - 0.015), (0.16, 0.16, 0.03), "stand", name="stand", **SOLID_SCENE)
    inner = BAR_M[0] / 2 + SLACK_M + WALL_M / 2
    solid = {"contype": SCENE_BIT, "conaffinity": 0, "density": 0, "group": DECORATION}
    for side in (-1, 1):
        long = BAR_M[0] + 2 * (SLACK_M + WALL_M)
        box(world, (x + side * inner, y, z + DEEP_M / 2), (WALL_M, long, DEEP_M), "socket", **solid)
        box(world, (x, y + side * inner, z + DEEP_M / 2), (long, WALL_M, DEEP_M), "socket", **solid)


def _add_bar(world: Any) -> None:
    """The tool: a bar with a blue handle at its upper end."""
    x, y, z = STAND_M
    body = world.add_body(name="tool", pos=[x, y, z + BAR_M[2] / 2])
    body.add_freejoint(name="tool")
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[edge / 2 for edge in BAR_M], mass=BAR_KG,
        contype=OBJECT_BIT, conaffinity=OBJECT_BIT | SCENE_BIT, group=DECORATION, material="bar",
    )  # fmt: skip
    cylinder(
        body, (0, 0, HANDLE_UP_M - 0.06), (0, 0, HANDLE_UP_M + 0.06), 0.0235, "handle", **LOOKS_ONLY
    )
