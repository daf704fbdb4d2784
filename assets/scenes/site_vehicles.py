"""What drives or was driven onto the site: a truck with a box body, a store container, a toilet."""

from typing import Any

import mujoco
import numpy as np

from assets.scenes import textures
from assets.scenes.primitives import HIDES, Painted, add_mesh, box, cylinder
from hrc_env.scene.primitives import LOOKS_ONLY, capsule

TRUCK_XY_M = (0.4, -8.4)
"""Middle of the truck; it looks to +x, to the gate."""
CONTAINER_XY_M = (-8.4, -0.5)
TOILET_XY_M = (-6.4, 7.4)

COLOURS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "truck_white": ((0.86, 0.87, 0.86), 0.4, 0.4),
    "truck_blue": ((0.15, 0.29, 0.46), 0.6, 0.6),
    "truck_grey": ((0.30, 0.31, 0.33), 0.3, 0.3),
    "windscreen": ((0.10, 0.14, 0.18), 0.9, 0.8),
    "lamp_glass": ((0.95, 0.93, 0.85), 0.8, 0.8),
    "lamp_red": ((0.70, 0.08, 0.06), 0.6, 0.6),
    "rust_brown": ((0.50, 0.31, 0.22), 0.15, 0.2),
    "toilet_green": ((0.24, 0.46, 0.40), 0.3, 0.3),
    "toilet_roof": ((0.74, 0.76, 0.74), 0.3, 0.3),
}
"""Name: colour, specular, shininess."""


def _corrugated() -> textures.Paint:
    """A container's side: vertical ribs, a little rust at the foot."""
    rng = np.random.default_rng(71)
    paint = textures.mottled(rng, (256, 600), (150, 96, 68), 4.0)
    phase = (np.arange(600) % 24) / 24.0
    paint *= (0.82 + 0.22 * np.clip(np.abs(2 * phase - 1) * 2 - 0.5, 0, 1))[None, :, None]
    paint[:10] *= 0.7
    paint[-12:] *= 0.7
    rust = np.clip(textures.noise(rng, (256, 600), (30, 12)) - 1.2, 0, 1)[..., None]
    return paint + (np.array([92.0, 58, 40]) - paint) * rust


PAINTED = {"container": Painted(_corrugated, specular=0.15, shininess=0.2)}
"""Materials that carry a picture."""


def add_vehicles(spec: Any) -> None:
    """All of them."""
    _truck(spec)
    _container(spec.worldbody)
    _toilet(spec.worldbody)


def _truck(spec: Any) -> None:
    """Box body, cab, chassis, six wheels; the solid parts are three boxes."""
    truck = spec.worldbody.add_body(name="truck", pos=[*TRUCK_XY_M, 0.0])
    box(truck, (-1.2, 0, 2.12), (5.6, 2.4, 2.35), "truck_white", name="truck_box", **HIDES)
    box(truck, (2.72, 0, 1.62), (1.7, 2.2, 2.1), "truck_blue", name="truck_cab", **HIDES)
    box(truck, (-0.2, 0, 0.72), (7.2, 0.9, 0.4), "truck_grey", name="truck_frame", **HIDES)
    _box_body(truck)
    _cab(spec, truck)
    for x, sides in ((2.55, (-0.98, 0.98)), (-2.1, (-0.93, 0.93)), (-3.1, (-0.93, 0.93))):
        for y in sides:
            _wheel(truck, x, y, 0.2 if x > 0 else 0.42)
    for y in (-0.95, 0.95):
        box(truck, (0.4, y, 0.68), (1.5, 0.30, 0.42), "truck_grey")
        box(truck, (-2.6, 1.22 * y, 1.06), (2.5, 0.10, 0.05), "rubber")


def _box_body(truck: Any) -> None:
    """Edges, ribs, doors and lamps of the box."""
    for y in (-1.21, 1.21):
        for z in (0.97, 3.27):
            box(truck, (-1.2, y, z), (5.66, 0.05, 0.09), "zinc")
        for x in (-4.0, 1.6):
            box(truck, (x, y, 2.12), (0.09, 0.05, 2.35), "zinc")
        for x in np.arange(-3.3, 1.2, 0.7):
            box(truck, (float(x), y, 2.12), (0.03, 0.016, 2.2), "zinc")
        box(truck, (-1.2, y, 1.35), (5.5, 0.012, 0.16), "truck_blue")
    for y in (-0.6, 0.6):
        box(truck, (-4.01, y, 2.12), (0.03, 1.14, 2.2), "truck_white")
        cylinder(truck, (-4.05, 0.25 * y, 1.1), (-4.05, 0.25 * y, 3.1), 0.014, "zinc")
        box(truck, (-4.02, 1.7 * y, 0.86), (0.05, 0.34, 0.13), "lamp_red")
    box(truck, (-3.95, 0, 0.62), (0.10, 2.3, 0.14), "truck_grey")


