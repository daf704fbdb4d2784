"""What stands still in a compiled scene and blocks sight: MuJoCo's geoms as plain numbers."""

import mujoco
import numpy as np

from hrc_env.core.errors import HRCError
from hrc_env.core.typing import Floats
from hrc_env.geometry.shapes import BOX, CAPSULE, CYLINDER, PLANE, WIDTH, shape
from hrc_env.scene.primitives import SOLID

KINDS = {
    mujoco.mjtGeom.mjGEOM_PLANE: PLANE,
    mujoco.mjtGeom.mjGEOM_BOX: BOX,
    mujoco.mjtGeom.mjGEOM_CYLINDER: CYLINDER,
    mujoco.mjtGeom.mjGEOM_CAPSULE: CAPSULE,
    mujoco.mjtGeom.mjGEOM_SPHERE: CAPSULE,
}


def obstacles(model: mujoco.MjModel) -> Floats:
    """The solid geoms of a scene, (G, `shapes.WIDTH`).

    Raises:
        HRCError: one that moves, or of a kind that `KINDS` does not have.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    solid = np.flatnonzero(model.geom_group == SOLID)
    rows = [_row(model, data, int(geom)) for geom in solid]
    return np.array(rows).reshape(-1, WIDTH)


def _row(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Floats:
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
