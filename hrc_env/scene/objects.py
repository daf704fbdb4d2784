"""Loose objects of a task: bodies with a free joint that consist of boxes.

In `qpos`, their free joints follow the robot's joints, with seven numbers each: position [m] and
quaternion (w, x, y, z).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import mujoco
import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.records import HandState, ObjectState, RobotState
from hrc_env.core.typing import Bools, Capsules, Floats, Points3
from hrc_env.geometry.rotations import rotate
from hrc_env.geometry.shapes import BOX, WIDTH, absent_shape, shape
from hrc_env.scene.primitives import DECORATION, OBJECT_BIT
from hrc_env.worker.props import place_shapes
from hrc_env.world import TaskScene

PREFIX = "task/"
"""Prefix of the names of a task's parts in a scene."""
POSE = 7
"""Number of entries of an object's pose in `qpos`."""
RATE = 6
"""Number of entries of an object's velocity in `qvel`."""
PITCH_M = 0.10
"""Maximum distance between the axes of neighbouring capsules of a carried box [m]."""
THINNEST_M = 0.019
"""Minimum radius of a capsule of a carried box [m]."""
AWAY_M = 1e4
"""Coordinate at which the capsules of objects that are not carried are placed [m]."""
GRIP_M = 0.01
"""Maximum distance of the tool point from an object that closed fingers hold [m]."""


def add_task_scene(spec: mujoco.MjSpec, task_scene: TaskScene, foot_world: Sequence[float]) -> None:
    """Add a task's bodies to a scene that is being built.

    Elliptic friction cones are used, because they reduce the slip of gripped objects to a minimum:
    8 mm in 6 s for 5 kg that are shaken at 3 m/s^2, instead of 31 mm with MuJoCo's defaults.

    Args:
        spec: specification of the scene.
        task_scene: the task's part of the scene.
        foot_world: position of the robot's base [m].
    """
    if task_scene.mjcf:
        spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 10.0
        child = mujoco.MjSpec.from_string(task_scene.mjcf)
        for geom in (each for body in child.bodies if _is_free(body) for each in body.geoms):
            geom.group = DECORATION  # because solid geoms must not move
        frame = spec.worldbody.add_frame(pos=list(foot_world))
        spec.attach(child, prefix=PREFIX, frame=frame)