def _cab(spec: Any, truck: Any) -> None:
    """A slanting front over the solid block, panes, bumper, lamps, mirrors, steps."""
    profile = ((1.86, 0.55), (3.72, 0.55), (3.74, 1.55), (3.42, 2.68), (1.86, 2.74))
    n = len(profile)
    vertices = np.array([(x, side * 1.15, z) for side in (-1, 1) for x, z in profile])
    faces = [(0, i, i + 1) for i in range(1, n - 1)]
    faces += [(n, n + i + 1, n + i) for i in range(1, n - 1)]
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, n + i, n + j), (i, n + j, j)]
    add_mesh(spec, "cab", vertices, np.array(faces))
    truck.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname="cab", material="truck_blue", **LOOKS_ONLY
    )
    lean = [np.cos(-0.14), 0.0, np.sin(-0.14), 0.0]
    truck.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.012, 1.04, 0.44], pos=[3.59, 0, 2.10], quat=lean,
        material="windscreen", **LOOKS_ONLY,
    )  # fmt: skip
    for y in (-1.152, 1.152):
        box(truck, (2.95, y, 2.12), (0.92, 0.012, 0.62), "windscreen")
        box(truck, (2.36, y, 1.62), (0.02, 0.014, 1.9), "truck_grey")
        box(truck, (2.62, y, 1.56), (0.22, 0.02, 0.04), "zinc")
        box(truck, (2.0, y, 0.62), (0.46, 0.06, 0.30), "truck_grey")
        box(truck, (3.66, 1.16 * y, 2.1), (0.10, 0.20, 0.46), "truck_grey")
        capsule(truck, (3.6, y, 2.4), (3.66, 1.16 * y, 2.3), 0.015, material="rubber", **LOOKS_ONLY)
        box(truck, (3.765, 0.76 * y, 0.86), (0.06, 0.36, 0.17), "lamp_glass")
        box(truck, (3.765, 0.98 * y, 1.05), (0.05, 0.12, 0.09), "cone_orange")
    box(truck, (3.74, 0, 0.62), (0.16, 2.36, 0.30), "truck_grey")
    for z in np.arange(1.0, 1.5, 0.12):
        box(truck, (3.745, 0, float(z)), (0.03, 1.3, 0.05), "truck_grey")
    for y in (-0.8, 0.8):
        box(truck, (2.6, y, 2.76), (0.2, 0.16, 0.08), "cone_orange")


def _wheel(truck: Any, x: float, y: float, width: float) -> None:
    """A tyre with a rim; a wide one stands for two."""
    side = np.sign(y)
    inner, outer = y - side * width / 2, y + side * width / 2
    cylinder(truck, (x, inner, 0.5), (x, outer, 0.5), 0.5, "rubber")
    cylinder(truck, (x, outer - side * 0.02, 0.5), (x, outer + side * 0.012, 0.5), 0.28, "zinc")
    cylinder(truck, (x, outer, 0.5), (x, outer + side * 0.05, 0.5), 0.10, "truck_grey")


def _container(world: Any) -> None:
    """A 20-foot store with its doors to the south."""
    x, y = CONTAINER_XY_M
    size = (2.44, 6.06, 2.48)
    box(world, (x, y, 0.11 + 1.24), size, "container", name="container", **HIDES)
    for sx in (-1, 1):
        for sy in (-1, 1):
            corner = (x + sx * 1.17, y + sy * 2.98)
            box(world, (*corner, 1.295), (0.14, 0.14, 2.59), "rust_brown")
            box(world, (*corner, 0.05), (0.3, 0.3, 0.1), "pine_dark")
    for z in (0.17, 2.52):
        for sx in (-1, 1):
            box(world, (x + sx * 1.2, y, z), (0.08, 6.0, 0.14), "rust_brown")
        for sy in (-1, 1):
            box(world, (x, y + sy * 3.01, z), (2.36, 0.08, 0.14), "rust_brown")
    for dx in (-0.8, -0.35, 0.35, 0.8):
        at = (x + dx, y - 3.07)
        cylinder(world, (*at, 0.2), (*at, 2.45), 0.018, "zinc")
    box(world, (x + 1.225, y + 1.2, 1.55), (0.02, 1.3, 0.9), "windscreen")
    for dz in (-0.47, 0.47):
        box(world, (x + 1.23, y + 1.2, 1.55 + dz), (0.04, 1.4, 0.06), "white_gloss")


def _toilet(world: Any) -> None:
    """A cabin of plastic with a light roof."""
    x, y = TOILET_XY_M
    box(world, (x, y, 1.1), (1.1, 1.1, 2.2), "toilet_green", name="toilet", **HIDES)
    box(world, (x, y, 2.24), (1.16, 1.16, 0.10), "toilet_roof")
    box(world, (x, y - 0.556, 1.05), (0.78, 0.02, 1.9), "toilet_roof")
    box(world, (x, y - 0.562, 1.05), (0.70, 0.02, 1.82), "toilet_green")
    box(world, (x + 0.27, y - 0.58, 1.05), (0.06, 0.04, 0.12), "dark_steel")
    for dz in (1.7, 1.78, 1.86):
        box(world, (x, y - 0.574, dz), (0.4, 0.01, 0.03), "dark_steel")
