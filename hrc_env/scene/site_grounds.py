"""Where people can stand, walk and work on the construction site."""

import math

import numpy as np

from hrc_env.core.records import Grounds, Workplace
from hrc_env.core.typing import Bools, Floats
from hrc_env.scene.grounds import (
    ROBOT_CLEARANCE_M,
    ROBOT_FRONT_RAD,
    ROBOT_XY_M,
    beside_robot,
    footprints,
)

OPEN_STUDS = ((-4.2, -0.1, 1.2, 0.06, np.pi / 2), (1.0, 4.6, 1.03, 0.06, 0.0))
"""Stretches of open studs, through which nobody walks: x, y, half length, half width, yaw."""
NORTH, SOUTH, EAST, WEST = math.pi / 2, -math.pi / 2, 0.0, math.pi

PLACES = (
    *beside_robot(1.15, (-0.7, -0.35, 0.0, 0.35, 0.7)),
    Workplace("slab_floor_1", "floor", (2.4, 2.0), NORTH, 0.0),
    Workplace("slab_floor_2", "floor", (-2.5, -2.2), 0.4, 0.0),
    Workplace("slab_floor_3", "floor", (3.2, -2.4), SOUTH, 0.0),
    Workplace("open_east", "open", (4.9, 0.4), WEST, 0.0),
    Workplace("open_south", "open", (0.4, -4.6), NORTH, 0.0),
    Workplace("open_west", "open", (-5.0, -3.0), EAST, 0.0),
    Workplace("open_north", "open", (3.2, 4.0), SOUTH, 0.0),
    Workplace("carts", "cart", (1.2, -3.0), EAST, 0.98),
    Workplace("gate", "cart", (5.4, -4.9), WEST, 0.98),
)
"""On the empty ground."""
CLUTTER_PLACES = (
    Workplace("table", "bench", (0.06, 1.75), WEST, 0.84),
    Workplace("west_studs_1", "wall", (-3.46, -1.0), WEST, 1.2),
    Workplace("west_studs_2", "wall", (-3.46, 0.2), WEST, 1.2),
    Workplace("north_studs_1", "wall", (0.6, 3.86), NORTH, 1.2),
    Workplace("north_studs_2", "wall", (1.4, 3.86), NORTH, 1.4),
    Workplace("lintel", "overhead", (-0.8, 4.2), NORTH, 1.95),
    Workplace("west_top", "overhead", (-3.5, 1.7), WEST, 1.95),
    Workplace("timber", "pile", (6.0, 2.6), EAST, 1.24),
    Workplace("timber_end", "pile", (6.0, 1.4), EAST, 1.24),
    Workplace("blocks", "pile", (5.1, -1.0), SOUTH, 0.9),
    Workplace("cartons", "pile", (4.1, 4.63), 0.9, 0.9),
    Workplace("hop_up", "step", (-2.9, 3.9 - 0.6), NORTH, 0.22),
    Workplace("sand", "cart", (-4.6, -4.9), -2.7, 0.69),
)
"""At walls (tools work 0.7 m ahead of who stands there), table and stacks."""


CONES = ((4.55, -3.95), (4.55, 5.15), (-4.75, -3.95), (2.0, -6.9), (6.6, -6.2), (-1.62, 0.86))
FLAT = (
    (-6.3, -5.6, 1.4, 1.3, 0.0),
    (1.05, 5.75, 0.45, 0.25, 0.0),
    (2.95, -5.65, 1.0, 0.6, 0.12),
    *((x, y, 0.14, 0.14, 0.2) for x, y in CONES),
)
"""What stands in the way and hides nobody: sand, a ladder's foot, a panel's struts, cones."""


def site_grounds(obstacles: Floats, clutter: bool) -> Grounds:
    """The middle of the site, between truck, container, scaffold and timber."""
    blocked = footprints(obstacles)
    if clutter:
        walls = np.array(OPEN_STUDS)
        blocked = np.concatenate([blocked[~_inside(blocked, walls)], walls, FLAT])
    return Grounds(
        walkable_x_m=(-5.5, 6.1),
        walkable_y_m=(-6.0, 6.3),
        blocked=blocked,
        places=PLACES + (CLUTTER_PLACES if clutter else ()),
        robot_xy_m=ROBOT_XY_M,
        robot_front_rad=ROBOT_FRONT_RAD,
        robot_clearance_m=ROBOT_CLEARANCE_M,
    )


def _inside(footprints_: Floats, wholes: Floats) -> Bools:
    """(N,) which footprints have their middle in one of the wholes (M, 5)."""
    x, y, half_length, half_width, yaw = wholes.T
    dx, dy = footprints_[:, :1] - x, footprints_[:, 1:2] - y
    along, aside = np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
    return ((np.abs(along) <= half_length) & (np.abs(aside) <= half_width)).any(1)
