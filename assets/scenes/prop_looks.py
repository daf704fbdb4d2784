"""What the props look like: coloured geoms in the props' own frames, round their shapes.

Looks weigh nothing and touch nothing; lengths in metres.
"""

from collections.abc import Callable, Sequence
from typing import Any

import mujoco
import numpy as np

from assets.scenes import textures
from assets.scenes.primitives import Painted, add_mesh, box, cylinder, ellipsoid
from hrc_env.scene.primitives import LOOKS_ONLY, capsule

COLOURS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "prop_steel": ((0.68, 0.69, 0.71), 0.8, 0.7),
    "prop_dark": ((0.14, 0.15, 0.16), 0.3, 0.3),
    "prop_rubber": ((0.07, 0.07, 0.075), 0.15, 0.1),
    "prop_orange": ((0.90, 0.40, 0.10), 0.4, 0.4),
    "prop_grey": ((0.72, 0.73, 0.72), 0.4, 0.4),
    "prop_lime": ((0.62, 0.76, 0.18), 0.4, 0.4),
    "prop_blue": ((0.16, 0.34, 0.58), 0.4, 0.4),
    "prop_green": ((0.16, 0.40, 0.26), 0.4, 0.4),
    "prop_blade": ((0.95, 0.86, 0.30), 0.3, 0.3),
    "prop_sand": ((0.66, 0.54, 0.38), 0.05, 0.1),
}
"""Name: colour, specular, shininess."""
PAINTED = {
    "prop_pine": Painted(lambda: textures.wood((214, 178, 128), 13)),
    "prop_ash": Painted(lambda: textures.wood((196, 150, 98), 14)),
    "prop_carton": Painted(textures.cardboard),
}
"""Materials that carry a picture."""

SAW_BLADE = ((0.03, -0.085), (0.56, -0.045), (0.565, 0.0), (0.03, 0.025))
"""Outline (x, z), counter-clockwise seen from -y."""
CLAW = ((-0.078, 0.222), (-0.050, 0.242), (-0.012, 0.246), (-0.012, 0.262), (-0.046, 0.260))
"""The same."""
TRAY = (((0.98, 0.0), 0.20, 0.22, 0.45), ((0.66, 0.0), 0.42, 0.29, 0.74))
"""Bottom and top of the wheelbarrow's tray: middle, half length, half width, height."""


def add_prop_meshes(spec: Any) -> None:
    """Materials and meshes that the looks use, once a model."""
    for name, (colour, specular, shininess) in COLOURS.items():
        spec.add_material(name=name, rgba=[*colour, 1], specular=specular, shininess=shininess)
    add_mesh(spec, "saw_blade", *_prism(SAW_BLADE, 0.001))
    add_mesh(spec, "hammer_claw", *_prism(CLAW, 0.005))
    add_mesh(spec, "tray", *_frustum(*TRAY))


def _prism(outline: Sequence[tuple[float, float]], half_y: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a convex outline (x, z) with a thickness along y."""
    n = len(outline)
    vertices = np.array([(x, side * half_y, z) for side in (-1, 1) for x, z in outline])
    faces = [(0, i, i + 1) for i in range(1, n - 1)]
    faces += [(n, n + i + 1, n + i) for i in range(1, n - 1)]
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, n + i, n + j), (i, n + j, j)]
    return vertices, np.array(faces)


def _frustum(bottom: tuple, top: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a body between two level rectangles."""
    vertices = [
        (x + sx * length, y + sy * width, z)
        for (x, y), length, width, z in (bottom, top)
        for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    faces = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7)]
    for i in range(4):
        j = (i + 1) % 4
        faces += [(i, j, 4 + j), (i, 4 + j, 4 + i)]
    return np.array(vertices), np.array(faces)


def _mesh(body: Any, mesh: str, material: str, y: float = 0.0) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh, material=material, pos=[0, y, 0],
        **LOOKS_ONLY,
    )  # fmt: skip


def _bar(body: Any, start: Sequence[float], end: Sequence[float], radius: float, material: str):
    capsule(body, start, end, radius, material=material, **LOOKS_ONLY)


