"""The construction site: the paper's 20 x 20 m, a timber house in the middle of being built.

The robot stands on the house's slab, where the laboratory has it, so that tasks fit both. Two
walls are up, half of them open studs; a scaffold stands outside one of them. Truck, container and
stacks stand where deliveries leave them: at the sides. The four cameras hang on masts in the
corners at 5 m. Layout and colours: judgement; `tests/properties/` measures what hides.
"""

from typing import Any

import mujoco
import numpy as np

from assets.rotations import quaternion_from_matrix
from assets.scenes import arena, furniture, site_house, site_stock, site_vehicles, textures
from assets.scenes.markings import mark_cell
from assets.scenes.pedestal import MOUNT_WORLD
from assets.scenes.primitives import (
    HIDES,
    SOLID_SCENE,
    Painted,
    add_painted,
    box,
    cylinder,
    ellipsoid,
    paint_materials,
)
from assets.scenes.textures import Paint
from hrc_env.scene.primitives import LOOKS_ONLY, capsule
from hrc_env.scene.rig import SITE_CAMERAS

SIDE_M = 20.0
CORNER_M = 9.6
HOARDING_M = 2.2
GROUND_PX_PER_M = 72
SLAB_PX_PER_M = 130


def _ground() -> Paint:
    """Sandy soil with tracks of tyres between the gate and the truck, stones, and damp patches."""
    rng, px = np.random.default_rng(61), GROUND_PX_PER_M
    n = round(SIDE_M * px)
    paint = textures.mottled(rng, (n, n), (181, 157, 121), 7.0)
    paint += 9.0 * textures.noise(rng, (n, n), (500, 500))[..., None]
    x = (np.arange(n) + 0.5)[None] / px - SIDE_M / 2
    y = SIDE_M / 2 - (np.arange(n) + 0.5)[:, None] / px
    tread = 0.75 + 0.25 * (np.sin(2 * np.pi * (x + 0.35 * np.abs(np.sin(9 * y))) / 0.16) > 0)
    for lane in (-8.4, -8.1):
        for side in (-0.95, 0.95):
            middle = lane + side + 0.25 * np.sin(0.35 * x + lane)
            rut = np.exp(-(((y - middle) / 0.16) ** 4)) * (x > -6.5)
            paint -= (26 * rut * tread)[..., None]
    stones = rng.random((n, n)) < 0.004
    paint[stones] += rng.normal(0, 34, (int(stones.sum()), 1))
    damp = textures.noise(rng, (n, n), (190, 190)) > 1.25
    paint[damp] *= 0.9
    return paint


def _slab() -> Paint:
    """Trowelled concrete with the robot's cell on it."""
    (x0, x1), (y0, y1) = site_house.SLAB_X_M, site_house.SLAB_Y_M
    paint = textures.concrete_floor((x1 - x0, y1 - y0), SLAB_PX_PER_M)
    height, width = paint.shape[:2]
    x = x0 + (np.arange(width) + 0.5)[None] / SLAB_PX_PER_M
    y = y1 - (np.arange(height) + 0.5)[:, None] / SLAB_PX_PER_M
    mark_cell(paint, x - MOUNT_WORLD[0], y - MOUNT_WORLD[1], SLAB_PX_PER_M)
    dust = textures.noise(np.random.default_rng(62), (height, width), (90, 90))
    share = 0.28 * np.clip(dust, 0, 1)[..., None]
    return paint * (1 - share) + share * np.array([186.0, 164, 130])


def _hoarding() -> Paint:
    """Painted plywood panels of 1.25 m with battens, weathered at the foot."""
    rng, px = np.random.default_rng(63), 56
    shape = (round(HOARDING_M * px), round(SIDE_M * px))
    paint = textures.mottled(rng, shape, (126, 148, 158), 4.0)
    panel = round(1.25 * px)
    for i, start in enumerate(range(0, shape[1], panel)):
        paint[:, start : start + panel] += rng.normal(0, 5) + (10 if i % 4 == 1 else 0)
        paint[:, start : start + 2] *= 0.6
    splash = np.exp(-(shape[0] - 1 - np.arange(shape[0])) / (0.16 * px))
    paint += (splash[:, None, None]) * (np.array([168.0, 148, 118]) - paint) * 0.75
    return paint