def add_welds(spec: mujoco.MjSpec, task_scene: TaskScene) -> None:
    """Add a task's welds to a scene that already contains their sites."""
    kinds = {True: mujoco.mjtEq.mjEQ_WELD, False: mujoco.mjtEq.mjEQ_CONNECT}
    for weld in task_scene.welds:
        spec.add_equality(
            type=kinds[weld.turns],
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            name=weld.name,
            name1=weld.sites[0],
            name2=weld.sites[1],
            solref=list(weld.solref),
            active=False,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Objects:
    """Shapes of the O loose objects of a scene, in their body frames."""

    names: tuple[str, ...]
    """Names of the objects."""
    first: int
    """Index of the first object in `qpos` and `qvel`, after the robot's joints."""
    half_size_m: Points3
    """(O, 3) half edge lengths of each object's bounding box, which is centred at the origin
    [m]."""
    parts: Floats
    """(O, n, `shapes.WIDTH`) boxes of each object; unused rows are absent shapes."""
    capsules: Capsules
    """(O, n, 2, 3) capsules that represent each object [m]; unused rows are NaN."""
    capsule_radius_m: Floats
    """(O, n) radii of the capsules [m]; 0 in unused rows."""

    def poses(self, qpos: Floats) -> Floats:
        """Return position [m] and quaternion (..., O, 7) of each object, from qpos (..., nq)."""
        rows = qpos[..., self.first : self.first + POSE * len(self.names)]
        return rows.reshape(*qpos.shape[:-1], len(self.names), POSE)


class BoxCapsule(NamedTuple):
    """A capsule that represents a part of a box, in the frame of the box."""

    ends: Points3
    """(2, 3) end points of the capsule's axis [m]."""
    radius_m: float
    """Radius of the capsule [m]."""


class PaddedCapsules(NamedTuple):
    """Capsules of several objects in padded arrays."""

    ends: Capsules
    """(O, n, 2, 3) end points of the capsules' axes [m]; unused rows are NaN."""
    radius_m: Floats
    """(O, n) radii of the capsules [m]; 0 in unused rows."""


class LoadedArm(NamedTuple):
    """States and paths of robots, including the objects that they hold."""

    robot: RobotState
    """State of the robots, including the capsules of held objects."""
    path_world: Capsules
    """(B, T, K, 2, 3) capsules of robot and objects along a path [m]."""


def find_objects(spec: mujoco.MjSpec, first: int) -> Objects:
    """Find the free bodies of a scene; their coordinates follow those of `first` robot joints.

    Raises:
        ConfigError: a body does not consist of boxes, or its boxes are not centred at its origin.
    """
    bodies = [body for body in spec.bodies if _is_free(body)]
    half = np.zeros((len(bodies), 3))
    parts: list[list[Floats]] = []
    capsules: list[list[BoxCapsule]] = []
    for row, body in enumerate(bodies):
        boxes = [geom for geom in body.geoms if geom.contype & OBJECT_BIT]
        if not boxes or any(geom.type != mujoco.mjtGeom.mjGEOM_BOX for geom in boxes):
            raise ConfigError(f"Object {body.name!r} must be of boxes with contype {OBJECT_BIT}.")
        low = np.min([geom.pos - geom.size for geom in boxes], axis=0)
        high = np.max([geom.pos + geom.size for geom in boxes], axis=0)
        if np.abs(low + high).max() > 1e-6:
            raise ConfigError(f"Object {body.name!r} must have its center at its origin.")
        half[row] = high
        parts.append([shape(BOX, geom.pos, np.eye(3), geom.size) for geom in boxes])
        capsules.append([each for geom in boxes for each in fit_capsules(geom.pos, geom.size)])
    padded = _pad_capsules(capsules)
    return Objects(
        names=tuple(body.name.removeprefix(PREFIX) for body in bodies),
        first=first,
        half_size_m=half,
        parts=_pad_parts(parts),
        capsules=padded.ends,
        capsule_radius_m=padded.radius_m,
    )


def fit_capsules(centre: Points3, half_size: Points3) -> list[BoxCapsule]:
    """Return capsules that represent a box.

    The capsules are parallel to the longest edges, lie side by side along the second longest, and
    are as thick as the shortest. For boxes up to 4 cm thick, they deviate by at most 1 cm.

    Args:
        centre: (3,) centre of the box [m].
        half_size: (3,) half edge lengths of the box [m].
    """
    long, wide, thin = np.argsort(half_size)[::-1]
    radius = max(float(half_size[thin]), THINNEST_M)
    inset = max(float(half_size[wide]) - radius, 0.0)
    n = 1 + math.ceil(2 * inset / PITCH_M) if inset > 0 else 1
    capsules: list[BoxCapsule] = []
    for aside in np.linspace(-inset, inset, n) if n > 1 else [0.0]:
        ends = np.tile(np.asarray(centre, float), (2, 1))
        ends[:, wide] += aside
        ends[:, long] += np.array([-1.0, 1.0]) * max(float(half_size[long]) - radius, 0.0)
        capsules.append(BoxCapsule(ends, radius))
    return capsules


def place_parts(objects: Objects, qpos: Floats) -> Floats:
    """Return all objects' boxes (B, O * n, `shapes.WIDTH`) in the world, at qpos (B, nq)."""
    poses = objects.poses(qpos)
    kinds = np.tile(np.arange(len(objects.names)), (len(qpos), 1))
    return place_shapes(kinds, poses[..., :3], poses[..., 3:], objects.parts)


def make_object_state(objects: Objects, qpos: Floats, qvel: Floats, held: Bools) -> ObjectState:
    """Return the true state of the objects.

    Args:
        objects: the O objects.
        qpos: (B, nq) generalized positions.
        qvel: (B, nv) generalized velocities.
        held: mask (B, O) of the objects that the robot holds.
    """
    poses, n = objects.poses(qpos), len(objects.names)
    rates = qvel[:, objects.first : objects.first + RATE * n].reshape(len(qvel), n, RATE)
    places, turns = poses[..., :3].copy(), poses[..., 3:].copy()
    return ObjectState(places, turns, rates[..., :3].copy(), rates[..., 3:].copy(), held)


def find_held(objects: Objects, qpos: Floats, tool_world: Points3, hand: HandState) -> Bools:
    """Return a mask (B, O) of the objects that closed fingers hold.

    Closed fingers hold the object that contains the tool point or is within `GRIP_M` of it.

    Args:
        objects: the O objects.
        qpos: (B, nq) generalized positions.
        tool_world: (B, 3) tool points [m].
        hand: state of the grippers.
    """
    held = np.zeros((len(qpos), len(objects.names)), bool)
    _find_held(objects.poses(qpos), objects.half_size_m, tool_world, hand.closed_on, held)
    return held


def attach_objects(
    robot: RobotState, path_world: Capsules, objects: Objects, q_path: Floats, held: Bools
) -> LoadedArm:
    """Return the states and paths of robots with held objects as parts of the robots.

    Args:
        robot: state of the robots.
        path_world: (B, T, K, 2, 3) capsules of the robots along a path [m].
        objects: the O objects.
        q_path: (B, T, nq) `qpos` along the path.
        held: mask (B, O) of the objects that the robot holds.
    """
    if not objects.names:
        return LoadedArm(robot, path_world)
    batch, n_steps = q_path.shape[:2]
    loads = np.empty((batch, n_steps, *objects.capsules.shape))
    _place_loads(objects.poses(q_path), objects.capsules, held, loads)
    loads = loads.reshape(batch, n_steps, -1, 2, 3)
    radius_m = np.concatenate([robot.capsule_radius_m, objects.capsule_radius_m.ravel()])
    path_world = np.concatenate([path_world, loads], axis=2)
    carrying = replace(robot, capsules_world=path_world[:, -1], capsule_radius_m=radius_m)
    return LoadedArm(carrying, path_world)


def _is_free(body: mujoco.MjsBody) -> bool:
    return any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in body.joints)


