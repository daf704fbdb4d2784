"""The scenes by name: cameras, where people stand, walk and work (`assets/scenes/NAME.toml`), and
what stands still in them as plain numbers."""

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
HEADROOM_M = 2.1
"""What begins higher than this does not stand in anybody's way [m]; a tall worker with a hat."""
STEP_OVER_M = 0.02
"""Nor does what ends lower than this [m]."""
UPRIGHT = 0.999
"""Cosine from which on a box counts as standing upright."""
KINDS = {
    mujoco.mjtGeom.mjGEOM_PLANE: PLANE,
    mujoco.mjtGeom.mjGEOM_BOX: BOX,
    mujoco.mjtGeom.mjGEOM_CYLINDER: CYLINDER,
    mujoco.mjtGeom.mjGEOM_CAPSULE: CAPSULE,
    mujoco.mjtGeom.mjGEOM_SPHERE: CAPSULE,
}
"""Of what blocks sight."""
LEFT_AT = {"pile": "box", "floor": "box", "cart": "cart"}
"""What of loads may stand on the floor, by the kinds of places."""
Footprint = tuple[float, float, float, float, float]
"""As a row of `Grounds.blocked`."""


@dataclass(frozen=True, slots=True)
class Room:
    """What a scene is beside its MJCF, `NAME.xml`, or `NAME_bare.xml` without clutter."""

    mount_world: tuple[float, float, float]
    """Where the robot's foot stands [m]."""
    walkable_x_m: tuple[float, float]
    walkable_y_m: tuple[float, float]
    cameras: tuple[CameraConfig, ...]
    """Those that hang there unless the settings say otherwise."""
    places: tuple[Workplace, ...]
    clutter_places: tuple[Workplace, ...]
    """Further ones, with clutter."""
    ceiling_m: float | None = None
    """Height of its ceiling [m]; None: it is open to the sky."""
    open_walls: tuple[Footprint, ...] = ()
    """With clutter: what nobody walks through; stands for all footprints that it holds."""
    flat: tuple[Footprint, ...] = ()
    """With clutter: what stands in the way and hides nobody."""

    def grounds(
        self, obstacles: Floats, clutter: bool, further: tuple[Workplace, ...] = ()
    ) -> Grounds:
        """Where people can be between shapes (G, `shapes.WIDTH`) that stand there; `further` places
        are given from the robot's foot on."""
        robot_xy_m = self.mount_world[:2]
        blocked = footprints(obstacles, robot_xy_m)
        if clutter:
            walls, flat = (np.reshape(each, (-1, 5)) for each in (self.open_walls, self.flat))
            blocked = np.concatenate([blocked[~within(blocked, walls)], walls, flat])
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


def to_drive_in(grounds: Grounds, obstacles: Floats) -> Grounds:
    """The same for a robot that drives: what stands on the pedestal's axis is in its way, and so is
    where loads lie on the floor or may be left."""
    x, y = grounds.robot_xy_m
    standing = footprints(obstacles, (math.inf, math.inf))
    own = standing[np.hypot(standing[:, 0] - x, standing[:, 1] - y) < 1e-3]
    left = np.reshape([_left_at(p) for p in grounds.places if p.kind in LEFT_AT], (-1, 5))
    return replace(grounds, blocked=np.concatenate([grounds.blocked, own, left]))


def _left_at(place: Workplace) -> Footprint:
    """What a load takes up that lies at a place."""
    low, high = BOUNDS_M[PROP_NAMES.index(LEFT_AT[place.kind])]
    middle, half = (low + high) / 2, (high - low) / 2
    (x, y), (cos, sin) = place.xy_m, (math.cos(place.yaw_rad), math.sin(place.yaw_rad))
    ahead = place.ahead_m + float(middle[0])
    return x + cos * ahead, y + sin * ahead, float(half[0]), float(half[1]), place.yaw_rad


def obstacles(model: mujoco.MjModel) -> Floats:
    """The solid geoms of a scene, (G, `shapes.WIDTH`). Raises `HRCError` for one that moves, or of
    a kind that `KINDS` does not have."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    solid = np.flatnonzero(model.geom_group == SOLID)
    rows = [_shape_of(model, data, int(geom)) for geom in solid]
    return np.array(rows).reshape(-1, WIDTH)


def _shape_of(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Floats:
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
        half_size[:2][half_size[:2] <= 0] = np.inf  # MuJoCo's way to say endless
    axes = data.geom_xmat[geom].reshape(3, 3)
    return shape(kind, data.geom_xpos[geom], axes, half_size)


def footprints(obstacles: Floats, robot_xy_m: tuple[float, float]) -> Floats:
    """(N, 5) of shapes (G, `shapes.WIDTH`) that stand in the way, as `Grounds.blocked`: upright
    boxes exactly, all else as rectangles along x and y. What stands on the robot's axis is its."""
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
    """(3,) half size of the box along x, y and z that holds a shape [m]."""
    axes, half = np.abs(row[AXES:HALF_SIZE].reshape(3, 3)), row[HALF_SIZE : HALF_SIZE + 3]
    if row[KIND] == BOX:
        return half @ axes
    return half[1] * axes[2] + half[0]


def within(points: Floats, wholes: Floats) -> Bools:
    """(N,) which points x, y, ... (N, 2 or more) are in one of the footprints (M, 5)."""
    x, y, half_length, half_width, yaw = wholes.T
    dx, dy = points[:, :1] - x, points[:, 1:2] - y
    along, aside = np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
    return ((np.abs(along) <= half_length) & (np.abs(aside) <= half_width)).any(1)
