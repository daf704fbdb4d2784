"""Kinematics of serial chains: link frames, tool point, Jacobian and capsules, in numba.

A hinge rotates about the z axis of its joint frame, and a slide translates along it. The frame of
link i is that of joint i, moved by q_i: T_world_from_link_i = T_world_from_base @ prod_{j <= i}
(parent_from_joint_j M_j(q_j)), where M is Rz for a hinge and Tz for a slide.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.batching import flatten_axes
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
    Points3,
    Transforms,
    Vector3,
    Velocities3,
)


@dataclass(frozen=True, slots=True, eq=False)
class SerialChain:
    """Kinematics, collision capsules and joint limits of a robot.

    Units are given for hinges; for slides, replace rad by m.
    """

    T_world_from_base: Transforms
    """(4, 4) pose of the robot's base, or of the origin of its slides [m]."""
    parent_from_joint: Transforms
    """(N, 4, 4) pose of each joint in the frame of the previous link (or the base) at q = 0 [m]."""
    link_from_tool: Transforms
    """(4, 4) pose of the tool frame in the frame of the last link [m]."""
    range_rad: Floats
    """(N, 2) lower and upper joint limits [rad]."""
    velocity_limit_rad_s: Floats
    """(N,) maximum joint speeds [rad/s]."""
    slides: Bools
    """(N,) mask of the joints that are slides; the others are hinges."""
    capsule_link: Ints
    """(K,) index of the link that carries each capsule."""
    capsule_ends: Capsules
    """(K, 2, 3) end points of each capsule's axis in the frame of its link [m]."""
    capsule_radius_m: Floats
    """(K,) radii of the capsules [m]."""

    @property
    def n_joints(self) -> int:
        """Number N of hinges and slides."""
        return len(self.range_rad)


class RobotPath(NamedTuple):
    """State of a robot at the end of a path, and its capsules along the path."""

    robot: RobotState
    """State of the robot at the end of the path."""
    capsules_world: Capsules
    """(..., T, K, 2, 3) end points of the capsules' axes at every point of the path [m]."""


def link_frames(chain: SerialChain, q: JointAngles) -> Transforms:
    """Return the poses (..., N, 4, 4) of all links in the world, at joint angles q (..., N)."""
    angles = flatten_axes(_check_joints(chain, "q", q), 1)
    frames = np.empty((len(angles), chain.n_joints, 4, 4))
    _write_frames(angles, chain.slides, chain.T_world_from_base, chain.parent_from_joint, frames)
    return frames.reshape(*np.shape(q)[:-1], chain.n_joints, 4, 4)


def tool_frame(chain: SerialChain, q: JointAngles) -> Transforms:
    """Return the pose (..., 4, 4) of the tool frame in the world, at joint angles q (..., N)."""
    return link_frames(chain, q)[..., -1, :, :] @ chain.link_from_tool


def jacobian(chain: SerialChain, q: JointAngles) -> Floats:
    """Return the Jacobian of the tool point's velocity at joint angles q (..., N).

    Returns:
        (..., 3, N) in the world frame [m/rad; m/m for a slide].
    """
    frames = flatten_axes(link_frames(chain, q), 3)
    result = np.empty((len(frames), 3, chain.n_joints))
    _write_jacobian(frames, chain.slides, chain.link_from_tool, result)
    return result.reshape(*np.shape(q)[:-1], 3, chain.n_joints)


def angular_jacobian(chain: SerialChain, q: JointAngles) -> Floats:
    """Return the Jacobian (..., 3, N) of the tool's angular velocity, in the world frame."""
    return np.moveaxis(link_frames(chain, q)[..., :3, 2], -1, -2) * ~chain.slides


def capsules(chain: SerialChain, q: JointAngles) -> Capsules:
    """Return the end points (..., K, 2, 3) of the robot's collision capsules in the world [m]."""
    return _place_capsules(chain, link_frames(chain, q))


def robot_state(chain: SerialChain, q: JointAngles, qd: JointVelocities) -> RobotState:
    """Return the state of a robot with joint angles q and velocities qd, both (..., N)."""
    return robot_path(chain, np.asarray(q, float)[..., None, :], qd).robot


def robot_path(chain: SerialChain, q_path: JointAngles, qd: JointVelocities) -> RobotPath:
    """Return the state of a robot at the end of a path, and its capsules along the path.

    Args:
        chain: geometry of the robot.
        q_path: (..., T, N) joint angles at the points of the path.
        qd: (..., N) joint velocities at the end of the path.
    """
    frames = link_frames(chain, q_path)
    ends = _place_capsules(chain, frames)
    rates = flatten_axes(_check_joints(chain, "qd", qd), 1)
    lead = np.shape(qd)[:-1]
    last = flatten_axes(frames[..., -1, :, :, :], 3)
    tool_world, velocity = np.empty((len(rates), 3)), np.empty((len(rates), 3))
    _write_tool_motion(last, chain.slides, rates, chain.link_from_tool, tool_world, velocity)
    axes = frames[..., -1, -1, :3, :3] @ chain.link_from_tool[:3, :3]
    robot = RobotState(
        q=np.array(q_path[..., -1, :], float),
        qd=np.array(qd, float),
        tool_world=tool_world.reshape(*lead, 3),
        tool_velocity_world=velocity.reshape(*lead, 3),
        tool_axes_world=axes,
        capsules_world=ends[..., -1, :, :, :],
        capsule_radius_m=chain.capsule_radius_m,
        slides=chain.slides,
    )
    return RobotPath(robot, ends)


