"""Suction cups, which hold an object from contact until they are vented or overloaded."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints, Transforms
from hrc_env.geometry.rotations import matrix
from hrc_env.scene.objects import Objects

if TYPE_CHECKING:
    from hrc_env.scene.robot import Robot

CUPS = "cups_"
"""Prefix of the name of a weld between cups and an object, followed by the object's name."""
SEAL_M = 0.004
"""Maximum distance of sealing cups from their target on an object's face [m]."""
SEAL_RAD = 0.03
"""Maximum angle between sealing cups and an object's face [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Cups:
    """Suction cups of an arm, and the C objects that they can hold."""

    objects: Ints
    """(C,) index of each object in `Objects`."""
    welds: Ints
    """(C,) index of the equality constraint that holds each object."""
    T_object_from_site: Transforms
    """(C, 4, 4) target pose of the cups on each object."""
    gauge: int
    """Index of the first of three entries of `sensordata` with the force on the cups [N]."""
    limit_n: float
    """Load above which an object is torn off [N]."""


def find_cups(robot: "Robot", model: mujoco.MjModel, objects: Objects, prefix: str) -> Cups | None:
    """Find the suction cups of a robot in a compiled scene; None if it has none.

    Args:
        robot: the robot.
        model: the compiled scene.
        objects: loose objects of the scene.
        prefix: prefix of the robot's names in the model.
    """
    if robot.suction is None:
        return None
    rows: list[int] = []
    welds: list[int] = []
    frames: list[Transforms] = []
    for equality in range(model.neq):
        name = model.equality(equality).name
        if name.startswith(CUPS):
            rows.append(objects.names.index(name.removeprefix(CUPS)))
            welds.append(equality)
            site = model.eq_obj1id[equality]
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = matrix(model.site_quat[site]), model.site_pos[site]
            frames.append(T)
    return Cups(
        objects=np.array(rows, int),
        welds=np.array(welds, int),
        T_object_from_site=np.array(frames).reshape(-1, 4, 4),
        gauge=int(model.sensor(prefix + robot.suction.gauge).adr[0]),
        limit_n=robot.suction.limit_n,
    )


def find_sealed(cups: Cups, T_world_from_tool: Transforms, poses: Floats) -> Bools:
    """Return a mask (B, C) of the objects on which the cups seal.

    Args:
        cups: suction cups of the arm.
        T_world_from_tool: (B, 4, 4) poses of the cups.
        poses: (B, O, 7) poses of the objects, position [m] and quaternion (w, x, y, z).
    """
    candidates = poses[:, cups.objects]
    rotation = matrix(candidates[..., 3:])
    R = rotation @ cups.T_object_from_site[:, :3, :3]
    place = candidates[..., :3] + (rotation @ cups.T_object_from_site[:, :3, 3:])[..., 0]
    off_m = np.linalg.norm(place - T_world_from_tool[:, None, :3, 3], axis=-1)
    trace = np.einsum("bij,bcij->bc", T_world_from_tool[:, :3, :3], R)
    angle_rad = np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))
    return (off_m < SEAL_M) & (angle_rad < SEAL_RAD)


def measure_load_n(cups: Cups, sensordata: Floats) -> Floats:
    """Return the load (...) on the cups [N], from sensordata (..., n).

    It is the magnitude of the tensile force along the cups' axis and the shear across it;
    compression along the axis counts as 0. It includes the weight of the cups.
    """
    x, y, z = np.moveaxis(sensordata[..., cups.gauge : cups.gauge + 3], -1, 0)
    return np.sqrt(x * x + y * y + np.square(np.minimum(z, 0.0)))
