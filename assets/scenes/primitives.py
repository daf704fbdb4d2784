"""Short words for MuJoCo geoms: boxes, rods and shells, decorative or solid."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import mujoco
import numpy as np

from hrc_env.scene.primitives import LOOKS_ONLY, SCENE_BIT, SOLID, Vector, rod_pose

HIDES = {"contype": 0, "conaffinity": 0, "density": 0, "group": SOLID}
"""Solid to the eye and out of the arm's reach: testing it for contacts would cost time."""
SOLID_SCENE = {"contype": SCENE_BIT, "conaffinity": 0, "density": 0, "group": SOLID}


def yaw_quaternion(yaw_rad: float) -> np.ndarray:
    """Quaternion (wxyz) of a turn about the vertical."""
    return np.array([np.cos(yaw_rad / 2), 0.0, 0.0, np.sin(yaw_rad / 2)])


def cylinder(body: Any, start: Vector, end: Vector, radius: float, material: str, **more: Any):
    """A cylinder between two points, looks only unless `more` says otherwise."""
    pos, quat, half = rod_pose(start, end)
    return body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius, half, 0],
        pos=pos,
        quat=quat,
        material=material,
        **(LOOKS_ONLY | more),
    )


def ellipsoid(body: Any, centre: Vector, radii: Vector, material: str, **more: Any):
    """An ellipsoid with its axes along the body's."""
    return body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        size=list(radii),
        pos=list(centre),
        material=material,
        **(LOOKS_ONLY | more),
    )


def box(body: Any, centre: Vector, size: Vector, material: str, yaw: float = 0.0, **more: Any):
    """A box of full edge lengths `size` [m] round `centre`, turned by `yaw` [rad]."""
    return body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[edge / 2 for edge in size],
        pos=list(centre),
        quat=yaw_quaternion(yaw),
        material=material,
        **(LOOKS_ONLY | more),
    )


@dataclass(frozen=True, slots=True)
class Painted:
    """A material with a picture on it, which is only painted when somebody looks."""

    paint: Callable[[], np.ndarray]
    """Makes the picture, (H, W, 3) of 0..255."""
    specular: float = 0.05
    shininess: float = 0.1
    emission: float = 0.0


def add_painted(spec: Any, materials: dict[str, Painted]) -> None:
    """The materials, still plain."""
    for name, painted in materials.items():
        spec.add_material(
            name=name,
            specular=painted.specular,
            shininess=painted.shininess,
            emission=painted.emission,
        )


def paint_materials(spec: Any, materials: dict[str, Painted]) -> None:
    """Paint those of the materials that the scene has."""
    for name, painted in materials.items():
        material = spec.material(name)
        if material is None:
            continue
        image = _image(painted)
        texture = spec.add_texture(
            name=name, type=mujoco.mjtTexture.mjTEXTURE_2D,
            width=image.shape[1], height=image.shape[0], nchannel=3,
        )  # fmt: skip
        texture.data = np.ascontiguousarray(image).tobytes()
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


@cache
def _image(painted: Painted) -> np.ndarray:
    """(H, W, 3) painted once, for a place with clutter and without."""
    return np.clip(painted.paint(), 0, 255).astype(np.uint8)


def add_mesh(spec: Any, name: str, vertices: np.ndarray, faces: np.ndarray) -> None:
    """A closed surface for looks, (V, 3) [m] and (F, 3), counter-clockwise from outside."""
    spec.add_mesh(
        name=name,
        uservert=np.asarray(vertices, float).ravel(),
        userface=np.asarray(faces, int).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
