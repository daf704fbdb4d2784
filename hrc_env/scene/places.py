"""Scenes by name: cameras, floor plan and workplaces (`assets/scenes/NAME.toml`), and obstacles."""

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
"""Height of a shape's lower end above which it blocks no worker [m], of any height with a hat."""
STEP_OVER_M = 0.02
"""Height of a shape's upper end below which it blocks no worker [m]."""
UPRIGHT = 0.999
"""Cosine from which on a box counts as standing upright."""
KINDS = {
    mujoco.mjtGeom.mjGEOM_PLANE: PLANE,
    mujoco.mjtGeom.mjGEOM_BOX: BOX,
    mujoco.mjtGeom.mjGEOM_CYLINDER: CYLINDER,
    mujoco.mjtGeom.mjGEOM_CAPSULE: CAPSULE,
    mujoco.mjtGeom.mjGEOM_SPHERE: CAPSULE,
}
"""Kinds of shapes that block sight, by MuJoCo's kinds of geoms."""
LEFT_AT = {"pile": "box", "floor": "box", "cart": "cart"}
"""Props that may stand on the floor, by the kinds of workplaces."""
Footprint = tuple[float, float, float, float, float]
"""A row of `Grounds.blocked`."""


@dataclass(frozen=True, slots=True)
class Room:
    """Description of a scene beside its MJCF, `NAME.xml`, or `NAME_bare.xml` without clutter."""

    mount_world: tuple[float, float, float]
    """Place of the robot's foot [m]."""
    walkable_x_m: tuple[float, float]
    """Least and greatest x of the area where workers stand and walk [m]."""
    walkable_y_m: tuple[float, float]
    """Least and greatest y of that area [m]."""
    cameras: tuple[CameraConfig, ...]
    """Cameras of the scene, if the settings have none."""
    places: tuple[Workplace, ...]
    """Workplaces."""
    clutter_places: tuple[Workplace, ...]
    """Further workplaces with clutter."""
    ceiling_m: float | None = None
    """Height of the ceiling [m]; None for a scene that is open to the sky."""
    open_walls: tuple[Footprint, ...] = ()
    """Footprints with clutter that people do not walk through; each replaces the footprints of the
    shapes that it contains."""
    flat: tuple[Footprint, ...] = ()
    """Footprints with clutter that block the floor and occlude nothing."""

    def grounds(
        self, obstacles: Floats, clutter: bool, further: tuple[Workplace, ...] = ()
    ) -> Grounds:
        """Return the floor plan.

        Args:
            obstacles: (G, `shapes.WIDTH`) fixed shapes.
            clutter: whether furniture and building material stand there.
            further: workplaces of a task, relative to the robot's foot.
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
"""Scenes by name."""


def block_loads(grounds: Grounds, obstacles: Floats) -> Grounds:
    """Return the floor plan for a mobile base, which the pedestal and the places of loads block.

    Args:
        grounds: the floor plan for workers.
        obstacles: (G, `shapes.WIDTH`) fixed shapes, the pedestal among them.
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
    """Return the solid geoms of a scene, (G, `shapes.WIDTH`).

    Raises:
        HRCError: a solid geom moves, or is of a kind that is not in `KINDS`.
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
            f"Geom {model.geom(geom).name!r} cannot block sight: expected one of "
            f"{[each.name for each in KINDS]} that is fixed in the world."
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
    """Return (N, 5) the footprints of the shapes that block the floor, as in `Grounds.blocked`.

    Footprints of upright boxes are exact, those of other shapes are rectangles along x and y. A
    shape on the robot's axis is its pedestal, and is left out.

    Args:
        obstacles: (G, `shapes.WIDTH`) fixed shapes.
        robot_xy_m: axis of the robot's first joint, x and y [m].
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
    """Return (3,) the half size of the bounding box of a shape along x, y and z [m]."""
    axes, half = np.abs(row[AXES:HALF_SIZE].reshape(3, 3)), row[HALF_SIZE : HALF_SIZE + 3]
    if row[KIND] == BOX:
        return half @ axes
    return half[1] * axes[2] + half[0]


def is_within(points: Floats, footprints: Floats) -> Bools:
    """Return (N,) whether points x, y, ... (N, 2 or more) are in one of the footprints (M, 5)."""
    x, y, half_length, half_width, yaw = footprints.T
    dx, dy = points[:, :1] - x, points[:, 1:2] - y
    along, aside = np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
    return ((np.abs(along) <= half_length) & (np.abs(aside) <= half_width)).any(1)
