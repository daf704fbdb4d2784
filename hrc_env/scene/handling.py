"""What a robot handles: the task's loose objects, and what it knows of them.

Objects are not what this project asks about: they are known by their true pose plus noise.
"""

from dataclasses import dataclass, replace

import numpy as np

from hrc_env.core.errors import check_fields
from hrc_env.core.records import ObjectState, RobotState
from hrc_env.core.typing import Bools, Capsules, Floats, Ints, Rngs
from hrc_env.scene.build import Scene
from hrc_env.scene.objects import object_state, with_load
from hrc_env.scene.physics import Physics
from hrc_env.world import World


@dataclass(frozen=True, slots=True)
class ObjectsConfig:
    """How well the robot knows the task's loose objects."""

    noise_m: float = 0.001
    """Standard deviation of each coordinate, drawn in every step [m]."""
    noise_rad: float = 0.005
    """The same of the turn about each axis [rad]."""

    def __post_init__(self) -> None:
        check_fields(self, "not be negative", "noise_m", "noise_rad")


def world_of(physics: Physics, ids: Ints, robot: RobotState) -> World:
    """Robots of environments `ids` with what they handle."""
    hand, objects = physics.hand_state(ids), physics.scene.objects
    if not objects.names:
        return World(robot, hand)
    qpos, qvel = physics.qpos[ids], physics.qvel[ids]
    held = np.zeros((len(ids), len(objects.names)), bool)
    if hand is not None:
        held = physics.held(ids, robot.tool_world, hand)
    return World(robot, hand, object_state(objects, qpos, qvel, held))


def loaded(
    scene: Scene, world: World, arm_world: Capsules, q_path: Floats, loads: Bools | bool = True
) -> tuple[World, Capsules]:
    """What a robot carries is part of it, now and along capsules (B, T, K, 2, 3) where qpos is
    q_path (B, T, nq): all objects, or those that are `loads` (B, O)."""
    if world.objects is None:
        return world, arm_world
    held = world.objects.held & loads
    robot, arm = with_load(world.robot, arm_world, scene.objects, q_path, held)
    return replace(world, robot=robot), arm


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
