"""Holding of props, with the hands positioned by the pose of the prop."""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.curves import move_point
from hrc_env.motion.state import Worker
from hrc_env.worker.props import PROPS

GRIPS = np.array([np.nan_to_num(prop.grips) for prop in PROPS])
"""Grips (N, 2, 3) of the left and the right hand on each prop, in the prop's frame [m]."""
TWO_HANDED = np.array([bool(np.isfinite(prop.grips).all()) for prop in PROPS])
"""Mask (N,) of props held with both hands; a tool for one hand is held at its origin."""
N_HELD = 8
"""Number of values of a held prop: kind, position (3) [m], unit quaternion (4, scalar first)."""


@kernel
def write_prop_pose(out: Floats, worker: Worker) -> None:
    """Store the kind, position and quaternion of the held prop in `out` (N_HELD,)."""
    out[:] = 0.0
    out[0], out[4] = worker.q[c.PROP], 1.0
    if out[0] == 0.0:
        return
    pose = worker.q[c.PROP_POSE :]
    yaw, pitch, roll = pose[3], pose[4], pose[5]
    out[1], out[2], out[3] = pose[0], pose[1], pose[2]
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    out[4] = cy * cp * cr + sy * sp * sr
    out[5] = cy * cp * sr - sy * sp * cr
    out[6] = cy * sp * cr + sy * cp * sr
    out[7] = sy * cp * cr - cy * sp * sr


@kernel
def grip(side: int, gx: float, gy: float, gz: float, worker: Worker) -> None:
    """Set the target of a hand to a point in the frame of the held prop.

    Args:
        side: 0 left, 1 right.
        gx: x of the point in the prop's frame [m].
        gy: y of the point in the prop's frame [m].
        gz: z of the point in the prop's frame [m].
        worker: record of the worker; its `q` is changed.
    """
    q = worker.q
    yaw, pitch, roll = q[c.PROP_POSE + 3], q[c.PROP_POSE + 4], q[c.PROP_POSE + 5]
    cy, sy = math.cos(yaw), math.sin(yaw)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cr, sr = math.cos(roll), math.sin(roll)
    y, z = cr * gy - sr * gz, sr * gy + cr * gz
    x, z = cp * gx + sp * z, cp * z - sp * gx
    at = c.HAND_TARGET + 3 * side
    q[at] = q[c.PROP_POSE] + cy * x - sy * y
    q[at + 1] = q[c.PROP_POSE + 1] + sy * x + cy * y
    q[at + 2] = q[c.PROP_POSE + 2] + z


@kernel
def hold_load(x: float, y: float, yaw: float, up: float, worker: Worker) -> None:
    """Set the pose of a carried load, and the targets of the hands that hold it.

    Args:
        x: world x of the root [m].
        y: world y of the root [m].
        yaw: heading [rad].
        up: height of the load relative to its height when the worker stands [m].
        worker: record of the worker; its `q` is changed.
    """
    place_load(x, y, yaw, up, worker)
    grip_load(1.0, worker)


@kernel
def place_load(x: float, y: float, yaw: float, up: float, worker: Worker) -> None:
    """Set the pose of a carried load.

    Args:
        x: world x of the root [m].
        y: world y of the root [m].
        yaw: heading [rad].
        up: height of the load relative to its height when the worker stands [m].
        worker: record of the worker; its `q` is changed.
    """
    q, at = worker.q, worker.load_at
    q[c.PROP] = worker.load_prop
    q[c.PROP_POSE], q[c.PROP_POSE + 1] = move_point(x, y, yaw, at[0], at[1])
    q[c.PROP_POSE + 2], q[c.PROP_POSE + 3] = up + at[2], yaw + at[3]
    q[c.PROP_POSE + 4], q[c.PROP_POSE + 5] = at[4], at[5]


@kernel
def grip_load(share: float, worker: Worker) -> None:
    """Set the targets of the hands that hold the load, with the weight `share` (0 to 1)."""
    for side in range(2):
        held = worker.load_grip[3 * side : 3 * side + 3]
        grip(side, held[0], held[1], held[2], worker)
        worker.q[c.HAND_SHARE + side] = share * worker.load_used[side]


@kernel
def take_load(prop: int, worker: Worker) -> None:
    """Plan to hold a prop with both hands at its grips."""
    worker.load_prop = prop
    worker.load_at[:] = 0.0
    for i in range(6):
        worker.load_grip[i] = GRIPS[prop, i // 3, i % 3]
    worker.load_used[:] = 1.0
