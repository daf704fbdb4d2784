"""Clamping: parts of a body that the robot would press against something and that cannot yield.

A part is clamped if the line from the robot's point through the part meets a fixed shape of the
scene, or a capsule of another link of the robot, closer behind the part's surface than the minimum
gap of its region (`BodyRegion.min_gap_m`). ISO 13854 counts the gap from the robot's surface on; to
count it from the far side of the part is stricter by the thickness of the part. Links count as
fixed, whether or not they move. A part that other parts of the body hold, such as a hand on a
thigh, is not clamped.
"""

from typing import NamedTuple

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints, Vector3
from hrc_env.geometry.shapes import CENTRE, REACH, passage


class Installation(NamedTuple):
    """Everything against which a robot can clamp a part of a body."""

    obstacles: Floats
    """Fixed shapes (G, `shapes.WIDTH`)."""
    robot: Floats
    """Capsules of the robot (K, `shapes.WIDTH`)."""
    links: Ints
    """Index of the link that carries each of these capsules (K,)."""


@kernel
def is_clamped(
    installation: Installation, link: int, centre: Vector3, direction: Floats, reach_m: float
) -> bool:
    """Return whether a part of a body would be clamped if it were pushed.

    Args:
        installation: the fixed shapes and the robot.
        link: index of the link that pushes; its capsules are left out.
        centre: point on the axis of the part that is pushed [m].
        direction: (3,) unit vector of the push.
        reach_m: distance from the centre, the radius of the part plus the minimum gap, within which
            something clamps the part [m].
    """
    for g in range(len(installation.obstacles)):
        if is_met(installation.obstacles, g, centre, direction, reach_m):
            return True
    for k in range(len(installation.links)):
        is_other = installation.links[k] != link
        if is_other and is_met(installation.robot, k, centre, direction, reach_m):
            return True
    return False


@kernel
def is_met(table: Floats, row: int, centre: Vector3, direction: Floats, reach_m: float) -> bool:
    """Return whether a ray meets a shape of a table within a distance `reach_m` [m]."""
    x = centre.x - table[row, CENTRE]
    y = centre.y - table[row, CENTRE + 1]
    z = centre.z - table[row, CENTRE + 2]
    if x * x + y * y + z * z > (table[row, REACH] + reach_m) ** 2:
        return False
    found = passage(table, row, Vector3(x, y, z), direction)
    return found.enter <= reach_m and found.leave >= 0.0 and found.enter <= found.leave
