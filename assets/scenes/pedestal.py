"""What the robot stands on, the same in every scene."""

from typing import Any

from assets.scenes.primitives import SOLID_SCENE, box, cylinder
from hrc_env.scene.places import SCENES

MOUNT_WORLD = SCENES["lab"].mount_world
"""The same on the site."""

COLOURS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "arm_joint": ((0.64, 0.66, 0.69), 0.5, 0.45),
    "arm_black": ((0.05, 0.05, 0.055), 0.35, 0.3),
    "arm_dark": ((0.20, 0.21, 0.23), 0.4, 0.3),
    "arm_steel": ((0.74, 0.75, 0.77), 0.9, 0.8),
    "arm_plinth": ((0.17, 0.19, 0.22), 0.35, 0.3),
}
"""Name: colour, specular, shininess."""


def add_pedestal(spec: Any) -> None:
    """A steel column with a foot plate and a head plate that ends at `MOUNT_WORLD`; solid."""
    for name, (colour, specular, shininess) in COLOURS.items():
        spec.add_material(name=name, rgba=[*colour, 1], specular=specular, shininess=shininess)
    x, y, height = MOUNT_WORLD
    world = spec.worldbody
    box(
        world, (x, y, 0.010), (0.56, 0.56, 0.020), "arm_plinth", name="pedestal_foot", **SOLID_SCENE
    )
    cylinder(
        world, (x, y, 0.02), (x, y, height - 0.022), 0.105, "arm_plinth",
        name="pedestal_column", **SOLID_SCENE,
    )  # fmt: skip
    cylinder(
        world, (x, y, height - 0.022), (x, y, height), 0.15, "arm_dark",
        name="pedestal_head", **SOLID_SCENE,
    )  # fmt: skip
    for sx in (-1, 1):
        for sy in (-1, 1):
            foot = (x + 0.23 * sx, y + 0.23 * sy)
            cylinder(world, (*foot, 0.02), (*foot, 0.034), 0.016, "arm_steel")
    box(world, (x - 0.03, y + 0.115, 0.36), (0.17, 0.03, 0.22), "arm_joint")
    box(world, (x - 0.03, y + 0.131, 0.40), (0.11, 0.004, 0.07), "arm_black")
    cylinder(world, (x + 0.03, y + 0.13, 0.30), (x + 0.03, y + 0.142, 0.30), 0.016, "hazard_red")
