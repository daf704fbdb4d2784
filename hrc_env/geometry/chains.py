"""Serial chains of hinges and slides: link frames, tool point, Jacobian, capsules; in numba.

A hinge turns about the z axis of its own frame, a slide moves along it. Link i's frame is joint
i's frame moved by q_i, so T_world_from_link_i = T_world_from_base @ prod_{j <= i}
(parent_from_joint_j M_j(q_j)), where M is Rz of a hinge and Tz of a slide.
"""

import math
from dataclasses import dataclass

import numpy as np

from hrc_env.core.batching import flat
from hrc_env.core.errors import check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.records import RobotState
from hrc_env.core.typing import (
    Bools,
    Capsules,
    Floats,
    Ints,
    JointAngles,
    JointVelocities,
    Transforms,
)


@dataclass(frozen=True, slots=True, eq=False)
class SerialChain:
    """A robot as its maker's data sheet has it: numbers only. What is an angle [rad] of a hinge is
    a way [m] of a slide."""

    T_world_from_base: Transforms  # (4, 4) where it is bolted down, or where its slides begin
    parent_from_joint: Transforms  # (N, 4, 4) each joint in the previous link (or base) at q = 0
    link_from_tool: Transforms  # (4, 4) the tool point's frame in the last link
    range_rad: Floats  # (N, 2) lowest and highest angle
    velocity_limit_rad_s: Floats  # (N,)
    slides: Bools  # (N,) which joints are slides; the others are hinges
    capsule_link: Ints  # (K,) index of the link that carries each capsule
    capsule_ends: Capsules  # (K, 2, 3) end points in the frame of that link [m]
    capsule_radius_m: Floats  # (K,)

    @property
    def n_joints(self) -> int:
        """N, the number of hinges and slides."""
        return len(self.range_rad)


def forward(chain: SerialChain, q: JointAngles) -> Transforms:
    """Frames of all links, (..., N, 4, 4) world_from_link, at angles q (..., N)."""
    angles, lead = _rows(chain, "q", q)
    frames = np.empty((len(angles), chain.n_joints, 4, 4))
    _forward(angles, chain.slides, chain.T_world_from_base, chain.parent_from_joint, frames)
    return frames.reshape(*lead, chain.n_joints, 4, 4)


def tool(chain: SerialChain, q: JointAngles) -> Transforms:
    """The tool's frame, (..., 4, 4) world_from_tool, at angles q (..., N)."""
    return forward(chain, q)[..., -1, :, :] @ chain.link_from_tool


def jacobian(chain: SerialChain, q: JointAngles) -> Floats:
    """Tool velocity per joint velocity, (..., 3, N) [m/rad, of a slide m/m], world axes, at q
    (..., N)."""
    angles, lead = _rows(chain, "q", q)
    result = np.empty((len(angles), 3, chain.n_joints))
    _jacobian(forward(chain, angles), chain.slides, chain.link_from_tool, result)
    return result.reshape(*lead, 3, chain.n_joints)


def turning(chain: SerialChain, q: JointAngles) -> Floats:
    """The tool's turn rate per joint velocity, (..., 3, N), world axes, at q (..., N)."""
    return np.moveaxis(forward(chain, q)[..., :3, 2], -1, -2) * ~chain.slides


def capsules(chain: SerialChain, q: JointAngles) -> Capsules:
    """The robot's collision capsules, (..., K, 2, 3) end points in the world [m]."""
    return _carried(chain, forward(chain, q))


def robot_state(chain: SerialChain, q: JointAngles, qd: JointVelocities) -> RobotState:
    """What the encoders tell: angles, tool and capsules of q and qd, both (..., N)."""
    return robot_along(chain, np.asarray(q, float)[..., None, :], qd)[0]


def robot_along(
    chain: SerialChain, q_path: JointAngles, qd: JointVelocities
) -> tuple[RobotState, Capsules]:
    """The state at the end of paths (..., T, N) with velocities (..., N), and the capsules all
    along them, (..., T, K, 2, 3)."""
    frames = forward(chain, q_path)
    ends = _carried(chain, frames)
    rates, lead = _rows(chain, "qd", qd)
    last = flat(frames[..., -1, :, :, :], 3)
    tool_world, velocity = np.empty((len(rates), 3)), np.empty((len(rates), 3))
    _tool_motion(last, chain.slides, rates, chain.link_from_tool, tool_world, velocity)
    tool_world, velocity = tool_world.reshape(*lead, 3), velocity.reshape(*lead, 3)
    axes = frames[..., -1, -1, :3, :3] @ chain.link_from_tool[:3, :3]
    q, qd = np.array(q_path[..., -1, :], float), np.array(qd, float)
    ended = ends[..., -1, :, :, :]
    radius_m = chain.capsule_radius_m
    robot = RobotState(q, qd, tool_world, velocity, axes, ended, radius_m, chain.slides)
    return robot, ends


