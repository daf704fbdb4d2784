"""What the arm looks like: light tubes, grey joints, blue caps, a black ring at each joint.

Looks weigh nothing and touch nothing; lengths in metres, in the frames of the links.
"""

from typing import Any

from assets.scenes.primitives import cylinder, ellipsoid
from hrc_env.scene.primitives import ROBOT_LOOKS

SHOULDER, ELBOW, WRIST = 0.076, 0.062, 0.0475
UPPER_TUBE, FORE_TUBE = 0.0585, 0.0455
UPPER_LENGTH, FORE_LENGTH = 0.6127, 0.57155
UPPER_SIDE, FORE_SIDE = 0.1762, 0.0393
SHOULDER_HEIGHT, WRIST_SIDE, WRIST_DOWN, FLANGE = 0.1807, 0.17415, 0.11985, 0.11655
LOOKS = {"group": ROBOT_LOOKS}

MATERIALS: dict[str, tuple[tuple[float, float, float], float, float]] = {
    "arm_tube": ((0.83, 0.84, 0.85), 0.55, 0.55),
    "arm_joint": ((0.64, 0.66, 0.69), 0.5, 0.45),
    "arm_cap": ((0.40, 0.66, 0.88), 0.65, 0.6),
    "arm_black": ((0.05, 0.05, 0.055), 0.35, 0.3),
    "arm_dark": ((0.20, 0.21, 0.23), 0.4, 0.3),
    "arm_steel": ((0.74, 0.75, 0.77), 0.9, 0.8),
    "tool_shell": ((0.93, 0.62, 0.10), 0.5, 0.5),
}
"""Name: colour, specular, shininess."""


def add_arm_materials(spec: Any) -> None:
    """The arm's and the tool's colours."""
    for name, (colour, specular, shininess) in MATERIALS.items():
        spec.add_material(name=name, rgba=[*colour, 1], specular=specular, shininess=shininess)


def add_base_looks(base: Any) -> None:
    """The foot that is bolted down, its screws and the cable's plug."""
    cylinder(base, (0, 0, 0), (0, 0, 0.024), 0.095, "arm_dark", **LOOKS)
    cylinder(base, (0, 0, 0.024), (0, 0, 0.040), 0.080, "arm_joint", **LOOKS)
    for x, y in ((0.06, 0.06), (-0.06, 0.06), (0.06, -0.06), (-0.06, -0.06)):
        cylinder(base, (x, y, 0.02), (x, y, 0.03), 0.008, "arm_steel", **LOOKS)
    cylinder(base, (0, -0.07, 0.022), (0, -0.115, 0.022), 0.012, "arm_black", **LOOKS)


def add_link_looks(
    shoulder: Any, upper_arm: Any, forearm: Any, wrist_1: Any, wrist_2: Any, wrist_3: Any
) -> None:
    """The six moving links."""
    _shoulder(shoulder)
    _upper_arm(upper_arm)
    _forearm(forearm)
    _wrist(wrist_1, FORE_SIDE + 0.058, WRIST_SIDE, cap_side=1)
    _wrist(wrist_2, 0.058, WRIST_DOWN, cap_side=-1)
    ring = 0.058
    cylinder(wrist_3, (0, 0, ring), (0, 0, ring + 0.004), WRIST * 0.99, "arm_black", **LOOKS)
    cylinder(wrist_3, (0, 0, ring + 0.004), (0, 0, FLANGE - 0.012), 0.0455, "arm_dark", **LOOKS)
    cylinder(wrist_3, (0, 0, FLANGE - 0.012), (0, 0, FLANGE), 0.0445, "arm_steel", **LOOKS)
    plug = FLANGE - 0.032
    cylinder(wrist_3, (0.040, 0, plug), (0.056, 0, plug), 0.008, "arm_black", **LOOKS)


def _cap(link: Any, at: tuple[float, float, float], way: tuple[float, float, float], radius: float):
    """A blue lid: black ring, short cylinder, flat dome, in direction `way` from `at`."""

    def along(distance: float) -> tuple[float, ...]:
        return tuple(a + distance * w for a, w in zip(at, way, strict=True))

    cylinder(link, along(-0.0035), along(0.0015), radius * 1.01, "arm_black", **LOOKS)
    cylinder(link, along(0.0), along(0.020), radius * 0.985, "arm_cap", **LOOKS)
    dome = [radius * 0.985 if not w else 0.011 for w in way]
    ellipsoid(link, along(0.020), dome, "arm_cap", **LOOKS)


