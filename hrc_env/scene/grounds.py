"""Where people can stand, walk and work in the laboratory; footprints of what stands there."""

import math

import numpy as np

from hrc_env.core.records import Grounds, Workplace
from hrc_env.core.typing import Floats
from hrc_env.geometry.shapes import AXES, BOX, CENTRE, HALF_SIZE, KIND, PLANE

MOUNT_WORLD = (-0.75, 0.0, 0.75)
"""The middle of the pedestal's top, on which a robot stands [m]."""
ROBOT_XY_M = MOUNT_WORLD[:2]
ROBOT_FRONT_RAD = 0.0
"""It looks to world +x."""
ROBOT_CLEARANCE_M = 0.8
HEADROOM_M = 2.1
"""What begins higher than this does not stand in anybody's way [m]; a tall worker with a hat."""
STEP_OVER_M = 0.02
"""Nor does what ends lower than this [m]."""
UPRIGHT = 0.999
"""Cosine from which on a box counts as standing upright."""


def footprints(obstacles: Floats) -> Floats:
    """(N, 5) of shapes (G, `shapes.WIDTH`) that stand in the way: see `Grounds.blocked`.

    A box that stands upright is given exactly, anything else by a rectangle along x and y that
    holds it. What stands on the robot's axis is the robot's and left out.
    """
    rows = []
    for row in obstacles[obstacles[:, KIND] != PLANE]:
        half = _half_extent(row)
        z, away = row[CENTRE + 2], np.hypot(*(row[CENTRE : CENTRE + 2] - ROBOT_XY_M))
        if z - half[2] > HEADROOM_M or z + half[2] < STEP_OVER_M or away < 1e-3:
            continue
        axes, yaw = row[AXES:HALF_SIZE].reshape(3, 3), 0.0
        if row[KIND] == BOX and axes[2, 2] > UPRIGHT:
            yaw, half = math.atan2(axes[0, 1], axes[0, 0]), row[HALF_SIZE : HALF_SIZE + 3]
        rows.append((*row[CENTRE : CENTRE + 2], half[0], half[1], yaw))
    return np.array(rows, float).reshape(-1, 5)


def _half_extent(row: Floats) -> Floats:
    """(3,) half size of the box along x, y and z that holds a shape [m]."""
    axes, half = np.abs(row[AXES:HALF_SIZE].reshape(3, 3)), row[HALF_SIZE : HALF_SIZE + 3]
    if row[KIND] == BOX:
        return half @ axes
    return half[1] * axes[2] + half[0]


def beside_robot(radius_m: float, azimuth_rad: tuple[float, ...]) -> tuple[Workplace, ...]:
    """Places round the robot's axis, looking at it; the work is at the height of the hands."""
    x, y = ROBOT_XY_M
    return tuple(
        Workplace(
            f"robot_{i + 1}", "robot",
            (x + radius_m * math.cos(azimuth), y + radius_m * math.sin(azimuth)),
            azimuth + math.pi, 1.1,
        )
        for i, azimuth in enumerate(azimuth_rad)
    )  # fmt: skip


LAB_PLACES = (
    *beside_robot(1.15, (-0.7, -0.35, 0.0, 0.35, 0.7)),
    Workplace("floor", "floor", (1.5, 1.1), 0.6, 0.0),
    Workplace("open_1", "open", (1.0, -0.9), 2.5, 0.0),
    Workplace("open_2", "open", (1.9, 0.0), math.pi, 0.0),
    Workplace("open_3", "open", (0.9, 1.5), -2.2, 0.0),
    Workplace("cart", "cart", (1.0, -1.5), 0.0, 0.98),
)
"""In the empty room."""
LAB_CLUTTER_PLACES = (
    Workplace("table", "bench", (0.06, 1.75), math.pi, 0.84),
    Workplace("open_studs", "wall", (1.9, -2.0), -math.pi / 2, 1.2),
    Workplace("boarded_studs", "wall", (1.2, -2.0), -math.pi / 2, 1.2),
    Workplace("top_plate", "overhead", (1.55, -2.0), -math.pi / 2, 1.9),
    Workplace("cartons", "pile", (2.15, 1.85), 0.7, 0.6),
    Workplace("crate", "pile", (2.1, -1.75), -0.75, 0.75),
    Workplace("ladder", "step", (2.23, 0.82), 0.0, 0.22),
)
"""At the furniture: the table's end, the wall that is being built, the stacks in the corners."""


def lab_grounds(obstacles: Floats, clutter: bool) -> Grounds:
    """The laboratory's walkway; the room's sides and the robot's cell are no part of it."""
    return Grounds(
        walkable_x_m=(-0.1, 2.4),
        walkable_y_m=(-2.0, 2.0),
        blocked=footprints(obstacles),
        places=LAB_PLACES + (LAB_CLUTTER_PLACES if clutter else ()),
        robot_xy_m=ROBOT_XY_M,
        robot_front_rad=ROBOT_FRONT_RAD,
        robot_clearance_m=ROBOT_CLEARANCE_M,
    )
