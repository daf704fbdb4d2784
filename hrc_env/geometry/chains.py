"""Serial chains of hinges: link frames, tool point, Jacobian, capsules; batched in numba.

Every joint turns about the z axis of its own frame. Link i's frame is joint i's frame turned
by q_i, so T_world_from_link_i = T_world_from_base @ prod_{j <= i} (parent_from_joint_j Rz(q_j)).
"""

import math
from dataclasses import dataclass

import numba
import numpy as np

from hrc_env.errors import check_shape
from hrc_env.records import RobotState
from hrc_env.typing import Capsules, Floats, Ints, JointAngles, JointVelocities, Transforms


@dataclass(frozen=True, slots=True, eq=False)
class SerialChain:
    """An arm as its maker's data sheet has it: numbers only."""

    joint_names: tuple[str, ...]
    T_world_from_base: Transforms
    """(4, 4) where the arm is bolted down."""
    parent_from_joint: Transforms
    """(N, 4, 4) frame of each joint in the previous link (the base for the first) at q = 0."""
    link_from_tool: Transforms
    """(4, 4) the tool point's frame in the last link."""
    range_rad: Floats
    """(N, 2) lowest and highest angle."""
    velocity_limit_rad_s: Floats
    """(N,)."""
    capsule_names: tuple[str, ...]
    capsule_link: Ints
    """(K,) index of the link that carries each capsule."""
    capsule_ends: Capsules
    """(K, 2, 3) end points in the frame of that link [m]."""
    capsule_radius_m: Floats
    """(K,)."""

    @property
    def n_joints(self) -> int:
        """N, the number of hinges."""
        return len(self.joint_names)


def forward(chain: SerialChain, q: JointAngles) -> Transforms:
    """Frames of all links, (..., N, 4, 4) world_from_link, at angles q (..., N)."""
    flat, lead = _flat(chain, "q", q)
    frames = np.empty((len(flat), chain.n_joints, 4, 4))
    _forward(flat, chain.T_world_from_base, chain.parent_from_joint, frames)
    return frames.reshape(*lead, chain.n_joints, 4, 4)


def tool(chain: SerialChain, q: JointAngles) -> Transforms:
    """The tool's frame, (..., 4, 4) world_from_tool, at angles q (..., N)."""
    return forward(chain, q)[..., -1, :, :] @ chain.link_from_tool


def jacobian(chain: SerialChain, q: JointAngles) -> Floats:
    """Tool velocity per joint velocity, (..., 3, N) [m/rad], world axes, at q (..., N)."""
    return twist_jacobian(chain, q)[..., :3, :]


def twist_jacobian(chain: SerialChain, q: JointAngles) -> Floats:
    """(..., 6, N): rows 0-2 the tool point's velocity [m/rad], rows 3-5 its turn rate [rad/rad]."""
    flat, lead = _flat(chain, "q", q)
    frames = forward(chain, flat)
    result = np.empty((len(flat), 6, chain.n_joints))
    _jacobian(frames, chain.link_from_tool[:3, 3].copy(), result)
    return result.reshape(*lead, 6, chain.n_joints)


def capsules(chain: SerialChain, q: JointAngles) -> Capsules:
    """The arm's collision capsules, (..., K, 2, 3) end points in the world [m]."""
    flat, lead = _flat(chain, "q", q)
    ends = np.empty((len(flat), len(chain.capsule_link), 2, 3))
    _capsules(forward(chain, flat), chain.capsule_link, chain.capsule_ends, ends)
    return ends.reshape(*lead, *ends.shape[1:])


