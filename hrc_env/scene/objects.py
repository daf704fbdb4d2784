"""A task's loose objects: bodies of boxes with a free joint in the MJCF that the task adds.

Free joints follow the robot's own in `qpos`, seven numbers each: place [m] and quaternion.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

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
"""What the names of a task's parts begin with in a scene."""
POSE, RATE = 7, 6
"""Numbers that say where an object is, and how it moves."""
PITCH_M, THINNEST_M = 0.10, 0.019
"""A carried box counts as capsules: so far apart at most, so thick at least [m]."""
AWAY_M = 1e4
"""Where the capsules are of what is not carried [m]."""
GRIP_M = 0.01
"""What the fingers hold has the tool point inside, or so near [m]."""


def add_task_scene(spec: Any, task_scene: TaskScene, foot_world: Sequence[float]) -> None:
    """Put them into a scene that is being built. Grips slip least with elliptic cones (5 kg shaken
    at 3 m/s^2: 8 mm in 6 s; with MuJoCo's defaults 31)."""
    if task_scene.mjcf:
        spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 10.0
        child = mujoco.MjSpec.from_string(task_scene.mjcf)
        for geom in (each for body in child.bodies if _is_free(body) for each in body.geoms):
            geom.group = DECORATION  # what is solid stands still
        frame = spec.worldbody.add_frame(pos=list(foot_world))
        spec.attach(child, prefix=PREFIX, frame=frame)


def add_welds(spec: Any, task_scene: TaskScene) -> None:
    """Its welds, when all sites are there."""
    kinds = {True: mujoco.mjtEq.mjEQ_WELD, False: mujoco.mjtEq.mjEQ_CONNECT}
    for weld in task_scene.welds:
        one, other = weld.sites
        spec.add_equality(
            type=kinds[weld.turns], objtype=mujoco.mjtObj.mjOBJ_SITE, name=weld.name, name1=one,
            name2=other, solref=list(weld.solref), active=False,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Objects:
    """What is loose in a scene, in the objects' own frames; O of them."""

    names: tuple[str, ...]
    first: int
    """Where they begin in `qpos` and `qvel`, after the robot's joints."""
    half_size_m: Points3
    """(O, 3) half edges of the box round each, whose middle is the object's origin [m]."""
    parts: Floats
    """(O, n, `shapes.WIDTH`) the boxes of each; rows that are left over are absent."""
    capsules: Capsules
    """(O, n, 2, 3) the same as capsules, [m]; not a number: left over."""
    capsule_radius_m: Floats
    """(O, n) [m]."""

    def poses(self, qpos: Floats) -> Floats:
        """(..., O, 7) place and quaternion of each, of qpos (..., nq)."""
        own = qpos[..., self.first : self.first + POSE * len(self.names)]
        return own.reshape(*qpos.shape[:-1], len(self.names), POSE)


def objects_of(spec: Any, first: int) -> Objects:
    """The free bodies of a scene, after `first` joints of the robot. Raises `ConfigError` for one
    that holds anything but boxes, or whose boxes' middle is not its origin."""
    bodies = [body for body in spec.bodies if _is_free(body)]
    boxes = [[geom for geom in body.geoms if geom.contype & OBJECT_BIT] for body in bodies]
    half, parts, rods = np.zeros((len(bodies), 3)), [], []
    for row, (body, own) in enumerate(zip(bodies, boxes, strict=True)):
        if not own or any(geom.type != mujoco.mjtGeom.mjGEOM_BOX for geom in own):
            raise ConfigError(f"Object {body.name!r} must be of boxes with contype {OBJECT_BIT}.")
        low = np.min([geom.pos - geom.size for geom in own], axis=0)
        high = np.max([geom.pos + geom.size for geom in own], axis=0)
        if np.abs(low + high).max() > 1e-6:
            raise ConfigError(f"Object {body.name!r} must have its middle at its origin.")
        half[row] = high
        parts.append([shape(BOX, geom.pos, np.eye(3), geom.size) for geom in own])
        rods.append([rod for geom in own for rod in box_capsules(geom.pos, geom.size)])
    ends, radius_m = _padded(rods)
    return Objects(
        tuple(body.name.removeprefix(PREFIX) for body in bodies), first, half, _filled(parts),
        ends, radius_m,
    )  # fmt: skip


def box_capsules(centre: Points3, half_size: Points3) -> list[tuple[Capsules, float]]:
    """Capsules (2, 3) with radii that stand for a box: along its longest edges, side by side along
    the second, as thick as the third; nowhere off by more than 1 cm for boxes up to 4 cm thick."""
    long, wide, thin = np.argsort(half_size)[::-1]
    radius = max(float(half_size[thin]), THINNEST_M)
    inset = max(float(half_size[wide]) - radius, 0.0)
    n = 1 + math.ceil(2 * inset / PITCH_M) if inset > 0 else 1
    rods = []
    for aside in np.linspace(-inset, inset, n) if n > 1 else [0.0]:
        ends = np.tile(np.asarray(centre, float), (2, 1))
        ends[:, wide] += aside
        ends[:, long] += np.array([-1.0, 1.0]) * max(float(half_size[long]) - radius, 0.0)
        rods.append((ends, radius))
    return rods


def surfaces(objects: Objects, qpos: Floats) -> Floats:
    """(B, O * n, `shapes.WIDTH`) the boxes of all objects where they are, of qpos (B, nq)."""
    poses = objects.poses(qpos)
    kinds = np.tile(np.arange(len(objects.names)), (len(qpos), 1))
    return place_shapes(kinds, poses[..., :3], poses[..., 3:], objects.parts)


def object_state(objects: Objects, qpos: Floats, qvel: Floats, held: Bools) -> ObjectState:
    """Where objects are, of qpos (B, nq) and qvel (B, nv)."""
    poses, n = objects.poses(qpos), len(objects.names)
    rates = qvel[:, objects.first : objects.first + RATE * n].reshape(len(qvel), n, RATE)
    places, turns = poses[..., :3].copy(), poses[..., 3:].copy()
    return ObjectState(places, turns, rates[..., :3].copy(), rates[..., 3:].copy(), held)


def held_by(objects: Objects, qpos: Floats, tool_world: Points3, hand: HandState) -> Bools:
    """(B, O) what closed fingers hold: that in which, or nearly, the tool point (B, 3) is."""
    held = np.zeros((len(qpos), len(objects.names)), bool)
    _holding(objects.poses(qpos), objects.half_size_m, tool_world, hand.closed_on, held)
    return held


def with_load(
    robot: RobotState, path_world: Capsules, objects: Objects, q_path: Floats, held: Bools
) -> tuple[RobotState, Capsules]:
    """A robot with what it holds as part of it, now and along paths of capsules (B, T, K, 2, 3)
    where qpos is q_path (B, T, nq)."""
    if not objects.names:
        return robot, path_world
    batch, n_steps = q_path.shape[:2]
    loads = np.empty((batch, n_steps, *objects.capsules.shape))
    _carry(objects.poses(q_path), objects.capsules, held, loads)
    loads = loads.reshape(batch, n_steps, -1, 2, 3)
    radius_m = np.concatenate([robot.capsule_radius_m, objects.capsule_radius_m.ravel()])
    path_world = np.concatenate([path_world, loads], axis=2)
    carrying = replace(robot, capsules_world=path_world[:, -1], capsule_radius_m=radius_m)
    return carrying, path_world


def _is_free(body: Any) -> bool:
    return any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in body.joints)


