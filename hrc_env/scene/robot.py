"""Robots: an MJCF file and a record that says what in it the environment moves and watches.

A robot's file has the middle of its foot at the origin, looks to +x, and holds for each joint two
servos on one command [rad/s]: first all that hold its integral (`intvelocity`), then all that
follow it (`velocity`); one of them alone has 3-20 mm of tool error instead of 0.1. What is an
angle [rad] of a hinge is a way [m] of a slide, here and everywhere.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.mapping import from_mapping, read_toml
from hrc_env.core.registry import Registry
from hrc_env.core.typing import Floats, Ints, Transforms
from hrc_env.geometry.chains import SerialChain
from hrc_env.scene.primitives import (
    OBJECT_BIT,
    PAD_BIT,
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
class Hand:
    """A gripper at the end of an arm, after whose joints and motors its own come in the MJCF."""

    joints: tuple[str, ...]
    """Its fingers' slides; 0 is closed, and they open by the same way."""
    pads: tuple[str, ...]
    """The geoms that touch what is gripped."""
    motor: str
    """The `position` actuator whose command is how far each finger is from the middle [m]."""
    spans: tuple[str, ...]
    """Those of the robot's capsules that stand for the fingers, wherever they are: in distances
    and sight; they touch people only."""


@dataclass(frozen=True, slots=True)
class Suction:
    """Cups at the end of an arm: what they touch sticks to them until it is torn off."""

    site: str
    """At the middle of the cups, z away from the arm; objects have sites of that pose."""
    gauge: str
    """The `force` sensor of what hangs on them."""
    limit_n: float
    """Above this load they let go [N]."""
    pads: tuple[str, ...]
    """The geoms that touch."""
    spans: tuple[str, ...]
    """Those of the robot's capsules that stand for the cups; they touch people only."""


@dataclass(frozen=True, slots=True)
class Robot:
    """A serial arm, or a base that drives; names are those of its MJCF."""

    name: str
    """By which `robot=` knows it."""
    mjcf: str | Path
    """Its file's path, or the text itself."""
    joints: tuple[str, ...]
    """Its N hinges and slides, from the foot to the tool."""
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
    hand: Hand | None = None
    suction: Suction | None = None
    """What it grips with: fingers, or cups; None: nothing."""
    drives: bool = False
    """Whether it moves about on the floor, its foot the world's origin; else its foot is on the
    scene's pedestal."""
    girth_m: float = 0.0
    """Of one that drives: how far it reaches to any side of the far ends of `watched` [m]; people
    look out for all of it, from the floor upwards."""
    slew: tuple[float, ...] = ()
    """Fastest change of each joint's commanded velocity [rad/s^2]; none: `SceneConfig.slew_rad_s2`
    for all."""

    @property
    def grips(self) -> bool:
        """Whether it can hold something."""
        return bool(self.hand or self.suction)

    def __post_init__(self) -> None:
        if self.hand and self.suction:
            raise ConfigError(f"{self.name} has a hand and suction: give one of them.")
        for name in ("home_q", "spread_rad", "slew"):
            values = getattr(self, name)
            if name == "slew" and not values:
                continue
            if len(values) != len(self.joints) or not np.isfinite(values).all():
                raise ConfigError(
                    f"{self.name}: {name} must be {len(self.joints)} angles [rad], of slides "
                    f"ways [m], got {values}."
                )


@dataclass(frozen=True, slots=True, eq=False)
class Grip:
    """A hand's numbers."""

    fingers: Ints
    """Columns of its fingers in `qpos` and `qvel`."""
    open_m: float
    """How far each finger is from the middle at most [m]."""
    stiffness_n_m: float
    damping_n_s_m: float
    most_n: float
    """Of its motor: force for a way, for a speed, and at most."""


def _read(path: Path) -> Robot:
    """A robot that comes with the package: a record in TOML beside its MJCF."""
    own = {"name": path.stem, "mjcf": str(path.with_suffix(".xml"))}
    return from_mapping(Robot, read_toml(path) | own)


ROBOTS: Registry[Robot] = Registry(
    "robot", {path.stem: _read(path) for path in sorted((assets_dir() / "robots").glob("*.toml"))}
)
"""By name: those in `assets/robots`, and those that were registered."""


def robot_called(robot: str | Robot | Mapping[str, Any]) -> Robot:
    """A robot by its name, its fields, or itself; `ConfigError` for a name that there is not."""
    if isinstance(robot, Mapping):
        return from_mapping(Robot, robot, "robot.")
    if isinstance(robot, Robot):
        return robot
    if not isinstance(robot, str):
        raise ConfigError(
            f"robot must be a name, a Robot or a mapping of its fields, got {robot!r}."
        )
    check_names("robot", [robot], ROBOTS)
    return ROBOTS[robot]


