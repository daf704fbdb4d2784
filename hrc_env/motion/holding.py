"""What hands hold: a prop's pose decides where they are."""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.curves import placed
from hrc_env.motion.state import Worker
from hrc_env.worker.props import PROPS

GRIPS = np.array([np.nan_to_num(prop.grips) for prop in PROPS])
"""(N, 2, 3) where the left and right hand hold each prop, in its frame [m]."""
TWO_HANDED = np.array([bool(np.isfinite(prop.grips).all()) for prop in PROPS])
"""(N,) whether both hands do; a tool for one hand is held at its origin."""

N_HELD = 8
"""Numbers that say what is held: kind, position (3), quaternion (4, scalar first)."""


@kernel
def prop_pose(out: Floats, me: Worker) -> None:
    """Write what q holds and where into out (N_HELD,)."""
    out[:] = 0.0
    out[0], out[4] = me.q[c.PROP], 1.0
    if out[0] == 0.0:
        return
    pose = me.q[c.PROP_POSE :]
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
def grip(side: int, gx: float, gy: float, gz: float, me: Worker) -> None:
    """Send a hand to a point of the prop's frame; its pose stands in q."""
    q = me.q
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
def hold_load(x: float, y: float, yaw: float, up: float, me: Worker) -> None:
    """Put the load where someone at (x, y) facing yaw holds it, and the hands on it."""
    place_load(x, y, yaw, up, me)
    grip_load(1.0, me)


@kernel
def place_load(x: float, y: float, yaw: float, up: float, me: Worker) -> None:
    """Put the load where it is of someone at (x, y) facing yaw, `up` higher than standing."""
    q, at = me.q, me.load_at
    q[c.PROP] = me.load_prop
    q[c.PROP_POSE], q[c.PROP_POSE + 1] = placed(x, y, yaw, at[0], at[1])
    q[c.PROP_POSE + 2], q[c.PROP_POSE + 3] = up + at[2], yaw + at[3]
    q[c.PROP_POSE + 4], q[c.PROP_POSE + 5] = at[4], at[5]


@kernel
def grip_load(share: float, me: Worker) -> None:
    """Send the hands that hold it to the load, by a share."""
    for side in range(2):
        held = me.load_grip[3 * side : 3 * side + 3]
        grip(side, held[0], held[1], held[2], me)
        me.q[c.HAND_SHARE + side] = share * me.load_used[side]


@kernel
def take_load(prop: int, me: Worker) -> None:
    """Both hands hold the prop, where it is made to be held."""
    me.load_prop = prop
    me.load_at[:] = 0.0
    for i in range(6):
        me.load_grip[i] = GRIPS[prop, i // 3, i % 3]
    me.load_used[:] = 1.0