def _wheel(body: Any, centre: tuple[float, float, float], radius: float, width: float) -> None:
    """A tyre on a grey hub, its axle along y."""
    x, y, z = centre
    for part, half, material in (
        (radius, width / 2, "prop_rubber"),
        (0.55 * radius, 0.52 * width, "prop_grey"),
        (0.15 * radius, 0.62 * width, "prop_dark"),
    ):
        cylinder(body, (x, y - half, z), (x, y + half, z), part, material)


def _hammer(body: Any) -> None:
    cylinder(body, (0, 0, 0.04), (0, 0, 0.268), 0.0125, "prop_ash")
    _bar(body, (0, 0, -0.09), (0, 0, 0.05), 0.0165, "prop_blue")
    cylinder(body, (0, 0, -0.108), (0, 0, -0.100), 0.019, "prop_dark")
    box(body, (0, 0, 0.250), (0.034, 0.028, 0.036), "prop_steel")
    cylinder(body, (0.010, 0, 0.25), (0.046, 0, 0.25), 0.0125, "prop_steel")
    cylinder(body, (0.044, 0, 0.25), (0.062, 0, 0.25), 0.0175, "prop_steel")
    for y in (-0.010, 0.010):
        _mesh(body, "hammer_claw", "prop_steel", y)


def _drill(body: Any) -> None:
    cylinder(body, (-0.075, 0, 0.09), (0.055, 0, 0.09), 0.034, "prop_grey")
    ellipsoid(body, (-0.075, 0, 0.09), (0.016, 0.034, 0.034), "prop_dark")
    cylinder(body, (0.020, 0, 0.09), (0.034, 0, 0.09), 0.0348, "prop_orange")
    cylinder(body, (0.055, 0, 0.09), (0.082, 0, 0.09), 0.030, "prop_dark")
    cylinder(body, (0.082, 0, 0.09), (0.125, 0, 0.09), 0.021, "prop_dark")
    cylinder(body, (0.125, 0, 0.09), (0.140, 0, 0.09), 0.013, "prop_steel")
    cylinder(body, (0.140, 0, 0.09), (0.225, 0, 0.09), 0.004, "prop_steel")
    _bar(body, (-0.012, 0, -0.05), (0.0, 0, 0.07), 0.021, "prop_dark")
    box(body, (0.020, 0, 0.045), (0.014, 0.016, 0.030), "prop_orange")
    box(body, (0.005, 0, -0.078), (0.120, 0.074, 0.028), "prop_grey")
    box(body, (0.008, 0, -0.106), (0.126, 0.078, 0.032), "prop_dark")


def _saw(body: Any) -> None:
    _mesh(body, "saw_blade", "prop_steel")
    for start, end in (
        ((-0.022, 0, -0.050), (-0.012, 0, 0.045)),
        ((-0.012, 0, 0.045), (0.045, 0, 0.030)),
        ((-0.022, 0, -0.050), (0.045, 0, -0.070)),
        ((0.045, 0, -0.070), (0.055, 0, 0.022)),
    ):
        _bar(body, start, end, 0.0125, "prop_orange")


def _tape_measure(body: Any) -> None:
    y = -0.25
    box(body, (0, y, -0.010), (0.070, 0.044, 0.048), "prop_lime")
    cylinder(body, (0, y - 0.022, 0.002), (0, y + 0.022, 0.002), 0.037, "prop_lime")
    for side in (-1, 1):
        at = y + 0.0225 * side
        cylinder(body, (0, at, 0.002), (0, at + 0.002 * side, 0.002), 0.024, "prop_dark")
    box(body, (0, 0.0, -0.026), (0.024, 0.52, 0.002), "prop_blade")
    box(body, (0, 0.262, -0.030), (0.026, 0.004, 0.020), "prop_steel")


def _board(body: Any) -> None:
    # A picture's grain runs along x, so the board lies along x, turned.
    box(body, (0, 0, 0), (2.4, 0.089, 0.038), "prop_pine", np.pi / 2)


def _carton(body: Any) -> None:
    box(body, (0, 0, 0), (0.34, 0.396, 0.30), "prop_carton")
    box(body, (0, 0, 0.151), (0.344, 0.05, 0.003), "prop_blade")