def _meadow() -> Paint:
    """What lies outside."""
    return textures.mottled(np.random.default_rng(64), (512, 512), (118, 132, 84), 8.0)


PAINTED = {
    "ground": Painted(_ground, specular=0.0, shininess=0.0),
    "slab": Painted(_slab, specular=0.08, shininess=0.15),
    "hoarding": Painted(_hoarding, specular=0.05),
    "meadow": Painted(_meadow, specular=0.0, shininess=0.0),
}
"""Materials of the site that carry a picture; those of its things stand with the things."""
BORROWED = ("pine", "pine_dark", "beech", "plan", "cardboard", "insulation", "plywood_edges")
"""Materials that the laboratory's furniture has as well."""
ALL_PAINTED = (
    PAINTED
    | {name: furniture.PAINTED[name] for name in BORROWED}
    | site_house.PAINTED
    | site_stock.PAINTED
    | site_vehicles.PAINTED
)
COLOURS = arena.COLOURS | site_house.COLOURS | site_stock.COLOURS | site_vehicles.COLOURS


def add_site(spec: Any, clutter: bool) -> None:
    """Build the site; without clutter only ground, slab, hoarding, masts and light."""
    _add_light(spec)
    for name, (colour, specular, shininess) in COLOURS.items():
        spec.add_material(name=name, rgba=[*colour, 1], specular=specular, shininess=shininess)
    add_painted(spec, ALL_PAINTED)
    _add_ground(spec)
    for facing in ((0, -1), (0, 1), (-1, 0), (1, 0)):
        _add_hoarding(spec, facing)
    _add_masts(spec.worldbody)
    _add_horizon(spec)
    if clutter:
        site_house.add_house(spec.worldbody)
        site_vehicles.add_vehicles(spec)
        site_stock.add_stock(spec)
        furniture.add_workbench(spec)


def paint_site(spec: Any) -> None:
    """Paint what `add_site` has built."""
    paint_materials(spec, ALL_PAINTED)
    _paint_sky(spec)


def _add_light(spec: Any) -> None:
    """A sunny morning with light haze: one sun that casts shadows, and the sky from all sides."""
    headlight = spec.visual.headlight
    headlight.ambient[:] = 0.50
    headlight.diffuse[:] = 0.10
    headlight.specular[:] = 0.02
    directional = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    spec.worldbody.add_light(
        name="sun", type=directional, pos=[6.0, -9.0, 16.0], dir=[-0.38, 0.55, -1.0],
        diffuse=[0.62, 0.58, 0.51], specular=[0.25] * 3, ambient=[0, 0, 0], castshadow=True,
    )  # fmt: skip
    spec.worldbody.add_light(
        name="sky", type=directional, pos=[0, 0, 16.0], dir=[0.45, -0.5, -0.6],
        diffuse=[0.13, 0.15, 0.19], specular=[0.0] * 3, ambient=[0, 0, 0], castshadow=False,
    )  # fmt: skip
    spec.stat.extent = 20.0
    spec.stat.center = [0.0, 0.0, 1.0]
    spec.visual.map.znear, spec.visual.map.zfar = 0.004, 8.0
    spec.visual.map.shadowscale, spec.visual.map.shadowclip = 0.9, 0.6


def _paint_sky(spec: Any) -> None:
    """Soft clouds over haze, as a cube round everything."""
    faces = textures.sky_cube(256)
    texture = spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        width=faces.shape[1], height=faces.shape[0], nchannel=3,
    )  # fmt: skip
    texture.data = np.clip(faces, 0, 255).astype(np.uint8).tobytes()


