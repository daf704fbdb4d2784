"""Where a worker's root may be: the slack [m] on a grid, to what stands there and the edge.

Workplaces may lie nearer to things, for who works at a wall stands before it.
"""

import warnings
from dataclasses import dataclass, replace

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Grounds, Workplace
from hrc_env.core.typing import Floats

BODY_M = 0.40
"""Walkers keep so far from what stands there: half their width, arms swinging included [m]."""
STAND_M = 0.22
"""Those who stand and work keep so far: half the depth of a trunk and its sway [m]; judgement."""
CELL_M = 0.05
"""Grid of the field [m]."""
MENDED_M = 0.3
"""A place that is inside something is moved by as much at most [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Floorplan:
    """The grounds as the planner wants them; arrays are read-only."""

    slack: Floats
    """(X, Y) of grid points [m]: where it is 0 or more a walker has room."""
    origin: Floats
    """(2,) first grid point [m]."""
    places: tuple[Workplace, ...]
    """Where there is work."""
    robot_xy_m: tuple[float, float]
    """Axis of the robot's first joint [m]."""
    robot_front_rad: float
    """Where the robot's front looks to [rad]."""


def floorplan(grounds: Grounds) -> Floorplan:
    """Measure the grounds; `ConfigError`: nowhere to walk, or a workplace inside something."""
    (x0, x1), (y0, y1) = grounds.walkable_x_m, grounds.walkable_y_m
    if not (x0 < x1 and y0 < y1):
        raise ConfigError(
            "The walkable area must be (low, high) along x and y, got "
            f"{grounds.walkable_x_m} and {grounds.walkable_y_m}."
        )
    xs = np.arange(x0, x1 + 0.5 * CELL_M, CELL_M)
    ys = np.arange(y0, y1 + 0.5 * CELL_M, CELL_M)
    slack = np.empty((len(xs), len(ys)))
    robot = np.array([*grounds.robot_xy_m, grounds.robot_clearance_m])
    _measure(xs, ys, np.ascontiguousarray(grounds.blocked, float), robot, slack)
    if slack.max() < 0.0:
        raise ConfigError("The grounds leave no room for a worker: everything is blocked.")
    origin = np.array([xs[0], ys[0]])
    for array in (slack, origin):
        array.flags.writeable = False
    plan = Floorplan(slack, origin, (), grounds.robot_xy_m, grounds.robot_front_rad)
    return replace(plan, places=tuple(mended(plan, place) for place in grounds.places))


def mended(plan: Floorplan, place: Workplace) -> Workplace:
    """A workplace where there is room to stand; moved a little, with a warning, if need be."""
    if slack_at(*place.xy_m, plan.slack, plan.origin) >= STAND_M - BODY_M:
        return place
    xs, ys = (plan.origin[i] + CELL_M * np.arange(plan.slack.shape[i]) for i in range(2))
    away = np.hypot(xs[:, None] - place.xy_m[0], ys[None] - place.xy_m[1])
    away[plan.slack < STAND_M - BODY_M] = np.inf
    i, j = np.unravel_index(np.argmin(away), away.shape)
    x, y = float(xs[i]), float(ys[j])
    if away[i, j] > MENDED_M:
        raise ConfigError(
            f"Workplace {place.name!r} at {place.xy_m} is inside something or beyond the walkable "
            f"area: expected {STAND_M} m from both at least; the nearest such point is "
            f"({x:.2f}, {y:.2f})."
        )
    warnings.warn(
        f"Workplace {place.name!r} at {place.xy_m} leaves no room to stand: moved to "
        f"({x:.2f}, {y:.2f}).",
        stacklevel=2,
    )
    return replace(place, xy_m=(x, y))


def room_for(plan: Floorplan, apart_m: float) -> int:
    """How many workers find a place so far apart from each other, taken as they come."""
    coarse = 4  # grid points of the field to one that is tried
    taken = np.zeros((0, 2))
    for point in np.argwhere(plan.slack[::coarse, ::coarse] >= 0.0) * coarse * CELL_M:
        if not len(taken) or np.hypot(*(taken - point).T).min() >= apart_m:
            taken = np.vstack([taken, point])
    return len(taken)


@kernel
def _measure(xs: Floats, ys: Floats, blocked: Floats, robot: Floats, slack: Floats) -> None:
    """Fill the field: the distance from footprints (N, 5), the robot (x, y, radius) and edges."""
    n_x, n_y = slack.shape
    for i in range(n_x):
        for j in range(n_y):
            slack[i, j] = np.hypot(xs[i] - robot[0], ys[j] - robot[1]) - robot[2]
    for k in range(blocked.shape[0]):
        cos, sin = np.cos(blocked[k, 4]), np.sin(blocked[k, 4])
        for i in range(n_x):
            for j in range(n_y):
                dx, dy = xs[i] - blocked[k, 0], ys[j] - blocked[k, 1]
                along = abs(cos * dx + sin * dy) - blocked[k, 2]
                across = abs(cos * dy - sin * dx) - blocked[k, 3]
                outside = np.hypot(max(along, 0.0), max(across, 0.0))
                away = outside + min(max(along, across), 0.0)
                slack[i, j] = min(slack[i, j], away - BODY_M)


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
