"""Where a worker's root may be: the slack [m] on a grid, to what stands there and the edge."""

import math
from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.world import Grounds

BODY_M, STAND_M = 0.40, 0.22
"""Walkers keep so far from what stands there: half their width, swinging arms included; those who
work there, half the depth of a trunk and its sway [m]; judgement."""
CELL_M = 0.05
"""Grid of the field [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Floorplan:
    """The grounds as the planner wants them; arrays are read-only."""

    slack: Floats
    """(X, Y) of grid points [m]: where it is 0 or more a walker has room."""
    origin: Floats
    """(2,) first grid point [m]."""
    grounds: Grounds


def floorplan(grounds: Grounds) -> Floorplan:
    """Measure the grounds; `ConfigError`: nowhere to walk, or no room at a workplace."""
    (x0, x1), (y0, y1) = grounds.walkable_x_m, grounds.walkable_y_m
    xs = np.arange(x0, x1 + 0.5 * CELL_M, CELL_M)
    ys = np.arange(y0, y1 + 0.5 * CELL_M, CELL_M)
    slack, origin = _slack(xs[:, None], ys, grounds), np.array([xs[0], ys[0]])
    if slack.max() < 0.0:
        raise ConfigError("The grounds leave no room for a worker: everything is blocked.")
    for array in (slack, origin):
        array.flags.writeable = False
    for place in grounds.places:
        if slack_at(*place.xy_m, slack, origin) < STAND_M - BODY_M:
            raise ConfigError(
                f"Workplace {place.name!r} at {place.xy_m} leaves no room to stand: expected "
                f"{STAND_M} m at least from what stands there and inside the walkable area."
            )
    return Floorplan(slack, origin, grounds)


def beside_robot(grounds: Grounds, radius_m: float, angle_rad: float) -> tuple[float, float]:
    """The point so far from the robot's axis, at an angle from its front [m]."""
    x, y = grounds.robot_xy_m
    return x + radius_m * math.cos(angle_rad), y + radius_m * math.sin(angle_rad)


def room_for(plan: Floorplan, apart_m: float) -> int:
    """How many workers find a place so far apart from each other, taken as they come."""
    coarse = 4  # grid points of the field to one that is tried
    taken = np.zeros((0, 2))
    for point in np.argwhere(plan.slack[::coarse, ::coarse] >= 0.0) * coarse * CELL_M:
        if not len(taken) or np.hypot(*(taken - point).T).min() >= apart_m:
            taken = np.vstack([taken, point])
    return len(taken)


def _slack(xs: Floats, ys: Floats, grounds: Grounds) -> Floats:
    """(X, Y) distance of xs (X, 1) and ys (Y,) from footprints and the robot, less half a body."""
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
def slack_at(x: float, y: float, slack: Floats, origin: Floats) -> float:
    """The field at a point, between grid points; negative beyond the walkable area [m]."""
    u, v = (x - origin[0]) / CELL_M, (y - origin[1]) / CELL_M
    i = min(max(int(u), 0), slack.shape[0] - 2)
    j = min(max(int(v), 0), slack.shape[1] - 2)
    outside = max(-u, u - slack.shape[0] + 1.0, -v, v - slack.shape[1] + 1.0, 0.0)
    u, v = min(max(u - i, 0.0), 1.0), min(max(v - j, 0.0), 1.0)
    low = slack[i, j] + v * (slack[i, j + 1] - slack[i, j])
    high = slack[i + 1, j] + v * (slack[i + 1, j + 1] - slack[i + 1, j])
    inside = low + u * (high - low)
    return inside if outside < 1e-6 else min(inside, 0.0) - outside * CELL_M
