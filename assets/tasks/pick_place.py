"""Studs on a trestle table, and a rack into which they belong: `HRCPickPlace-v0`.

Lengths in metres from the middle of the robot's foot, on the pedestal's head.
"""

from typing import Any

import mujoco

from assets.scenes.primitives import LOOKS_ONLY, SOLID_SCENE, box, cylinder
from hrc_env.scene.primitives import DECORATION, OBJECT_BIT, SCENE_BIT
from hrc_env.tasks.pick_place import (
    PLACES_M,
    ROW_AT_M,
    ROW_M,
    STACK,
    STUD_KG,
    STUD_M,
    STUDS,
    SURFACE_M,
    TRESTLE,
)

FLOOR_M = -0.75
"""The floor below the foot."""
COLOURS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "plywood": ((0.66, 0.52, 0.36), 0.05, 0.1),
    "plywood_edge": ((0.52, 0.38, 0.24), 0.05, 0.1),
    "pine_stud": ((0.86, 0.70, 0.47), 0.08, 0.1),
    "pine_end": ((0.70, 0.50, 0.30), 0.05, 0.1),
    "trestle": ((0.88, 0.42, 0.10), 0.3, 0.3),
    "steel": ((0.30, 0.33, 0.37), 0.5, 0.4),
    "mark": ((0.95, 0.95, 0.92), 0.1, 0.1),
}
"""Name: colour, specular, shininess."""
BEARER_M, RAIL_M = 0.05, 0.014
"""Width of the bearers that studs rest on; how far the rails between places stand out."""


def add_pick_place(spec: Any) -> None:
    """Everything."""
    for name, (colour, specular, shininess) in COLOURS.items():
        spec.add_material(name=name, rgba=[*colour, 1], specular=specular, shininess=shininess)
    stack_x, laid_x = STACK.xy_m[0] - STACK.ahead_m, TRESTLE.xy_m[0] + TRESTLE.ahead_m
    span, aside = (ROW_AT_M[0] - 0.21, stack_x + 0.06), (laid_x - 0.20, laid_x + 0.20)
    _add_table(spec.worldbody, "table", span, ROW_AT_M[1], 0.56)
    _add_table(spec.worldbody, "trestle", aside, TRESTLE.xy_m[1], 0.36)
    _add_rack(spec.worldbody)
    for k in range(STUDS):
        _add_stud(spec.worldbody, k)


def _add_table(world: Any, name: str, span: tuple[float, float], y: float, width: float) -> None:
    """A board on trestles that spans some of x."""
    middle, length = sum(span) / 2, span[1] - span[0]
    at = middle, y, SURFACE_M - 0.015
    box(world, at, (length, width, 0.030), "plywood", name=name, **SOLID_SCENE)
    for side in (-1, 1):
        at_y = y + (width / 2 - 0.08) * side
        _add_trestle(world, middle, at_y, SURFACE_M - 0.030, length - 0.06)


def _add_trestle(world: Any, x: float, y: float, top: float, length: float) -> None:
    """A beam along x on two pairs of legs."""
    box(world, (x, y, top - 0.03), (length, 0.06, 0.06), "trestle")
    for end in (-1, 1):
        for lean in (-1, 1):
            foot = x + end * (length / 2 - 0.03), y + 0.12 * lean, FLOOR_M
            cylinder(world, foot, (foot[0], y + 0.015 * lean, top - 0.04), 0.014, "trestle")
    box(world, (x, y, FLOOR_M + 0.28), (length - 0.06, 0.012, 0.03), "trestle")


def _add_rack(world: Any) -> None:
    """Two bearers on posts, across which studs rest; a rail before, between and after places."""
    first, last = PLACES_M[0], PLACES_M[-1]
    middle, y, pitch = (first[0] + last[0]) / 2, first[1], PLACES_M[1][0] - first[0]
    length = last[0] - first[0] + pitch + RAIL_M
    for side in (-1, 1):
        at = y + 0.09 * side
        box(
            world, (middle, at, SURFACE_M - 0.02), (length, BEARER_M, 0.04), "steel",
            name=f"bearer_{'left' if side > 0 else 'right'}", **SOLID_SCENE,
        )  # fmt: skip
        for end in (-1, 1):
            post = middle + end * (length / 2 - 0.02), at
            cylinder(world, (*post, FLOOR_M), (*post, SURFACE_M - 0.04), 0.018, "steel")
            cylinder(world, (*post, FLOOR_M), (*post, FLOOR_M + 0.008), 0.045, "steel")
        for k in range(STUDS + 1):
            rail = first[0] + (k - 0.5) * pitch
            box(
                world, (rail, at, SURFACE_M + RAIL_M / 2), (RAIL_M, BEARER_M, RAIL_M), "trestle",
                contype=SCENE_BIT, conaffinity=0, density=0, group=DECORATION,
            )  # fmt: skip
    for x, y, _ in PLACES_M:
        box(world, (x, y, SURFACE_M - 0.06), (0.038, 0.11, 0.003), "mark")
    box(world, (middle, y, SURFACE_M - 0.065), (length, 0.13, 0.006), "steel")


def _add_stud(world: Any, k: int) -> None:
    """A piece of a stud, on edge, along its y."""
    x, y = ROW_AT_M
    at = [x + ROW_M * (k - 1), y, SURFACE_M + STUD_M[2] / 2]
    body = world.add_body(name=f"stud_{k + 1}", pos=at)
    body.add_freejoint(name=f"stud_{k + 1}")
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[edge / 2 for edge in STUD_M], mass=STUD_KG,
        contype=OBJECT_BIT, conaffinity=OBJECT_BIT | SCENE_BIT, group=DECORATION,
        material="pine_stud",
    )  # fmt: skip
    width, length, height = STUD_M
    for end in (-1, 1):
        box(
            body, (0, end * (length / 2 - 0.0005), 0), (width * 1.002, 0.0012, height * 1.002),
            "pine_end", **LOOKS_ONLY,
        )  # fmt: skip
