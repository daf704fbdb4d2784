"""State and measurement of a task's loose objects, and loads that robots carry.

Objects are not tracked by cameras; the robot measures their true poses with noise.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import check_fields
from hrc_env.core.records import ObjectState, RobotState
from hrc_env.core.typing import Bools, Capsules, Floats, Ints, QuaternionsWxyz, Rngs
from hrc_env.scene.build import Scene
from hrc_env.scene.objects import attach_objects, make_object_state
from hrc_env.scene.physics import Physics
from hrc_env.world import World


@dataclass(frozen=True, slots=True)
class ObjectsConfig:
    """Noise of the robot's measurement of the task's loose objects."""

    noise_m: float = 0.001
    """Standard deviation of the noise on each coordinate of an object's position in every step
    [m]."""
    noise_rad: float = 0.005
    """Standard deviation of the noise on an object's rotation about each axis in every step
    [rad]."""

    def __post_init__(self) -> None:
        check_fields(self, "not be negative", "noise_m", "noise_rad")


class LoadedRobot(NamedTuple):
    """States and paths of robots, including the objects that they carry."""

    world: World
    """True state, in which the capsules of carried objects belong to the robot."""
    path_world: Capsules
    """(B, T, K, 2, 3) capsules of robot and carried objects after every substep [m]."""


def make_world(physics: Physics, ids: Ints, robot: RobotState) -> World:
    """Return the true state of robots, hands and objects of environments `ids`."""
    hand, objects = physics.hand_state(ids), physics.scene.objects
    if not objects.names:
        return World(robot, hand)
    qpos, qvel = physics.qpos[ids], physics.qvel[ids]
    held = np.zeros((len(ids), len(objects.names)), bool)
    if hand is not None:
        held = physics.held(ids, robot.tool_world, hand)
    return World(robot, hand, make_object_state(objects, qpos, qvel, held))


def attach_load(
    scene: Scene, world: World, path_world: Capsules, q_path: Floats, is_load: Bools | bool = True
) -> LoadedRobot:
    """Return the states and paths of robots with carried objects as parts of the robots.

    Args:
        scene: the scene.
        world: state of the B robots and their objects.
        path_world: (B, T, K, 2, 3) capsules of the robots after every substep [m].
        q_path: (B, T, nq) `qpos` after every substep.
        is_load: mask (B, O) of the objects that count as part of the robot while they are held.
    """
    if world.objects is None:
        return LoadedRobot(world, path_world)
    held = world.objects.held & is_load
    robot, path_world = attach_objects(world.robot, path_world, scene.objects, q_path, held)
    return LoadedRobot(replace(world, robot=robot), path_world)


def measure_objects(objects: ObjectState, rngs: Rngs, config: ObjectsConfig) -> ObjectState:
    """Return a noisy measurement of objects.

    Args:
        objects: (B, O) true states.
        rngs: B random generators.
        config: standard deviations of the noise.
    """
    shape = objects.position_world.shape[1:]
    noise = np.array([rng.standard_normal((2, *shape)) for rng in rngs]).reshape(-1, 2, *shape)
    shift_m, half_turn = config.noise_m * noise[:, 0], 0.5 * config.noise_rad * noise[:, 1]
    return replace(
        objects,
        position_world=objects.position_world + shift_m,
        quaternion_wxyz=_rotate(objects.quaternion_wxyz, half_turn),
    )


def _rotate(quaternion: QuaternionsWxyz, half_turn: Floats) -> QuaternionsWxyz:
    """Rotate quaternions (..., 4) in the world by small vectors 2 `half_turn` (..., 3) [rad]."""
    w, v = quaternion[..., :1], quaternion[..., 1:]
    dot = (half_turn * v).sum(-1, keepdims=True)
    rotated = np.concatenate([w - dot, v + w * half_turn + np.cross(half_turn, v)], axis=-1)
    return rotated / np.linalg.norm(rotated, axis=-1, keepdims=True)