def robot_state(chain: SerialChain, q: JointAngles, qd: JointVelocities) -> RobotState:
    """What the encoders tell: angles, tool and capsules of q and qd, both (..., N)."""
    flat, lead = _flat(chain, "q", q)
    rates, _ = _flat(chain, "qd", qd)
    frames = forward(chain, flat)
    tool_world, velocity = np.empty((len(flat), 3)), np.empty((len(flat), 3))
    ends = np.empty((len(flat), len(chain.capsule_link), 2, 3))
    _tool_motion(frames, rates, chain.link_from_tool[:3, 3].copy(), tool_world, velocity)
    _capsules(frames, chain.capsule_link, chain.capsule_ends, ends)
    return RobotState(
        q=np.array(q, float),
        qd=np.array(qd, float),
        tool_world=tool_world.reshape(*lead, 3),
        tool_velocity_world=velocity.reshape(*lead, 3),
        capsules_world=ends.reshape(*lead, *ends.shape[1:]),
        capsule_radius_m=chain.capsule_radius_m,
    )


def _flat(chain: SerialChain, name: str, values: Floats) -> tuple[Floats, tuple[int, ...]]:
    """Values (..., N) as (B, N), contiguous, and the leading axes they had."""
    array = np.asarray(values, float)
    check_shape(f"The last axis of {name}", array.shape[-1:], (chain.n_joints,), "one per joint")
    return np.ascontiguousarray(array.reshape(-1, chain.n_joints)), array.shape[:-1]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _forward(q, base, parent_from_joint, frames):
    """Multiply the frames up; only the 3 x 4 part takes part."""
    for b in range(q.shape[0]):
        for i in range(q.shape[1]):
            parent = base if i == 0 else frames[b, i - 1]
            fixed, frame = parent_from_joint[i], frames[b, i]
            c, s = math.cos(q[b, i]), math.sin(q[b, i])
            for row in range(3):
                p0, p1, p2 = parent[row, 0], parent[row, 1], parent[row, 2]
                x = p0 * fixed[0, 0] + p1 * fixed[1, 0] + p2 * fixed[2, 0]
                y = p0 * fixed[0, 1] + p1 * fixed[1, 1] + p2 * fixed[2, 1]
                frame[row, 0] = c * x + s * y
                frame[row, 1] = c * y - s * x
                frame[row, 2] = p0 * fixed[0, 2] + p1 * fixed[1, 2] + p2 * fixed[2, 2]
                shift = p0 * fixed[0, 3] + p1 * fixed[1, 3] + p2 * fixed[2, 3]
                frame[row, 3] = shift + parent[row, 3]
                frame[3, row] = 0.0
            frame[3, 3] = 1.0


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _apply(frame, point, out):
    """out = frame @ point."""
    for row in range(3):
        out[row] = frame[row, 3] + (
            frame[row, 0] * point[0] + frame[row, 1] * point[1] + frame[row, 2] * point[2]
        )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _jacobian(frames, tool_in_link, out):
    """Column i is (axis_i x (tool - origin_i), axis_i)."""
    point = np.empty(3)
    n = frames.shape[1]
    for b in range(frames.shape[0]):
        _apply(frames[b, n - 1], tool_in_link, point)
        for i in range(n):
            frame = frames[b, i]
            rx, ry, rz = point[0] - frame[0, 3], point[1] - frame[1, 3], point[2] - frame[2, 3]
            ax, ay, az = frame[0, 2], frame[1, 2], frame[2, 2]
            out[b, 0, i] = ay * rz - az * ry
            out[b, 1, i] = az * rx - ax * rz
            out[b, 2, i] = ax * ry - ay * rx
            out[b, 3, i], out[b, 4, i], out[b, 5, i] = ax, ay, az


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _tool_motion(frames, qd, tool_in_link, point, velocity):
    n = frames.shape[1]
    column = np.empty((1, 6, n))
    for b in range(frames.shape[0]):
        _apply(frames[b, n - 1], tool_in_link, point[b])
        _jacobian(frames[b : b + 1], tool_in_link, column)
        for row in range(3):
            total = 0.0
            for i in range(n):
                total += column[0, row, i] * qd[b, i]
            velocity[b, row] = total


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _capsules(frames, link, ends_link, ends_world):
    for b in range(frames.shape[0]):
        for k in range(len(link)):
            for e in range(2):
                _apply(frames[b, link[k]], ends_link[k, e], ends_world[b, k, e])
