"""Free space for a worker's root, as the distance to obstacles (slack) on a grid."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion.points import Point
from hrc_env.world import Grounds

BODY_M = 0.40
"""Distance that walkers keep from objects [m], half their width with swinging arms."""
STAND_M = 0.22
"""Distance that workers keep from objects at work [m], half a trunk's depth plus its sway."""
CELL_M = 0.05
"""Size of a cell of the grid [m]."""


class FloorGrid(NamedTuple):
    """Slack on a grid over the floor; the arrays are read-only."""

    slack: Floats
    """Distance (X, Y) to objects and edges minus `BODY_M` [m]; there is room where it is >= 0."""
    origin: Floats
    """World x, y (2,) of the first grid point [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Floorplan:
    """Floor of a scene, with its free space, for the planning of paths."""

    grid: FloorGrid
    """Slack on a grid over the floor."""
    grounds: Grounds
    """Description of the floor in the scene."""


def make_floorplan(grounds: Grounds) -> Floorplan:
    """Compute the free space on the floor of a scene.

    Args:
        grounds: walkable area, footprints of objects, workplaces and the robot.

    Raises:
        ConfigError: no location is walkable, or a workplace has no room to stand.
    """
    (x0, x1), (y0, y1) = grounds.walkable_x_m, grounds.walkable_y_m
    xs = np.arange(x0, x1 + 0.5 * CELL_M, CELL_M)
    ys = np.arange(y0, y1 + 0.5 * CELL_M, CELL_M)
    slack, origin = _measure_slack(xs[:, None], ys, grounds), np.array([xs[0], ys[0]])
    if slack.max() < 0.0:
        raise ConfigError("There is no room for a worker: the whole floor plan is blocked.")
    for array in (slack, origin):
        array.flags.writeable = False
    grid = FloorGrid(slack, origin)
    for place in grounds.places:
        if read_slack(*place.xy_m, grid) < STAND_M - BODY_M:
            raise ConfigError(
                f"Workplace {place.name!r} at {place.xy_m} leaves no room to stand: expected a "
                f"point at least {STAND_M} m from all objects and inside the walkable area."
            )
    return Floorplan(grid, grounds)


def locate_beside_robot(grounds: Grounds, radius_m: float, angle_rad: float) -> Point:
    """Return the point at a distance from the robot's base axis and an angle from its front."""
    x, y = grounds.robot_xy_m
    return Point(x + radius_m * math.cos(angle_rad), y + radius_m * math.sin(angle_rad))


def count_room(plan: Floorplan, apart_m: float) -> int:
    """Return the number of walkable grid points, chosen greedily, that are `apart_m` apart."""
    coarse = 4  # every fourth grid point is tried
    taken = np.zeros((0, 2))
    for point in np.argwhere(plan.grid.slack[::coarse, ::coarse] >= 0.0) * coarse * CELL_M:
        if not len(taken) or np.hypot(*(taken - point).T).min() >= apart_m:
            taken = np.vstack([taken, point])
    return len(taken)


def _measure_slack(xs: Floats, ys: Floats, grounds: Grounds) -> Floats:
    """Return the distance (X, Y) from objects and the robot, minus `BODY_M` [m].

    Args:
        xs: world x (X, 1) of the grid points [m].
        ys: world y (Y,) of the grid points [m].
        grounds: floor of the scene.
    """
    robot_x, robot_y = grounds.robot_xy_m
    slack = np.hypot(xs - robot_x, ys - robot_y) - grounds.robot_clearance_m
    for x, y, half_length, half_width, yaw in np.asarray(grounds.blocked, float).tolist():
        cos, sin, dx, dy = math.cos(yaw), math.sin(yaw), xs - x, ys - y
        along = np.abs(cos * dx + sin * dy) - half_length
        across = np.abs(cos * dy - sin * dx) - half_width
        outside = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
        slack = np.minimum(slack, outside + np.minimum(np.maximum(along, across), 0.0) - BODY_M)
    return slack


@kernel
def read_slack(x: float, y: float, grid: FloorGrid) -> float:
    """Return the interpolated slack at a point [m], negative outside of the walkable area.

    Args:
        x: world x [m].
        y: world y [m].
        grid: slack on a grid.
    """
    slack, origin = grid.slack, grid.origin
    u, v = (x - origin[0]) / CELL_M, (y - origin[1]) / CELL_M
    i = min(max(int(u), 0), slack.shape[0] - 2)
    j = min(max(int(v), 0), slack.shape[1] - 2)
    outside = max(-u, u - slack.shape[0] + 1.0, -v, v - slack.shape[1] + 1.0, 0.0)
    u, v = min(max(u - i, 0.0), 1.0), min(max(v - j, 0.0), 1.0)
    low = slack[i, j] + v * (slack[i, j + 1] - slack[i, j])
    high = slack[i + 1, j] + v * (slack[i + 1, j + 1] - slack[i + 1, j])
    inside = low + u * (high - low)
    return inside if outside < 1e-6 else min(inside, 0.0) - outside * CELL_M