def _carried(chain: SerialChain, frames: Transforms) -> Capsules:
    """The capsules on links whose frames (..., N, 4, 4) are known."""
    lead, shape = frames.shape[:-3], chain.capsule_ends.shape
    stacked = flat(frames, 3)
    ends = np.empty((len(stacked), *shape))
    _capsules(stacked, chain.capsule_link, chain.capsule_ends, ends)
    return ends.reshape(*lead, *shape)


def _rows(chain: SerialChain, name: str, values: Floats) -> tuple[Floats, tuple[int, ...]]:
    """Values (..., N) as (B, N), contiguous, and the leading axes they had."""
    array = np.asarray(values, float)
    check_shape(f"The last axis of {name}", array.shape[-1:], (chain.n_joints,), "one per joint")
    return flat(array, 1), array.shape[:-1]


@kernel
def _forward(q, slides, base, parent_from_joint, frames):
    """Multiply the frames up; only the 3 x 4 part takes part."""
    for b in range(q.shape[0]):
        for i in range(q.shape[1]):
            parent = base if i == 0 else frames[b, i - 1]
            fixed, frame = parent_from_joint[i], frames[b, i]
            turn, way = (0.0, q[b, i]) if slides[i] else (q[b, i], 0.0)
            c, s = math.cos(turn), math.sin(turn)
            for row in range(3):
                p0, p1, p2 = parent[row, 0], parent[row, 1], parent[row, 2]
                x = p0 * fixed[0, 0] + p1 * fixed[1, 0] + p2 * fixed[2, 0]
                y = p0 * fixed[0, 1] + p1 * fixed[1, 1] + p2 * fixed[2, 1]
                frame[row, 0] = c * x + s * y
                frame[row, 1] = c * y - s * x
                axis = p0 * fixed[0, 2] + p1 * fixed[1, 2] + p2 * fixed[2, 2]
                shift = p0 * fixed[0, 3] + p1 * fixed[1, 3] + p2 * fixed[2, 3]
                frame[row, 2] = axis
                frame[row, 3] = shift + parent[row, 3] + way * axis
                frame[3, row] = 0.0
            frame[3, 3] = 1.0


@kernel
def _apply(frame, point):
    """frame @ point."""
    x, y, z = point[0], point[1], point[2]
    return (
        frame[0, 3] + (frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z),
        frame[1, 3] + (frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z),
        frame[2, 3] + (frame[2, 0] * x + frame[2, 1] * y + frame[2, 2] * z),
    )


@kernel
def lever(frame, slides, point):
    """A point's velocity per rate of a frame's joint: a slide's axis; a hinge's axis x (point -
    origin)."""
    if slides:
        return frame[0, 2], frame[1, 2], frame[2, 2]
    rx, ry, rz = point[0] - frame[0, 3], point[1] - frame[1, 3], point[2] - frame[2, 3]
    ax, ay, az = frame[0, 2], frame[1, 2], frame[2, 2]
    return ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx


@kernel
def _jacobian(frames, slides, link_from_tool, out):
    """Column i is the tool's velocity per rate of joint i."""
    n = frames.shape[1]
    for b in range(frames.shape[0]):
        point = _apply(frames[b, n - 1], link_from_tool[:, 3])
        for i in range(n):
            out[b, 0, i], out[b, 1, i], out[b, 2, i] = lever(frames[b, i], slides[i], point)


@kernel
def _tool_motion(frames, slides, qd, link_from_tool, point, velocity):
    """Where the tool points are, and how fast."""
    n = frames.shape[1]
    for b in range(frames.shape[0]):
        tool = _apply(frames[b, n - 1], link_from_tool[:, 3])
        vx, vy, vz = 0.0, 0.0, 0.0
        for i in range(n):
            x, y, z = lever(frames[b, i], slides[i], tool)
            vx, vy, vz = vx + x * qd[b, i], vy + y * qd[b, i], vz + z * qd[b, i]
        point[b, 0], point[b, 1], point[b, 2] = tool
        velocity[b, 0], velocity[b, 1], velocity[b, 2] = vx, vy, vz


@kernel
def _capsules(frames, link, ends_link, ends_world):
    for b in range(frames.shape[0]):
        for k in range(len(link)):
            for e in range(2):
                x, y, z = _apply(frames[b, link[k]], ends_link[k, e])
                ends_world[b, k, e, 0], ends_world[b, k, e, 1] = x, y
                ends_world[b, k, e, 2] = z
