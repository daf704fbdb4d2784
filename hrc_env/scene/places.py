"""Cameras, floor plans and workplaces of scenes (`assets/scenes/NAME.toml`), and obstacles."""

import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from hrc_env.core.errors import HRCError
from hrc_env.core.mapping import from_mapping, read_toml
from hrc_env.core.typing import Bools, Floats
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.shapes import (
    AXES,
    BOX,
    CAPSULE,
    CENTRE,
    CYLINDER,
    HALF_SIZE,
    KIND,
    PLANE,
    WIDTH,
    shape,
)
from hrc_env.scene.primitives import SOLID
from hrc_env.worker.body import assets_dir
from hrc_env.worker.props import BOUNDS_M, PROP_NAMES
from hrc_env.world import Grounds, Workplace

ROBOT_CLEARANCE_M = 0.8
"""Distance that workers' paths keep from the axis of the robot's first joint [m]."""
HEADROOM_M = 2.1
"""Height of a shape's lower end above which it does not obstruct even a tall worker with a hat
[m]."""
STEP_OVER_M = 0.02
"""Height of a shape's upper end below which workers can step over it [m]."""
UPRIGHT = 0.999
"""Minimum cosine of the tilt of a box that counts as upright."""
KINDS = {
    mujoco.mjtGeom.mjGEOM_PLANE: PLANE,
    mujoco.mjtGeom.mjGEOM_BOX: BOX,
    mujoco.mjtGeom.mjGEOM_CYLINDER: CYLINDER,
    mujoco.mjtGeom.mjGEOM_CAPSULE: CAPSULE,
    mujoco.mjtGeom.mjGEOM_SPHERE: CAPSULE,
}
"""Kinds of occluding shapes, by MuJoCo's types of geoms."""
LEFT_AT = {"pile": "box", "floor": "box", "cart": "cart"}
"""Prop that may be on the floor at a workplace, by kind of workplace."""
Footprint = tuple[float, float, float, float, float]
"""Type of the footprint of an obstacle, a row of `Grounds.blocked`."""


@dataclass(frozen=True, slots=True)
class Room:
    """Description of a scene with the MJCF `NAME.xml` or, without clutter, `NAME_bare.xml`."""

    mount_world: tuple[float, float, float]
    """Position of the robot's base [m]."""
    walkable_x_m: tuple[float, float]
    """Minimum and maximum x of the area where workers stand and walk [m]."""
    walkable_y_m: tuple[float, float]
    """Minimum and maximum y of the area where workers stand and walk [m]."""
    cameras: tuple[CameraConfig, ...]
    """Default cameras of the scene."""
    places: tuple[Workplace, ...]
    """Workplaces that exist both with and without clutter."""
    clutter_places: tuple[Workplace, ...]
    """Further workplaces that exist only with clutter."""
    ceiling_m: float | None = None
    """Height of the ceiling [m]; None for a scene that is open to the sky."""
    open_walls: tuple[Footprint, ...] = ()
    """Footprints of open walls in the clutter, which people do not walk through; each replaces the
    footprints of the shapes that it contains."""
    flat: tuple[Footprint, ...] = ()
    """Footprints of clutter that obstructs the floor but does not occlude any view."""

    def grounds(
        self, obstacles: Floats, clutter: bool, further: tuple[Workplace, ...] = ()
    ) -> Grounds:
        """Return the floor plan.

        Args:
            obstacles: (G, `shapes.WIDTH`) fixed shapes.
            clutter: whether the scene contains furniture and building material.
            further: workplaces of a task, relative to the robot's base.
        """
        robot_xy_m = self.mount_world[:2]
        blocked = find_footprints(obstacles, robot_xy_m)
        if clutter:
            walls, flat = (np.reshape(each, (-1, 5)) for each in (self.open_walls, self.flat))
            blocked = np.concatenate([blocked[~is_within(blocked, walls)], walls, flat])
        x, y, z = self.mount_world
        moved = tuple(
            replace(each, xy_m=(x + each.xy_m[0], y + each.xy_m[1]), height_m=z + each.height_m)
            for each in further
        )
        return Grounds(
            walkable_x_m=self.walkable_x_m,
            walkable_y_m=self.walkable_y_m,
            blocked=blocked,
            places=self.places + (self.clutter_places if clutter else ()) + moved,
            robot_xy_m=robot_xy_m,
            robot_clearance_m=ROBOT_CLEARANCE_M,
        )


SCENES: dict[str, Room] = {
    path.stem: from_mapping(Room, read_toml(path))
    for path in sorted((assets_dir() / "scenes").glob("*.toml"))
}
"""Descriptions of the scenes by name."""