def _add_ground(spec: Any) -> None:
    plane, world = mujoco.mjtGeom.mjGEOM_PLANE, spec.worldbody
    world.add_geom(
        name="floor", type=plane, size=[SIDE_M / 2, SIDE_M / 2, 0.1], material="ground",
        castshadow=False, **SOLID_SCENE,
    )  # fmt: skip
    (x0, x1), (y0, y1) = site_house.SLAB_X_M, site_house.SLAB_Y_M
    world.add_geom(
        name="slab", type=plane, size=[(x1 - x0) / 2, (y1 - y0) / 2, 0.1],
        pos=[(x0 + x1) / 2, (y0 + y1) / 2, 0.004], material="slab", castshadow=False, **LOOKS_ONLY,
    )  # fmt: skip
    world.add_geom(
        name="meadow", type=plane, size=[90, 90, 0.1], pos=[0, 0, -0.05], material="meadow",
        castshadow=False, **LOOKS_ONLY,
    )  # fmt: skip


def _add_hoarding(spec: Any, facing: tuple[int, int]) -> None:
    """One side's fence, its texture upright, with posts."""
    normal, up = np.array([*facing, 0.0]), np.array([0.0, 0.0, 1.0])
    axes = np.stack([np.cross(up, normal), up, normal], -1)
    middle = -normal * SIDE_M / 2
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[SIDE_M / 2, HOARDING_M / 2, 0.1],
        pos=middle + up * HOARDING_M / 2, quat=quaternion_from_matrix(axes), material="hoarding",
        castshadow=False, **HIDES,
    )  # fmt: skip
    along = axes[:, 0]
    start, end = middle - along * SIDE_M / 2, middle + along * SIDE_M / 2
    lift = up * (HOARDING_M + 0.02)
    capsule(
        spec.worldbody, start + lift + 0.02 * normal, end + lift + 0.02 * normal, 0.03,
        material="pine_dark", **LOOKS_ONLY,
    )  # fmt: skip


def _add_masts(world: Any) -> None:
    """A steel tube with a concrete foot and a camera's housing in every corner."""
    for camera in SITE_CAMERAS:
        x, y, z = camera.eye_world
        out = 1.0 + 0.16 / CORNER_M
        at = (x * out, y * out)
        cylinder(world, (*at, 0.0), (*at, z + 0.15), 0.05, "grey_steel")
        box(world, (*at, 0.2), (0.6, 0.6, 0.4), "site_concrete")
        back = 1.0 + 0.09 / CORNER_M
        box(world, (x * back, y * back, z + 0.02), (0.12, 0.12, 0.10), "white_gloss", np.pi / 4)


def _add_horizon(spec: Any) -> None:
    """Trees and gabled houses beyond the fence."""
    world, rng = spec.worldbody, np.random.default_rng(65)
    for _ in range(46):
        angle, away = rng.uniform(0, 2 * np.pi), rng.uniform(19, 42)
        x, y, size = away * np.cos(angle), away * np.sin(angle), rng.uniform(1.2, 2.4)
        tone = "leaves" if rng.random() < 0.6 else "leaves_dark"
        cylinder(world, (x, y, 0), (x, y, 1.2 * size), 0.16, "bark", castshadow=False)
        for dx, dz, share in ((0, 1.9, 1.0), (0.5, 1.5, 0.75), (-0.5, 1.55, 0.7)):
            radii = share * size * np.array([1.0, 1.0, 0.95])
            centre = (x + dx * size, y + 0.4 * dx * size, dz * size)
            ellipsoid(world, centre, radii, tone, castshadow=False)
    site_house.add_gable_mesh(spec)
    for i, angle in enumerate(np.arange(0.35, 6.2, 0.74)):
        x, y = 52 * np.cos(angle), 52 * np.sin(angle)
        site_house.add_far_house(world, (x, y), float(rng.uniform(-0.3, 0.3)), i)
