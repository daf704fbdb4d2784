"""Functions for scripted manipulation that convert targets of the tool to actions."""

import numpy as np
from numpy.typing import NDArray

from hrc_env.control import resolve_twist

from .env_info import EnvInfo

Array = NDArray[np.float64]
ROUND_RAD = 0.35
"""Angle around the robot beyond which a target is approached along a circle [rad]."""
TURN_HZ = 4.0
"""Proportional gain of turns: turn rate per angle error [1/s]."""


def plan_around_foot(tool: Array, target: Array, foot_xy: Array, radius_m: float) -> Array:
    """Plan displacements to targets, along a circle around the robot if their angle is large.

    Args:
        tool: position of the tool (n, 3) [m].
        target: positions of targets relative to the tool (n, 3) [m].
        foot_xy: horizontal position of the robot's axis (2,) [m].
        radius_m: maximum radius of the circle [m].

    Returns:
        Displacements of the tool (n, 3) [m]; targets within `ROUND_RAD` are approached straight.
    """
    here, there = tool[:, :2] - foot_xy, tool[:, :2] + target[:, :2] - foot_xy
    radius, wanted = np.linalg.norm(here, axis=1), np.linalg.norm(there, axis=1)
    cross = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
    angle = np.arctan2(cross, (here * there).sum(1))
    outward = here / np.maximum(radius, 1e-6)[:, None]
    aside = np.stack([-outward[:, 1], outward[:, 0]], axis=1)
    inward = np.minimum(wanted, radius_m) - radius
    arc = (radius * angle)[:, None] * aside + inward[:, None] * outward
    far = np.abs(angle) > ROUND_RAD
    return np.concatenate([np.where(far[:, None], arc, target[:, :2]), target[:, 2:]], axis=1)


def turn_towards(tool_axes: Array, x: Array, z: Array, most_rad_s: float) -> Array:
    """Return angular velocities (n, 3) [rad/s] that turn the tool towards desired axes.

    Args:
        tool_axes: current x and z axes of the tool (n, 6).
        x: desired x axis (n, 3).
        z: desired z axis (n, 3).
        most_rad_s: maximum angular speed [rad/s].
    """
    own_x, own_z = tool_axes[:, :3], tool_axes[:, 3:]
    own_y, y = np.cross(own_z, own_x), np.cross(z, x)
    pairs = ((own_x, x), (own_y, y), (own_z, z))
    half = 0.5 * sum(np.cross(own, wanted) for own, wanted in pairs)
    rate = np.linalg.norm(half, axis=1, keepdims=True)
    return half / np.maximum(rate, 1e-9) * np.minimum(TURN_HZ * rate, most_rad_s)


def make_arm_action(
    env_info: EnvInfo, terms: dict[str, Array], velocity: Array, turn: Array
) -> Array:
    """Return the arm's entries (n, A - 1) of actions for a motion of the tool.

    Args:
        env_info: information about the environment.
        terms: terms of the observation, by name.
        velocity: velocity of the tool (n, 3) [m/s].
        turn: angular velocity of the tool (n, 3) [rad/s].
    """
    config, twist = env_info.control_config, np.concatenate([velocity, turn], axis=1)
    if env_info.control == "twist":
        scale = np.repeat([config.tool_speed_m_s, config.tool_rotation_rad_s], 3)
        return np.clip(twist / scale, -1.0, 1.0)
    q = np.arctan2(terms["joint_angle_sin"], terms["joint_angle_cos"])
    qd = resolve_twist(env_info.chain, q, twist, config)
    action = qd / (config.joint_speed_share * env_info.chain.velocity_limit_rad_s)
    return action / np.maximum(np.abs(action).max(1, keepdims=True), 1.0)
