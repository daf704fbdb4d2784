"""The laboratory: floor, walls, light and what stands about in it."""

from typing import Any

import mujoco

from hrc_env.scene.primitives import SOLID_SCENE


def add_lab(spec: Any, clutter: bool) -> None:
    """Build the room."""
    spec.worldbody.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[3.045, 2.74, 0.1], **SOLID_SCENE
    )
    spec.add_material(name="hazard_red", rgba=[0.7, 0.1, 0.08, 1])
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, pos=[0, 0, 3], dir=[0.2, 0.1, -1]
    )