def _filled(parts: list[list[Floats]]) -> Floats:
    """(O, n, `shapes.WIDTH`) with rows that are absent where an object has fewer."""
    n = max(map(len, parts), default=0)
    table = np.broadcast_to(absent_shape(), (len(parts), n, WIDTH)).copy()
    for row, own in zip(table, parts, strict=True):
        row[: len(own)] = own
    return table


def _padded(rods: list[list[tuple[Capsules, float]]]) -> tuple[Capsules, Floats]:
    n = max(map(len, rods), default=0)
    ends, radius_m = np.full((len(rods), n, 2, 3), np.nan), np.zeros((len(rods), n))
    for row, own in enumerate(rods):
        for k, (pair, radius) in enumerate(own):
            ends[row, k], radius_m[row, k] = pair, radius
    return ends, radius_m


@kernel
def _holding(poses, half_size, tool_world, closed_on, held):
    """The nearest box that the tool point is in, or nearly."""
    for b in range(len(poses)):
        nearest, chosen = GRIP_M, -1
        for o in range(poses.shape[1] if closed_on[b] else 0):
            at, tool = poses[b, o], tool_world[b]
            away = tool[0] - at[0], tool[1] - at[1], tool[2] - at[2]
            x, y, z = rotate((at[3], -at[4], -at[5], -at[6]), away)
            half = half_size[o]
            out_m = max(abs(x) - half[0], abs(y) - half[1], abs(z) - half[2])
            if out_m < nearest:
                nearest, chosen = out_m, o
        if chosen >= 0:
            held[b, chosen] = True


@kernel
def _carry(poses, capsules, held, loads):
    """Capsules where they are carried; far away where they are not, or there is none."""
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