def block_loads(grounds: Grounds, obstacles: Floats) -> Grounds:
    """Return the floor plan for a mobile base, with pedestal and loads as further obstacles.

    Args:
        grounds: floor plan for workers.
        obstacles: (G, `shapes.WIDTH`) fixed shapes, including the pedestal.
    """
    x, y = grounds.robot_xy_m
    standing = find_footprints(obstacles, (math.inf, math.inf))
    pedestal = standing[np.hypot(standing[:, 0] - x, standing[:, 1] - y) < 1e-3]
    loads = np.reshape([_load_footprint(p) for p in grounds.places if p.kind in LEFT_AT], (-1, 5))
    return replace(grounds, blocked=np.concatenate([grounds.blocked, pedestal, loads]))


def _load_footprint(place: Workplace) -> Footprint:
    """Return the footprint of a load at a workplace."""
    low, high = BOUNDS_M[PROP_NAMES.index(LEFT_AT[place.kind])]
    middle, half = (low + high) / 2, (high - low) / 2
    (x, y), (cos, sin) = place.xy_m, (math.cos(place.yaw_rad), math.sin(place.yaw_rad))
    ahead = place.ahead_m + float(middle[0])
    return x + cos * ahead, y + sin * ahead, float(half[0]), float(half[1]), place.yaw_rad


def find_obstacles(model: mujoco.MjModel) -> Floats:
    """Return the solid geoms of a scene as shapes (G, `shapes.WIDTH`).

    Raises:
        HRCError: a solid geom can move, or its type is not in `KINDS`.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    solid = np.flatnonzero(model.geom_group == SOLID)
    rows = [_shape_of(model, data, int(geom)) for geom in solid]
    return np.array(rows).reshape(-1, WIDTH)


def _shape_of(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Floats:
    """Return the shape (`shapes.WIDTH`,) of a geom."""
    form = mujoco.mjtGeom(model.geom_type[geom])
    kind = KINDS.get(form)
    if kind is None or model.body_weldid[model.geom_bodyid[geom]] != 0:
        raise HRCError(
            f"Geom {model.geom(geom).name!r} cannot block lines of sight: expected one of "
            f"{[each.name for each in KINDS]}, fixed in the world."
        )
    half_size = model.geom_size[geom].copy()
    if kind != BOX:
        half_size[2] = 0.0
    if form == mujoco.mjtGeom.mjGEOM_SPHERE:
        half_size[1] = 0.0
    if kind == PLANE:
        half_size[:2][half_size[:2] <= 0] = np.inf  # MuJoCo marks an infinite plane by 0
    axes = data.geom_xmat[geom].reshape(3, 3)
    return shape(kind, data.geom_xpos[geom], axes, half_size)


def find_footprints(obstacles: Floats, robot_xy_m: tuple[float, float]) -> Floats:
    """Return the footprints (N, 5) of shapes that obstruct the floor, as in `Grounds.blocked`.

    Footprints of upright boxes are exact, those of other shapes are bounding rectangles along x and
    y. A shape on the axis of the robot's first joint is the pedestal, which is omitted.

    Args:
        obstacles: (G, `shapes.WIDTH`) fixed shapes.
        robot_xy_m: position of the robot's first joint axis, x and y [m].
    """
    rows = []
    for row in obstacles[obstacles[:, KIND] != PLANE]:
        half = _half_extent(row)
        z, away = row[CENTRE + 2], np.hypot(*(row[CENTRE : CENTRE + 2] - robot_xy_m))
        if z - half[2] > HEADROOM_M or z + half[2] < STEP_OVER_M or away < 1e-3:
            continue
        axes, yaw = row[AXES:HALF_SIZE].reshape(3, 3), 0.0
        if row[KIND] == BOX and axes[2, 2] > UPRIGHT:
            yaw, half = math.atan2(axes[0, 1], axes[0, 0]), row[HALF_SIZE : HALF_SIZE + 3]
        rows.append((*row[CENTRE : CENTRE + 2], half[0], half[1], yaw))
    return np.array(rows, float).reshape(-1, 5)


def _half_extent(row: Floats) -> Floats:
    """Return the half edge lengths (3,) of a shape's axis-aligned bounding box [m]."""
    axes, half = np.abs(row[AXES:HALF_SIZE].reshape(3, 3)), row[HALF_SIZE : HALF_SIZE + 3]
    if row[KIND] == BOX:
        return half @ axes
    return half[1] * axes[2] + half[0]


def is_within(points: Floats, footprints: Floats) -> Bools:
    """Return a mask (N,) of the points (N, 2 or more) that are inside any footprint (M, 5)."""
    x, y, half_length, half_width, yaw = footprints.T
    dx, dy = points[:, :1] - x, points[:, 1:2] - y
    along, aside = np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
    return ((np.abs(along) <= half_length) & (np.abs(aside) <= half_width)).any(1)
