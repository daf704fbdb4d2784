"""Suction: what cups touch sticks to them until they are vented, or it is torn off."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints, Transforms
from hrc_env.geometry.rotations import matrix
from hrc_env.scene.objects import Objects

CUPS = "cups_"
"""What the name of the weld begins with that stands for cups on an object, which follows."""
NEAR_M, NEAR_RAD = 0.004, 0.03
"""Cups that are so near to a face, and so little askew, seal."""


@dataclass(frozen=True, slots=True, eq=False)
class Cups:
    """An arm's cups and what can hang on them; C of the objects."""

    objects: Ints
    """(C,) which."""
    welds: Ints
    """(C,) equalities that stand for it."""
    T_object_from_site: Transforms
    """(C, 4, 4) where they sit on it."""
    gauge: int
    """The first of three entries of `sensordata`: what hangs on them [N]."""
    limit_n: float


def cups_of(robot: Any, model: mujoco.MjModel, objects: Objects, prefix: str) -> Cups | None:
    """The numbers of a robot's cups in a scene; None: it has none."""
    if robot.suction is None:
        return None
    rows, welds, frames = [], [], []
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
        np.array(rows, int), np.array(welds, int), np.array(frames).reshape(-1, 4, 4),
        int(model.sensor(prefix + robot.suction.gauge).adr[0]), robot.suction.limit_n,
    )  # fmt: skip


def seals(cups: Cups, T_world_from_tool: Transforms, poses: Floats) -> Bools:
    """(B, C) on which objects, at poses (B, O, 7), cups at (B, 4, 4) sit so that they hold."""
    own = poses[:, cups.objects]
    R = matrix(own[..., 3:]) @ cups.T_object_from_site[:, :3, :3]
    at = own[..., :3] + (matrix(own[..., 3:]) @ cups.T_object_from_site[:, :3, 3:])[..., 0]
    off_m = np.linalg.norm(at - T_world_from_tool[:, None, :3, 3], axis=-1)
    turned = np.einsum("bij,bcij->bc", T_world_from_tool[:, :3, :3], R)
    askew_rad = np.arccos(np.clip((turned - 1.0) / 2.0, -1.0, 1.0))
    return (off_m < NEAR_M) & (askew_rad < NEAR_RAD)


def load_n(cups: Cups, sensordata: Floats) -> Floats:
    """(...,) what tears at the cups [N], of sensordata (..., n): along the arm's end and aside; a
    push does not. The hand's own weight is part of it."""
    x, y, z = np.moveaxis(sensordata[..., cups.gauge : cups.gauge + 3], -1, 0)
    return np.sqrt(x * x + y * y + np.square(np.minimum(z, 0.0)))
