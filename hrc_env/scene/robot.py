"""Robots: an MJCF file and a record that says what in it the environment moves and watches.

A robot's file has the middle of its foot at the origin, looks to +x, and holds for each joint two
servos on one command [rad/s], first all that hold the command's integral (`intvelocity`), then all
that follow the command itself (`velocity`). Measured against one servo of either kind: 0.1 mm of
tool error instead of 3-20, no sag under load. Links have explicit inertials.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.typing import Floats, Transforms
from hrc_env.geometry.chains import SerialChain
from hrc_env.scene.primitives import (
    OBJECT_BIT,
    ROBOT_BIT,
    ROBOT_CAPSULES,
    ROBOT_LOOKS,
    SCENE_BIT,
    WORKER_BIT,
)
from hrc_env.worker.body import assets_dir

PREFIX = "robot/"
"""What the names of a robot's parts begin with in a scene."""
DEFAULT = "ur10e_like"


@dataclass(frozen=True, slots=True)
class Robot:
    """A serial arm; names are those of its MJCF."""

    name: str
    """By which `robot=` knows it."""
    mjcf: str | Path
    """Its file's path, or the text itself."""
    joints: tuple[str, ...]
    """Its N hinges, from the foot to the tool."""
    capsules: tuple[str, ...]
    """The capsule geoms that stand for its surface: in contacts, distances and sight."""
    watched: tuple[str, ...]
    """Those of them whose far ends workers keep an eye on."""
    tool_site: str
    """The site at the tool point."""
    home_q: tuple[float, ...]
    """The pose at rest, one angle a joint [rad]."""
    spread_rad: tuple[float, ...]
    """At reset each joint is drawn within so much of `home_q`."""
    never_touch: tuple[tuple[str, str], ...] = ()
    """(capsule, geom of a scene) that no pose brings together, near as they may always be."""

    def __post_init__(self) -> None:
        for name in ("home_q", "spread_rad"):
            values = getattr(self, name)
            if len(values) != len(self.joints) or not np.isfinite(values).all():
                raise ConfigError(
                    f"{self.name}: {name} must be {len(self.joints)} angles [rad], got {values}."
                )


ROBOTS: dict[str, Robot] = {
    DEFAULT: Robot(
        name=DEFAULT,
        mjcf=assets_dir() / "robots" / "ur10e_like.xml",
        joints=("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"),
        capsules=(
            "shoulder", "shoulder_lift", "upper_arm", "elbow", "forearm", "wrist_1", "wrist_2",
            "wrist_3", "tool",
        ),
        watched=("elbow", "tool"),
        tool_site="tool_point",
        home_q=(0.0, -1.9, 2.1, -1.77, -np.pi / 2, 0.0),
        spread_rad=(1.3, 0.15, 0.15, 0.15, 0.15, 0.15),
        never_touch=(
            ("shoulder", "pedestal_column"), ("shoulder", "pedestal_head"),
            ("shoulder_lift", "pedestal_column"), ("shoulder_lift", "pedestal_head"),
            ("upper_arm", "pedestal_foot"), ("elbow", "pedestal_foot"),
            ("elbow", "pedestal_head"),
        ),
    )
}  # fmt: skip
"""By name: the one that comes with the package, and those that were registered."""


def robot_called(robot: str | Robot) -> Robot:
    """A robot by its name, or itself.

    Raises:
        ConfigError: a name that there is not, or no robot.
    """
    if isinstance(robot, Robot):
        return robot
    if not isinstance(robot, str):
        raise ConfigError(f"robot must be a name or a Robot, got {robot!r}.")
    if robot not in ROBOTS:
        raise unknown("robot", robot, ROBOTS)
    return ROBOTS[robot]


def add_robot(spec: Any, robot: Robot, mount_world: Sequence[float]) -> None:
    """Put a robot into a scene that is being built, its foot at a point [m]."""
    child = _parsed(robot)
    for geom in child.geoms:
        if geom.name in robot.capsules:
            geom.group, geom.contype = ROBOT_CAPSULES, ROBOT_BIT
            geom.conaffinity = SCENE_BIT | WORKER_BIT | OBJECT_BIT
        else:
            geom.group, geom.contype, geom.conaffinity = ROBOT_LOOKS, 0, 0
    spec.attach(child, prefix=PREFIX, frame=spec.worldbody.add_frame(pos=list(mount_world)))