def _pad_parts(parts: list[list[Floats]]) -> Floats:
    """Return an array (O, n, `shapes.WIDTH`) of the objects' boxes, padded with absent shapes."""
    n = max(map(len, parts), default=0)
    table = np.broadcast_to(absent_shape(), (len(parts), n, WIDTH)).copy()
    for row, boxes in zip(table, parts, strict=True):
        row[: len(boxes)] = boxes
    return table


def _pad_capsules(capsules: list[list[BoxCapsule]]) -> PaddedCapsules:
    """Return the capsules of all objects in padded arrays."""
    n = max(map(len, capsules), default=0)
    padded = PaddedCapsules(np.full((len(capsules), n, 2, 3), np.nan), np.zeros((len(capsules), n)))
    for row, of_object in enumerate(capsules):
        for k, each in enumerate(of_object):
            padded.ends[row, k], padded.radius_m[row, k] = each.ends, each.radius_m
    return padded


@kernel
def _find_held(
    poses: Floats, half_size: Points3, tool_world: Points3, closed_on: Bools, held: Bools
) -> None:
    """Mark the nearest box that contains the tool point or is within `GRIP_M` of it.

    Args:
        poses: (B, O, 7) poses of the boxes, position [m] and quaternion (w, x, y, z).
        half_size: (O, 3) half edge lengths of the boxes [m].
        tool_world: (B, 3) tool points [m].
        closed_on: mask (B,) of the environments in which the fingers have closed on an object.
        held: (B, O) output, in which the entry of the held box is set to true.
    """
    for b in range(len(poses)):
        nearest, chosen = GRIP_M, -1
        for o in range(poses.shape[1] if closed_on[b] else 0):
            pose, tool = poses[b, o], tool_world[b]
            offset = tool[0] - pose[0], tool[1] - pose[1], tool[2] - pose[2]
            x, y, z = rotate((pose[3], -pose[4], -pose[5], -pose[6]), offset)
            half = half_size[o]
            out_m = max(abs(x) - half[0], abs(y) - half[1], abs(z) - half[2])
            if out_m < nearest:
                nearest, chosen = out_m, o
        if chosen >= 0:
            held[b, chosen] = True


@kernel
def _place_loads(poses: Floats, capsules: Capsules, held: Bools, loads: Floats) -> None:
    """Compute the world capsules of held objects; move those of all other objects to `AWAY_M`.

    Args:
        poses: (B, T, O, 7) poses of the objects, position [m] and quaternion (w, x, y, z).
        capsules: (O, n, 2, 3) capsules of the objects in the body frames [m]; unused rows are NaN.
        held: mask (B, O) of the objects that the robot holds.
        loads: (B, T, O, n, 2, 3) output, which is filled [m].
    """
    for b, t, o in np.ndindex(poses.shape[:3]):
        pose = poses[b, t, o]
        for k in range(capsules.shape[1]):
            for e in range(2):
                x, y, z = AWAY_M, AWAY_M, AWAY_M
                if held[b, o] and capsules[o, k, e, 0] == capsules[o, k, e, 0]:
                    x, y, z = rotate(pose[3:], capsules[o, k, e])
                    x, y, z = x + pose[0], y + pose[1], z + pose[2]
                loads[b, t, o, k, e, 0] = x
                loads[b, t, o, k, e, 1] = y
                loads[b, t, o, k, e, 2] = z