def _place_capsules(chain: SerialChain, frames: Transforms) -> Capsules:
    """Return the capsules (..., K, 2, 3) in the world, given the links' poses (..., N, 4, 4)."""
    shape = chain.capsule_ends.shape
    stacked = flatten_axes(frames, 3)
    ends = np.empty((len(stacked), *shape))
    _write_capsules(stacked, chain.capsule_link, chain.capsule_ends, ends)
    return ends.reshape(*frames.shape[:-3], *shape)


def _check_joints(chain: SerialChain, name: str, values: Floats) -> Floats:
    """Return values (..., N) as an array; raise `ConfigError` if N is not the number of joints."""
    array = np.asarray(values, float)
    check_shape(
        f"The last axis of {name}", array.shape[-1:], (chain.n_joints,), "one entry per joint"
    )
    return array


@kernel
def _write_frames(
    q: JointAngles,
    slides: Bools,
    base: Transforms,
    parent_from_joint: Transforms,
    frames: Transforms,
) -> None:
    """Compute the poses `frames` (B, N, 4, 4) of the links at q (B, N); see `SerialChain`."""
    for b in range(q.shape[0]):
        for i in range(q.shape[1]):
            parent = base if i == 0 else frames[b, i - 1]
            fixed, frame = parent_from_joint[i], frames[b, i]
            turn, way = (0.0, q[b, i]) if slides[i] else (q[b, i], 0.0)
            c, s = math.cos(turn), math.sin(turn)
            for row in range(3):  # the last row of a transform is constant
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
def transform_point(frame: Transforms, point: Floats) -> Vector3:
    """Transform a point (3,) from a frame with pose (4, 4) to the parent frame [m]."""
    x, y, z = point[0], point[1], point[2]
    return Vector3(
        frame[0, 3] + (frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z),
        frame[1, 3] + (frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z),
        frame[2, 3] + (frame[2, 0] * x + frame[2, 1] * y + frame[2, 2] * z),
    )


@kernel
def lever(frame: Transforms, is_slide: bool, point: Floats | Vector3) -> Vector3:
    """Return the derivative of a point's velocity with respect to the velocity of a joint.

    It is the joint's axis for a slide, and the cross product axis x (point - origin) for a hinge.

    Args:
        frame: (4, 4) pose of the joint's frame.
        is_slide: whether the joint is a slide.
        point: (3,) position of the point [m].
    """
    if is_slide:
        return Vector3(frame[0, 2], frame[1, 2], frame[2, 2])
    rx, ry, rz = point[0] - frame[0, 3], point[1] - frame[1, 3], point[2] - frame[2, 3]
    ax, ay, az = frame[0, 2], frame[1, 2], frame[2, 2]
    return Vector3(ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx)


@kernel
def _write_jacobian(
    frames: Transforms, slides: Bools, link_from_tool: Transforms, out: Floats
) -> None:
    """Compute the Jacobian `out` (B, 3, N) of the tool point; column i belongs to joint i."""
    n = frames.shape[1]
    for b in range(frames.shape[0]):
        point = transform_point(frames[b, n - 1], link_from_tool[:, 3])
        for i in range(n):
            column = lever(frames[b, i], slides[i], point)
            out[b, 0, i], out[b, 1, i], out[b, 2, i] = column.x, column.y, column.z


@kernel
def _write_tool_motion(
    frames: Transforms,
    slides: Bools,
    qd: JointVelocities,
    link_from_tool: Transforms,
    tool_world: Points3,
    velocity_world: Velocities3,
) -> None:
    """Compute the positions (B, 3) [m] and velocities (B, 3) [m/s] of the tool points."""
    n = frames.shape[1]
    for b in range(frames.shape[0]):
        tool = transform_point(frames[b, n - 1], link_from_tool[:, 3])
        vx, vy, vz = 0.0, 0.0, 0.0
        for i in range(n):
            x, y, z = lever(frames[b, i], slides[i], tool)
            vx, vy, vz = vx + x * qd[b, i], vy + y * qd[b, i], vz + z * qd[b, i]
        tool_world[b, 0], tool_world[b, 1], tool_world[b, 2] = tool.x, tool.y, tool.z
        velocity_world[b, 0], velocity_world[b, 1], velocity_world[b, 2] = vx, vy, vz


@kernel
def _write_capsules(
    frames: Transforms, link: Ints, ends_link: Capsules, ends_world: Capsules
) -> None:
    """Compute the capsules `ends_world` (B, K, 2, 3) [m] of links with poses (B, N, 4, 4)."""
    for b in range(frames.shape[0]):
        for k in range(len(link)):
            for e in range(2):
                end = transform_point(frames[b, link[k]], ends_link[k, e])
                ends_world[b, k, e, 0], ends_world[b, k, e, 1] = end.x, end.y
                ends_world[b, k, e, 2] = end.z