def add_robot(spec: Any, robot: Robot, mount_world: Sequence[float]) -> None:
    """Put a robot into a scene that is being built, its foot at a point [m]."""
    child, hand = _parsed(robot), robot.hand or robot.suction
    pads, spans = (hand.pads, hand.spans) if hand else ((), ())
    for geom in child.geoms:
        if geom.name in robot.capsules:
            geom.group, geom.contype = ROBOT_CAPSULES, ROBOT_BIT
            things = 0 if geom.name in spans else SCENE_BIT | OBJECT_BIT
            geom.conaffinity = WORKER_BIT | things
        elif geom.name in pads:
            geom.group, geom.contype = ROBOT_CAPSULES, PAD_BIT
            geom.conaffinity = SCENE_BIT | OBJECT_BIT
        else:
            geom.group, geom.contype, geom.conaffinity = ROBOT_LOOKS, 0, 0
    spec.attach(child, prefix=PREFIX, frame=spec.worldbody.add_frame(pos=list(mount_world)))


@lru_cache(maxsize=8)
def chain_of(robot: Robot, mount_world: tuple[float, float, float]) -> SerialChain:
    """A robot's numbers as a chain of joints. Raises `ConfigError` where something that `Robot`
    names is missing in the MJCF or of another kind."""
    try:
        return _chain(robot, mount_world)
    except ConfigError as error:
        raise ConfigError(f"{robot.name}: {error}") from error
    except ValueError as error:
        raise ConfigError(f"{robot.name}: its MJCF cannot be used: {error}") from error


def reach_m(chain: SerialChain) -> Floats:
    """(K,) no point of a capsule is ever farther from the robot's foot than this [m]."""
    ways = np.where(chain.slides, np.abs(chain.range_rad).max(-1), 0.0)
    before = np.cumsum(np.linalg.norm(chain.parent_from_joint[:, :3, 3], axis=-1) + ways)
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
    check_names(f"watched capsule of {robot.name}", robot.watched, robot.capsules)
    if grips := robot.hand or robot.suction:
        check_names(f"capsule for the hand of {robot.name}", grips.spans, robot.capsules)
    low, high = chain.range_rad.T
    if ((robot.home_q < low) | (robot.home_q > high)).any():
        raise ConfigError(f"{robot.name}: home_q {robot.home_q} is outside of the joints' ranges.")
    for body in _parsed(robot).bodies[1:]:
        if body.joints and not body.explicitinertial:
            raise ConfigError(f"{robot.name}: link {body.name!r} needs an <inertial>.")


def grip_of(robot: Robot, model: mujoco.MjModel) -> Grip | None:
    """The numbers of a robot's hand in a scene; None: it has none."""
    if robot.hand is None:
        return None
    fingers = [model.joint(PREFIX + name).qposadr[0] for name in robot.hand.joints]
    motor = model.actuator(PREFIX + robot.hand.motor)
    return Grip(
        np.array(fingers), float(motor.ctrlrange[1]), float(motor.gainprm[0]),
        float(-motor.biasprm[2]), float(motor.forcerange[1]),
    )  # fmt: skip


def _parsed(robot: Robot) -> Any:
    text = str(robot.mjcf)
    read = mujoco.MjSpec.from_string if text.lstrip().startswith("<") else mujoco.MjSpec.from_file
    return read(text)


def _chain(robot: Robot, mount_world: tuple[float, float, float]) -> SerialChain:
    model, n = _parsed(robot).compile(), len(robot.joints)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)  # all joints at 0
    joints = [_id(model, "joint", name) for name in robot.joints]
    _check_servos(model, joints, robot.hand)
    bodies = model.jnt_bodyid[joints].tolist()
    parents = model.body_parentid[bodies].tolist()
    if [_link(model, bodies, parent) for parent in parents] != list(range(-1, n - 1)):
        raise ConfigError("its joints must be a single chain.")
    site = _id(model, "site", robot.tool_site)
    if _link(model, bodies, model.site_bodyid[site]) != n - 1:
        raise ConfigError(f"site {robot.tool_site!r} must be on the last link.")
    foot = _pose(data.xpos[parents[0]], data.xmat[parents[0]])
    links = np.stack([_joint_frame(model, data, joint) for joint in joints])
    carriers, ends, radius_m = _capsules(model, data, bodies, links, robot)
    return SerialChain(
        T_world_from_base=_pose(mount_world, np.eye(3)) @ foot,
        parent_from_joint=np.linalg.inv([foot, *links[:-1]]) @ links,
        link_from_tool=np.linalg.inv(links[-1]) @ _pose(data.site_xpos[site], data.site_xmat[site]),
        range_rad=model.jnt_range[joints],
        velocity_limit_rad_s=model.actuator_ctrlrange[n : 2 * n, 1].copy(),
        slides=model.jnt_type[joints] == mujoco.mjtJoint.mjJNT_SLIDE,
        capsule_link=carriers,
        capsule_ends=ends,
        capsule_radius_m=radius_m,
    )


