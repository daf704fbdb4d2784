"""What scripted agents that handle things have in common: from where to go to what joints do."""

import numpy as np
from numpy.typing import NDArray

from hrc_env.control import resolve_twist

from .env_info import EnvInfo

Array = NDArray[np.float64]
ROUND_RAD = 0.35
"""A target farther round the robot than this is approached along a circle."""
TURN_HZ = 4.0
"""Turn rate per angle [1/s]."""


def round_the_foot(tool: Array, target: Array, foot_xy: Array, radius_m: float) -> Array:
    """(n, 3) ways to targets from the tool, (n, 3) each: along a circle of a radius at most round
    the robot's axis where they are far round it, else straight."""
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
    """(n, 3) turn rates that bring the tool's axes x and z, (n, 6), to those wanted."""
    own_x, own_z = tool_axes[:, :3], tool_axes[:, 3:]
    own_y, y = np.cross(own_z, own_x), np.cross(z, x)
    pairs = ((own_x, x), (own_y, y), (own_z, z))
    half = 0.5 * sum(np.cross(own, wanted) for own, wanted in pairs)
    rate = np.linalg.norm(half, axis=1, keepdims=True)
    return half / np.maximum(rate, 1e-9) * np.minimum(TURN_HZ * rate, most_rad_s)


def arm_action(env_info: EnvInfo, terms: dict[str, Array], velocity: Array, turn: Array) -> Array:
    """(n, A - 1) the arm's part of an action for velocities and turn rates of the tool, (n, 3)."""
    config, twist = env_info.control_config, np.concatenate([velocity, turn], axis=1)
    if env_info.control == "twist":
        scale = np.repeat([config.tool_speed_mps, config.tool_turn_rad_s], 3)
        return np.clip(twist / scale, -1.0, 1.0)
    q = np.arctan2(terms["joint_angle_sin"], terms["joint_angle_cos"])
    qd = resolve_twist(env_info.chain, q, twist, config)
    action = qd / (config.joint_speed_share * env_info.chain.velocity_limit_rad_s)
    return action / np.maximum(np.abs(action).max(1, keepdims=True), 1.0)
