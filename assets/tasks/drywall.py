"""A stack with a board, and a frame of studs: `HRCDrywall-v0`.

Lengths in metres from the middle of the robot's foot, on the pedestal's head.
"""

from typing import Any

import mujoco
import numpy as np

from assets.scenes.primitives import HIDES, LOOKS_ONLY, SOLID_SCENE, box
from hrc_env.scene.primitives import DECORATION, OBJECT_BIT, SCENE_BIT, WORKER_CAPSULES
from hrc_env.tasks.drywall import (
    BOARD_KG,
    BOARD_M,
    CUPS_M,
    NEAR_STUD_M,
    PLACE_M,
    R_PLACE,
    STACK_M,
    WALL_Y_M,
)

FLOOR_M, TOP_M = -0.75, 1.65
"""Floor and top of the frame."""
STUD_M = (0.038, 0.089)
WIDER_M = 0.13
"""So much wider and longer are the boards below the loose one, wherever it lies at first."""
COLOURS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "gypsum": ((0.86, 0.85, 0.82), 0.05, 0.1),
    "gypsum_edge": ((0.72, 0.70, 0.66), 0.05, 0.1),
    "frame": ((0.84, 0.68, 0.46), 0.08, 0.1),
    "frame_end": ((0.68, 0.50, 0.32), 0.05, 0.1),
    "bearer": ((0.60, 0.46, 0.30), 0.05, 0.1),
}
"""Name: colour, specular, shininess."""


def add_drywall(spec: Any) -> None:
    """Everything."""
    for name, (colour, specular, shininess) in COLOURS.items():
        spec.add_material(name=name, rgba=[*colour, 1], specular=specular, shininess=shininess)
    _add_frame(spec.worldbody)
    _add_stack(spec.worldbody)
    _add_board(spec.worldbody)
    turn = np.zeros(4)
    mujoco.mju_mat2Quat(turn, R_PLACE.ravel())
    spec.worldbody.add_site(name="place", pos=list(PLACE_M), quat=turn, size=[0.01] * 3, group=4)


def _add_frame(world: Any) -> None:
    """Five studs between two plates. One box stands for the three that the board covers: what is
    flat feels no gaps."""
    y, height = WALL_Y_M + STUD_M[1] / 2, TOP_M - FLOOR_M
    xs = np.array([PLACE_M[0] - 0.27, PLACE_M[0], NEAR_STUD_M])
    for k, x in enumerate(xs):
        box(
            world, (x, y, FLOOR_M + height / 2), (STUD_M[0], STUD_M[1], height - 0.076), "frame",
            name=f"stud_{k + 1}", **HIDES,
        )  # fmt: skip
    half = [(xs[2] - xs[0] + STUD_M[0]) / 2, STUD_M[1] / 2, height / 2 - 0.038]
    world.add_geom(
        name="studs", type=mujoco.mjtGeom.mjGEOM_BOX, size=half, density=0, contype=SCENE_BIT,
        pos=[(xs[0] + xs[2]) / 2, y, FLOOR_M + height / 2], conaffinity=0, group=WORKER_CAPSULES,
    )  # fmt: skip
    left, right = PLACE_M[0] - 0.72, NEAR_STUD_M + STUD_M[0] / 2
    box(
        world,
        (left + 0.019, y, FLOOR_M + height / 2),
        (STUD_M[0], STUD_M[1], height - 0.076),
        "frame",
    )
    for z in (FLOOR_M + 0.019, TOP_M - 0.019):
        middle = (left + right) / 2
        box(world, (middle, y, z), (right - left, STUD_M[1], 0.038), "frame")
    for x in (left + 0.1, right - 0.1):
        box(world, (x, y + 0.32, FLOOR_M + 0.02), (0.06, 0.6, 0.04), "bearer")
        box(world, (x, y + 0.30, FLOOR_M + 0.42), (0.04, 0.04, 0.95), "bearer")


def _add_stack(world: Any) -> None:
    """Wider boards on two bearers, and a loose one: it lies on its four corners only, which is
    quicker than edge on edge."""
    x, y, z = STACK_M
    top, wide, long = z - BOARD_M[2] / 2, BOARD_M[0] + WIDER_M, BOARD_M[1] + WIDER_M
    box(
        world, (x, y, (FLOOR_M + 0.09 + top) / 2), (wide, long, top - FLOOR_M - 0.09),
        "gypsum_edge", name="stack", **SOLID_SCENE,
    )  # fmt: skip
    box(world, (x, y, top - 0.0005), (wide * 0.998, long * 0.998, 0.0012), "gypsum")
    for side in (-1, 1):
        at = (x, y + 0.4 * side, FLOOR_M + 0.045)
        box(world, at, (wide, 0.09, 0.09), "bearer")


def _add_board(world: Any) -> None:
    """The loose board, its front up; the cups sit on its middle."""
    body = world.add_body(name="board", pos=list(STACK_M), quat=[0, 0, 0, 1])
    body.add_freejoint(name="board")
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[edge / 2 for edge in BOARD_M], mass=BOARD_KG,
        contype=OBJECT_BIT, conaffinity=OBJECT_BIT | SCENE_BIT, group=DECORATION, material="gypsum",
    )  # fmt: skip
    width, length, thick = BOARD_M
    for side in (-1, 1):
        box(
            body, (side * (width / 2), 0, 0), (0.0012, length, thick * 0.98), "gypsum_edge",
            **LOOKS_ONLY,
        )  # fmt: skip
    half = np.sqrt(0.5)
    body.add_site(
        name="board_cups",
        pos=[*CUPS_M, thick / 2],
        quat=[0, half, half, 0],
        size=[0.01] * 3,
        group=4,
    )
    body.add_site(name="board_middle", pos=[0, 0, 0], size=[0.01] * 3, group=4)
