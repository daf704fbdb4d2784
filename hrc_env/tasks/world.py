"""What a robot handles: the task's loose objects, and what is measured of them.

Objects are not what this project asks about: the robot knows them by their true pose plus noise.
"""

from dataclasses import dataclass, replace

import numpy as np

from hrc_env.core.errors import check_fields
from hrc_env.core.records import HandState, ObjectState, RobotState
from hrc_env.core.typing import Floats, Rngs


@dataclass(frozen=True, slots=True)
class ObjectsConfig:
    """How well the robot knows the task's loose objects."""

    noise_m: float = 0.001
    """Standard deviation of each coordinate, drawn in every step [m]."""
    noise_rad: float = 0.005
    """The same of the turn about each axis [rad]."""

    def __post_init__(self) -> None:
        check_fields(self, "not be negative", "noise_m", "noise_rad")


@dataclass(frozen=True, slots=True)
class World:
    """What a task judges, and what the robot feels; rows are the environments in question."""

    robot: RobotState
    hand: HandState | None = None
    """Of an arm with a gripper."""
    objects: ObjectState | None = None
    """The task's loose objects as they are."""


def measured(objects: ObjectState, rngs: Rngs, config: ObjectsConfig) -> ObjectState:
    """Objects as the robot knows them, with a generator for each environment."""
    shape = objects.position_world.shape[1:]
    noise = np.array([rng.standard_normal((2, *shape)) for rng in rngs]).reshape(-1, 2, *shape)
    shift_m, half_turn = config.noise_m * noise[:, 0], 0.5 * config.noise_rad * noise[:, 1]
    return replace(
        objects,
        position_world=objects.position_world + shift_m,
        quaternion_wxyz=_turned(objects.quaternion_wxyz, half_turn),
    )


def _turned(quaternion: Floats, half_turn: Floats) -> Floats:
    """Quaternions (..., 4) turned a little about world axes: half angles (..., 3) [rad]."""
    w, v = quaternion[..., :1], quaternion[..., 1:]
    aside = (half_turn * v).sum(-1, keepdims=True)
    turned = np.concatenate([w - aside, v + w * half_turn + np.cross(half_turn, v)], axis=-1)
    return turned / np.linalg.norm(turned, axis=-1, keepdims=True)