@lru_cache(maxsize=8)
def chain_of(robot: Robot, mount_world: tuple[float, float, float]) -> SerialChain:
    """A robot's numbers as a chain of hinges.

    Raises:
        ConfigError: something that `Robot` names is missing in the MJCF or of another kind.
    """
    model = _compiled(robot)
    joints = [_id(robot, model, "joint", name) for name in robot.joints]
    bodies, n = model.jnt_bodyid[joints], len(joints)
    _check_servos(robot, model, joints)
    turned = [_joint_frame(model, joint) for joint in joints]
    fixed = np.zeros((n, 4, 4))
    foot = int(model.body_parentid[bodies[0]])
    for i, (body, frame) in enumerate(zip(bodies, turned, strict=True)):
        before = np.linalg.inv(turned[i - 1]) if i else np.eye(4)
        fixed[i] = before @ _between(robot, model, bodies[i - 1] if i else foot, body) @ frame
    at = np.eye(4)
    at[:3, 3] = mount_world
    on, tool = _carried(robot, model, bodies, turned, "site", robot.tool_site)
    if on != n - 1:
        raise ConfigError(f"{robot.name}: site {robot.tool_site!r} must be on the last link.")
    links, ends, radius_m = _capsules(robot, model, bodies, turned)
    return SerialChain(
        joint_names=robot.joints,
        T_world_from_base=at @ _between(robot, model, 0, foot),
        parent_from_joint=fixed,
        link_from_tool=tool,
        range_rad=model.jnt_range[joints],
        velocity_limit_rad_s=model.actuator_ctrlrange[n:, 1].copy(),
        capsule_names=robot.capsules,
        capsule_link=links,
        capsule_ends=ends,
        capsule_radius_m=radius_m,
    )


def reach_m(chain: SerialChain) -> Floats:
    """(K,) no point of a capsule is ever farther from the robot's foot than this [m]."""
    before = np.cumsum(np.linalg.norm(chain.parent_from_joint[:, :3, 3], axis=-1))
    own = np.linalg.norm(chain.capsule_ends, axis=-1).max(-1)
    return before[chain.capsule_link] + own + chain.capsule_radius_m


def servo_lead_s(robot: Robot, model: mujoco.MjModel) -> Floats:
    """(N,) inertia at rest over damping: by how much the rate servos run ahead [s]."""
    data, n = mujoco.MjData(model), len(robot.joints)
    data.qpos[:n] = robot.home_q
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    return np.diag(inertia)[:n] / model.actuator_gainprm[n : 2 * n, 0]


def check_robot(robot: Robot) -> None:
    """Raise `ConfigError` for what is missing or wrong in a robot."""
    if not isinstance(robot, Robot):
        raise ConfigError(f"A robot must be a Robot, got {type(robot).__name__}.")
    chain = chain_of(robot, (0.0, 0.0, 0.0))
    for name in robot.watched:
        if name not in robot.capsules:
            raise unknown(f"watched capsule of {robot.name}", name, robot.capsules)
    low, high = chain.range_rad.T
    if ((robot.home_q < low) | (robot.home_q > high)).any():
        raise ConfigError(f"{robot.name}: home_q {robot.home_q} is outside of the joints' ranges.")
    for body in _parsed(robot).bodies[1:]:
        if body.joints and not body.explicitinertial:
            raise ConfigError(f"{robot.name}: link {body.name!r} needs an <inertial>.")


def _parsed(robot: Robot) -> Any:
    text = str(robot.mjcf)
    try:
        if text.lstrip().startswith("<"):
            return mujoco.MjSpec.from_string(text)
        return mujoco.MjSpec.from_file(text)
    except ValueError as error:
        raise ConfigError(f"{robot.name}: its MJCF cannot be read: {error}") from error


def _compiled(robot: Robot) -> mujoco.MjModel:
    try:
        return _parsed(robot).compile()
    except ValueError as error:
        raise ConfigError(f"{robot.name}: its MJCF cannot be compiled: {error}") from error


def _id(robot: Robot, model: mujoco.MjModel, kind: str, name: str) -> int:
    number = mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name)
    if number < 0:
        raise ConfigError(f"{robot.name}: its MJCF has no {kind} {name!r}.")
    return number