def _id(model: mujoco.MjModel, kind: str, name: str) -> int:
    number = mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name)
    if number < 0:
        raise ConfigError(f"its MJCF has no {kind} {name!r}.")
    return number


def _check_servos(model: mujoco.MjModel, joints: list[int], hand: Hand | None) -> None:
    """Only hinges and slides with ranges, and their servos in order; then the hand's slides and
    motor."""
    n, fingers = len(joints), [_id(model, "joint", each) for each in hand.joints] if hand else []
    kinds = {mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE}
    own = kinds.issuperset(model.jnt_type[:n].tolist()) and model.jnt_limited.all()
    slides = (model.jnt_type[n:] == mujoco.mjtJoint.mjJNT_SLIDE).all()
    if joints + fingers != list(range(model.njnt)) or not (own and slides):
        raise ConfigError(
            "joints must be all of its MJCF, in its order: hinges and slides with a range; then "
            "its hand's: slides with a range."
        )
    motors = [_id(model, "actuator", hand.motor)] if hand else []
    integrates = model.actuator_dyntype == mujoco.mjtDyn.mjDYN_INTEGRATOR
    if not (
        model.actuator_trnid[: 2 * n, 0].tolist() == 2 * joints
        and integrates.tolist() == [True] * n + [False] * (n + len(motors))
        and motors == list(range(2 * n, model.nu))
        and model.actuator_ctrllimited.all()
    ):
        raise ConfigError(
            "needs an <intvelocity> for every joint in order, then a <velocity> for every joint, "
            "each with a ctrlrange [rad/s, of slides m/s]; then its hand's <position> with one [m]."
        )


def _link(model: mujoco.MjModel, bodies: list[int], body: int) -> int:
    """Which of the links, whose bodies are given, carries a body; -1: none."""
    while body and body not in bodies:
        body = model.body_parentid[body]
    return bodies.index(body) if body in bodies else -1


def _pose(pos: Any, rotation: Floats) -> Transforms:
    """(4, 4) of a place (3,) and a rotation of 9 numbers."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation.reshape(3, 3), pos
    return T


def _joint_frame(model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> Transforms:
    """(4, 4) in the world: z is the axis."""
    quaternion, turn = np.zeros(4), np.zeros(9)
    mujoco.mju_quatZ2Vec(quaternion, model.jnt_axis[joint])
    mujoco.mju_quat2Mat(turn, quaternion)
    body = data.xmat[model.jnt_bodyid[joint]].reshape(3, 3)
    return _pose(data.xanchor[joint], body @ turn.reshape(3, 3))


def _capsules(
    model: mujoco.MjModel, data: mujoco.MjData, bodies: list[int], links: Transforms, robot: Robot
) -> tuple[Ints, Floats, Floats]:
    """Links (K,), ends (K, 2, 3) and radii (K,) of the capsules."""
    geoms = [_id(model, "geom", name) for name in robot.capsules]
    carriers = [_link(model, bodies, model.geom_bodyid[geom]) for geom in geoms]
    ends = np.empty((len(geoms), 2, 3))
    for k, (name, geom, link) in enumerate(zip(robot.capsules, geoms, carriers, strict=True)):
        if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_CAPSULE:
            raise ConfigError(f"geom {name!r} must be a capsule.")
        if link < 0:
            raise ConfigError(f"geom {name!r} is on no link.")
        T = np.linalg.inv(links[link]) @ _pose(data.geom_xpos[geom], data.geom_xmat[geom])
        along = T[:3, 2] * model.geom_size[geom, 1]
        ends[k] = T[:3, 3] - along, T[:3, 3] + along
    # As the MJCF's quaternions are rounded.
    return np.array(carriers), np.round(ends, 12), model.geom_size[geoms, 0].copy()
