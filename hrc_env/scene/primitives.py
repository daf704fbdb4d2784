"""Short words for MuJoCo geoms: boxes, rods and shells, decorative or solid.

Geom groups of every scene: 0 solid (drawn, collides, hides), 1 decoration (drawn only),
2 the robot's looks, 3 the robot's capsules (not drawn, hide), 4 the workers' capsules
(not drawn, do not hide), 5 what a view from above leaves out (ceiling, lamps).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

SOLID, DECORATION, ROBOT_LOOKS, ROBOT_CAPSULES, WORKER_CAPSULES, OVERHEAD = range(6)

SCENE_BIT, ROBOT_BIT, WORKER_BIT, OBJECT_BIT = 1, 2, 4, 16
"""contype bits; what can touch what is written in the conaffinity of the second."""

Vector = Sequence[float] | np.ndarray

LOOKS_ONLY = {"contype": 0, "conaffinity": 0, "density": 0, "group": DECORATION}
HIDES = {"contype": 0, "conaffinity": 0, "density": 0, "group": SOLID}
"""Solid to the eye and out of the arm's reach: testing it for contacts would cost time."""
SOLID_SCENE = {"contype": SCENE_BIT, "conaffinity": 0, "density": 0, "group": SOLID}


def rod_pose(start: Vector, end: Vector) -> tuple[np.ndarray, np.ndarray, float]:
    """Centre, quaternion (z along the rod) and half length of a rod between two points."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    axis = end - start
    length = float(np.linalg.norm(axis))
    quaternion = np.zeros(4)
    mujoco.mju_quatZ2Vec(quaternion, axis / max(length, 1e-9))
    return (start + end) / 2, quaternion, length / 2


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


def capsule(body: Any, start: Vector, end: Vector, radius: float, **more: Any):
    """A capsule whose axis runs between two points."""
    pos, quat, half = rod_pose(start, end)
    return body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[radius, half, 0], pos=pos, quat=quat, **more
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
        image = np.clip(painted.paint(), 0, 255).astype(np.uint8)
        texture = spec.add_texture(
            name=name, type=mujoco.mjtTexture.mjTEXTURE_2D,
            width=image.shape[1], height=image.shape[0], nchannel=3,
        )  # fmt: skip
        texture.data = np.ascontiguousarray(image).tobytes()
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


def add_mesh(spec: Any, name: str, vertices: np.ndarray, faces: np.ndarray) -> None:
    """A closed surface for looks, (V, 3) [m] and (F, 3), counter-clockwise from outside."""
    spec.add_mesh(
        name=name,
        uservert=np.asarray(vertices, float).ravel(),
        userface=np.asarray(faces, int).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