def _check_servos(robot: Robot, model: mujoco.MjModel, joints: list[int]) -> None:
    """Only hinges with ranges, and their servos in order."""
    hinge, n = mujoco.mjtJoint.mjJNT_HINGE, len(joints)
    if joints != list(range(model.njnt)) or (model.jnt_type != hinge).any():
        raise ConfigError(f"{robot.name}: joints must be all of its MJCF, hinges, in its order.")
    if not model.jnt_limited.all():
        raise ConfigError(f"{robot.name}: every joint needs a range.")
    servos = np.tile(joints, 2)
    integrates = model.actuator_dyntype == mujoco.mjtDyn.mjDYN_INTEGRATOR
    if not (
        np.array_equal(model.actuator_trnid[:, 0], servos)
        and np.array_equal(integrates, np.arange(2 * n) < n)
        and model.actuator_ctrllimited.all()
    ):
        raise ConfigError(
            f"{robot.name}: needs an <intvelocity> for every joint in order, then a <velocity> for "
            "every joint, each with a ctrlrange [rad/s]."
        )


def _joint_frame(model: mujoco.MjModel, joint: int) -> Transforms:
    """(4, 4) in its body's frame: z is the axis."""
    quaternion = np.zeros(4)
    mujoco.mju_quatZ2Vec(quaternion, model.jnt_axis[joint])
    return _transform(model.jnt_pos[joint], quaternion)


def _transform(pos: Floats, quaternion_wxyz: Floats) -> Transforms:
    """(4, 4); by the angle, whose cosine is then as exact as the MJCF's numbers are."""
    sine, T = np.linalg.norm(quaternion_wxyz[1:]), np.eye(4)
    angle = 2 * np.arctan2(sine, quaternion_wxyz[0])
    axis = quaternion_wxyz[1:] / sine if sine else np.zeros(3)
    c, s = np.cos(angle), np.sin(angle)
    T[:3, :3] = c * np.eye(3) + s * np.cross(np.eye(3), axis) + (1 - c) * np.outer(axis, axis)
    T[:3, 3] = pos
    return T


def _between(robot: Robot, model: mujoco.MjModel, above: int, body: int) -> Transforms:
    """(4, 4) a body's frame in that of one above it, all joints at 0."""
    T = np.eye(4)
    while body != above:
        if body == 0:
            raise ConfigError(f"{robot.name}: its joints must be a single chain.")
        T = _transform(model.body_pos[body], model.body_quat[body]) @ T
        body = model.body_parentid[body]
    return T


def _carried(
    robot: Robot,
    model: mujoco.MjModel,
    bodies: Floats,
    turned: list[Transforms],
    kind: str,
    name: str,
) -> tuple[int, Transforms]:
    """The link that carries a geom or a site, and (4, 4) its frame there."""
    number = _id(robot, model, kind, name)
    carrier = own = getattr(model, f"{kind}_bodyid")[number]
    while own not in bodies:
        if own == 0:
            raise ConfigError(f"{robot.name}: {kind} {name!r} is on no link.")
        own = model.body_parentid[own]
    link = int(np.flatnonzero(bodies == own)[0])
    pos, quat = getattr(model, f"{kind}_pos")[number], getattr(model, f"{kind}_quat")[number]
    inside = _between(robot, model, own, carrier) @ _transform(pos, quat)
    return link, np.linalg.inv(turned[link]) @ inside


def _capsules(
    robot: Robot, model: mujoco.MjModel, bodies: Floats, turned: list[Transforms]
) -> tuple[Any, Floats, Floats]:
    """Links (K,), ends (K, 2, 3) and radii (K,) of the capsules."""
    links, ends, radii_m = [], [], []
    for name in robot.capsules:
        geom = model.geom(_id(robot, model, "geom", name))
        if geom.type[0] != mujoco.mjtGeom.mjGEOM_CAPSULE:
            raise ConfigError(f"{robot.name}: geom {name!r} must be a capsule.")
        link, T = _carried(robot, model, bodies, turned, "geom", name)
        along = T[:3, 2] * geom.size[1]
        links.append(link)
        ends.append((T[:3, 3] - along, T[:3, 3] + along))
        radii_m.append(geom.size[0])
    rounded = np.round(np.array(ends, float), 12)  # as the quaternions are
    return np.array(links), rounded, np.array(radii_m)