def _housing(
    link: Any, z_cap: float, z_open: float, radius: float, xy: tuple[float, float] = (0.0, 0.0)
) -> None:
    """A joint's drum along z: closed by a cap at one end, open at the other."""
    x, y = xy
    cylinder(link, (x, y, z_open), (x, y, z_cap), radius, "arm_joint", **LOOKS)
    _cap(link, (x, y, z_cap), (0, 0, 1 if z_cap > z_open else -1), radius)


def _tube(link: Any, length: float, z: float, radius: float, near: tuple, far: tuple) -> None:
    """A tube along -x with a collar and a black ring at both ends: (start, end, radius)."""
    cylinder(link, (-0.04, 0, z), (0.03 - length, 0, z), radius, "arm_tube", **LOOKS)
    for (start, end, collar), way in ((near, -1), (far, 1)):
        cylinder(link, (start, 0, z), (end, 0, z), collar, "arm_joint", **LOOKS)
        ring = (end, 0, z), (end + way * 0.003, 0, z)
        cylinder(link, *ring, radius * 1.03, "arm_black", **LOOKS)


def _shoulder(link: Any) -> None:
    h = SHOULDER_HEIGHT
    cylinder(link, (0, 0, 0.040), (0, 0, 0.0445), SHOULDER * 1.02, "arm_black", **LOOKS)
    cylinder(link, (0, 0, 0.0445), (0, 0, h + 0.012), SHOULDER, "arm_joint", **LOOKS)
    ellipsoid(link, (0, 0, h + 0.012), (SHOULDER, SHOULDER, 0.058), "arm_joint", **LOOKS)
    cylinder(link, (0, 0.062, h), (0, -0.094, h), SHOULDER * 0.985, "arm_joint", **LOOKS)
    _cap(link, (0, 0.062, h), (0, 1, 0), SHOULDER * 0.985)


def _upper_arm(link: Any) -> None:
    cylinder(link, (0, 0, 0.094), (0, 0, 0.0985), SHOULDER * 1.01, "arm_black", **LOOKS)
    _housing(link, UPPER_SIDE + 0.058, 0.0985, SHOULDER)
    far = UPPER_LENGTH
    _tube(
        link, far, UPPER_SIDE, UPPER_TUBE,
        near=(-0.070, -0.098, 0.0665), far=(0.062 - far, 0.095 - far, 0.0635),
    )  # fmt: skip
    _housing(link, UPPER_SIDE + 0.050, FORE_SIDE + 0.068, ELBOW, xy=(-far, 0))


def _forearm(link: Any) -> None:
    z, far = FORE_SIDE, FORE_LENGTH
    cylinder(link, (0, 0, z + 0.0635), (0, 0, z + 0.068), ELBOW * 1.01, "arm_black", **LOOKS)
    _housing(link, z - 0.048, z + 0.0635, ELBOW)
    _tube(
        link, far, z, FORE_TUBE,
        near=(-0.056, -0.083, 0.052), far=(0.045 - far, 0.072 - far, 0.049),
    )  # fmt: skip
    _housing(link, z - 0.046, z + 0.058, WRIST, xy=(-far, 0))


def _wrist(link: Any, z_ring: float, z_far: float, cap_side: int) -> None:
    """A drum along z that ends in a drum along y with its cap on one side."""
    cylinder(link, (0, 0, z_ring), (0, 0, z_ring + 0.004), WRIST * 1.01, "arm_black", **LOOKS)
    cylinder(link, (0, 0, z_ring + 0.004), (0, 0, z_far + 0.004), WRIST, "arm_joint", **LOOKS)
    ellipsoid(link, (0, 0, z_far + 0.004), (WRIST, WRIST, 0.040), "arm_joint", **LOOKS)
    near, far = 0.048 * cap_side, -0.058 * cap_side
    cylinder(link, (0, near, z_far), (0, far, z_far), WRIST * 0.985, "arm_joint", **LOOKS)
    _cap(link, (0, near, z_far), (0, cap_side, 0), WRIST * 0.985)