def _cart(body: Any) -> None:
    box(body, (0.58, 0, 0.20), (0.94, 0.60, 0.035), "prop_blue")
    box(body, (0.58, 0, 0.22), (0.90, 0.56, 0.012), "prop_ash")
    for y in (-0.27, 0.27):
        _bar(body, (0.13, y, 0.20), (0.06, y, 0.92), 0.016, "prop_steel")
        _bar(body, (0.06, y, 0.92), (0.0, 0.93 * y, 0.98), 0.016, "prop_steel")
        for x in (0.25, 0.88):
            box(body, (x, 0.81 * y, 0.155), (0.07, 0.06, 0.06), "prop_grey")
            _wheel(body, (x, 0.81 * y, 0.08), 0.08, 0.035)
    _bar(body, (0.0, -0.25, 0.98), (0.0, 0.25, 0.98), 0.017, "prop_rubber")
    _bar(body, (0.095, -0.27, 0.56), (0.095, 0.27, 0.56), 0.012, "prop_steel")
    box(body, (0.46, 0.02, 0.386), (0.38, 0.42, 0.32), "prop_carton", 0.04)
    box(body, (0.82, -0.03, 0.336), (0.28, 0.36, 0.22), "prop_carton", -0.08)
    box(body, (0.46, 0.02, 0.598), (0.30, 0.20, 0.10), "prop_orange", 0.2)
    _bar(body, (0.40, 0.02, 0.665), (0.52, 0.045, 0.665), 0.009, "prop_dark")


def _wheelbarrow(body: Any) -> None:
    for y in (-0.28, 0.28):
        _bar(body, (-0.02, y, 0.685), (0.45, 0.75 * y, 0.50), 0.017, "prop_dark")
        _bar(body, (0.45, 0.75 * y, 0.50), (1.22, 0.2 * y, 0.17), 0.017, "prop_dark")
        _bar(body, (-0.08, y, 0.705), (0.05, y, 0.66), 0.021, "prop_rubber")
        _bar(body, (0.40, 0.75 * y, 0.50), (0.44, 0.72 * y, 0.14), 0.014, "prop_dark")
        _bar(body, (0.44, 0.72 * y, 0.14), (0.62, 0.62 * y, 0.42), 0.014, "prop_dark")
    _bar(body, (0.44, -0.20, 0.14), (0.44, 0.20, 0.14), 0.014, "prop_dark")
    _mesh(body, "tray", "prop_green")
    ellipsoid(body, (0.66, 0, 0.73), (0.37, 0.255, 0.10), "prop_sand")
    _wheel(body, (1.22, 0, 0.18), 0.18, 0.08)


def _level(body: Any) -> None:
    box(body, (0, 0, 0), (0.024, 0.80, 0.056), "prop_grey")
    box(body, (0, 0, 0), (0.0255, 0.70, 0.030), "prop_orange")
    for y, half in ((0.0, 0.05), (-0.33, 0.022), (0.33, 0.022)):
        box(body, (0, y, 0.006), (0.027, 2 * half, 0.036), "prop_dark")
        _bar(body, (0, y - 0.6 * half, 0.008), (0, y + 0.6 * half, 0.008), 0.0145, "prop_lime")
    for y in (-0.402, 0.402):
        box(body, (0, y, 0), (0.028, 0.010, 0.060), "prop_rubber")


def _stud(body: Any) -> None:
    box(body, (0, 0, 0), (0.298, 0.089, 0.038), "prop_pine", np.pi / 2)
    for y in (-0.1495, 0.1495):
        box(body, (0, y, 0), (0.0892, 0.0012, 0.0382), "prop_ash")


LOOKS: dict[str, Callable[[Any], None]] = {
    "hammer": _hammer,
    "drill": _drill,
    "saw": _saw,
    "tape_measure": _tape_measure,
    "board": _board,
    "box": _carton,
    "cart": _cart,
    "wheelbarrow": _wheelbarrow,
    "level": _level,
    "stud": _stud,
}
"""By the props' names: adds the geoms to a body."""
