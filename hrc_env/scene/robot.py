"""Robots, each of which consists of an MJCF file and a record of names of its elements.

In its file, a robot has the centre of its base at the origin, faces +x, and has two servos for each
joint with a common command [rad/s]: first the servos of all joints that hold the integral of the
command (`intvelocity`), then those that follow it (`velocity`). One servo alone results in a tool
error of 3-20 mm instead of 0.1 mm. Throughout the package, values in [rad] for a hinge are in [m]
for a slide.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

import mujoco
import numpy as np

from hrc_env.core.brought import check_kind
from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.mapping import answer_unknown_fields, from_mapping, read_toml
from hrc_env.core.registry import Registry
from hrc_env.core.typing import Floats, Ints
from hrc_env.scene.primitives import (
    OBJECT_BIT,
    PAD_BIT,
    ROBOT_BIT,
    ROBOT_CAPSULES,
    ROBOT_LOOKS,
    SCENE_BIT,
    WORKER_BIT,
)
from hrc_env.scene.robot_chain import make_chain, parse_mjcf
from hrc_env.scene.robot_looks import bare_capsules
from hrc_env.worker.body import assets_dir

PREFIX = "robot/"
"""Prefix of the names of a robot's parts in a scene."""
DEFAULT = "ur10e_like"
"""Name of the default robot."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Hand:
    """Gripper at the end of an arm. In the MJCF, its joints and motor follow those of the arm."""

    joints: tuple[str, ...]
    """Names of the slides of the fingers. At 0 the gripper is closed; all fingers open by the same
    distance."""
    pads: tuple[str, ...]
    """Names of the geoms that touch a gripped object."""
    motor: str
    """Name of the `position` actuator that commands the distance of each finger from the centre
    [m]."""
    spans: tuple[str, ...]
    """Names of the capsules that enclose the fingers in any position, for distances and occlusion;
    they collide only with people."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Suction:
    """Suction cups at the end of an arm, which hold objects until they are vented or overloaded."""

    site: str
    """Name of the site at the centre of the cups with z pointing away from the arm; objects have
    matching sites."""
    gauge: str
    """Name of the `force` sensor that measures the load on the cups."""
    limit_n: float
    """Load above which the cups lose an object [N]."""
    pads: tuple[str, ...]
    """Names of the geoms that touch an object."""
    spans: tuple[str, ...]
    """Names of the capsules that enclose the cups; they collide only with people."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Robot:
    """A serial arm or a mobile base; all names refer to elements of its MJCF."""

    RENAMED: ClassVar[Mapping[str, str]] = {
        "watched": "watched_capsules",
        "girth_m": "base_radius_m",
    }
    """Current names of renamed fields, by former name."""

    name: str
    """Name of the robot, as used in `robot=`."""
    mjcf: str | Path
    """Path of the MJCF file, or its text."""
    joints: tuple[str, ...]
    """Names of the N joints (hinges and slides), in order from the base to the tool."""
    capsules: tuple[str, ...]
    """Names of the capsule geoms that represent the surface in contacts, distances and
    occlusion."""
    watched_capsules: tuple[str, ...]
    """Names of the capsules with distal ends that workers watch."""
    tool_site: str
    """Name of the site at the tool point."""
    home_q: tuple[float, ...]
    """Home pose, with one angle for each joint [rad]."""
    spread_rad: tuple[float, ...]
    """Largest deviation of each joint from `home_q` at a reset [rad]."""
    never_touch: tuple[tuple[str, str], ...] = ()
    """Pairs (capsule, geom of a scene) that are close in every pose; collisions between them are
    disabled."""
    hand: Hand | None = None
    """Gripper of the robot; None for a robot without a gripper."""
    suction: Suction | None = None
    """Suction cups of the robot; None for a robot without suction cups."""
    drives: bool = False
    """Whether the robot drives on the floor; its base frame is then at the world's origin, and
    otherwise on the scene's pedestal."""
    base_radius_m: float = 0.0
    """Radius of a mobile base around the distal ends of `watched_capsules` [m]; people keep out of
    this vertical cylinder."""
    slew: tuple[float, ...] = ()
    """Limit on the rate of change of each joint's commanded velocity [rad/s^2]; empty for
    `SceneConfig.slew_rad_s2` at every joint."""

    @property
    def grips(self) -> bool:
        """Whether the robot can hold an object."""
        return bool(self.hand or self.suction)

    def __post_init__(self) -> None:
        check_kind(f"{self.name}: hand", self.hand, Hand, None)
        check_kind(f"{self.name}: suction", self.suction, Suction, None)
        if self.hand and self.suction:
            raise ConfigError(f"{self.name} has a hand and suction: choose one of them.")
        for name in ("home_q", "spread_rad", "slew"):
            values = getattr(self, name)
            if name == "slew" and not values:
                continue
            if len(values) != len(self.joints) or not np.isfinite(values).all():
                raise ConfigError(
                    f"{self.name}: {name} must be {len(self.joints)} angles [rad] or, for "
                    f"prismatic joints, positions [m], got {values}."
                )


@dataclass(frozen=True, slots=True, eq=False)
class Grip:
    """Indices and motor of a hand in a compiled scene."""

    fingers: Ints
    """Indices of the fingers in `qpos` and `qvel`."""
    open_m: float
    """Maximum distance of each finger from the centre [m]."""
    stiffness_n_m: float
    """Stiffness of the motor [N/m]."""
    damping_n_s_m: float
    """Damping of the motor [N s/m]."""
    most_n: float
    """Maximum force of the motor [N]."""


def _read_robot(path: Path) -> Robot:
    """Read a built-in robot from the TOML file beside its MJCF."""
    names = {"name": path.stem, "mjcf": str(path.with_suffix(".xml"))}
    return from_mapping(Robot, read_toml(path) | names)


ROBOTS: Registry[Robot] = Registry(
    "robot",
    {path.stem: _read_robot(path) for path in sorted((assets_dir() / "robots").glob("*.toml"))},
)
"""Robots by name: the built-in robots in `assets/robots`, and registered robots."""
BUILT_IN = frozenset(ROBOTS.data.values())
"""Robots in `assets/robots`. None of their capsules extends beyond the visual geoms by more than
`BARE_M`."""


def find_robot(robot: str | Robot | Mapping[str, Any]) -> Robot:
    """Return a robot, given its name or definition.

    Args:
        robot: name of the robot, or the robot itself as a record or a mapping of its fields.

    Raises:
        ConfigError: the name is unknown, or a part of the robot is missing or invalid.
    """
    if isinstance(robot, str):
        check_names("robot", [robot], ROBOTS)
        return ROBOTS[robot]
    if isinstance(robot, Robot):
        robot = {each.name: getattr(robot, each.name) for each in fields(Robot)}
    if not isinstance(robot, Mapping):
        raise ConfigError(
            f"robot must be a name, a Robot or a mapping of its fields, got {robot!r}."
        )
    typed = from_mapping(Robot, robot, "robot.")
    check_robot(typed)
    return typed


def add_robot(spec: mujoco.MjSpec, robot: Robot, mount_world: Sequence[float]) -> None:
    """Add a robot to a scene that is being built.

    Args:
        spec: specification of the scene.
        robot: the robot.
        mount_world: position of the robot's base [m].
    """
    child, hand = parse_mjcf(robot), robot.hand or robot.suction
    pads, spans = (hand.pads, hand.spans) if hand else ((), ())
    drawn = () if robot in BUILT_IN else bare_capsules(robot)
    for geom in child.geoms:
        if geom.name in robot.capsules:
            geom.group = ROBOT_LOOKS if geom.name in drawn else ROBOT_CAPSULES
            geom.contype = ROBOT_BIT
            objects = 0 if geom.name in spans else SCENE_BIT | OBJECT_BIT
            geom.conaffinity = WORKER_BIT | objects
        elif geom.name in pads:
            geom.group, geom.contype = ROBOT_CAPSULES, PAD_BIT
            geom.conaffinity = SCENE_BIT | OBJECT_BIT
        else:
            geom.group, geom.contype, geom.conaffinity = ROBOT_LOOKS, 0, 0
    spec.attach(child, prefix=PREFIX, frame=spec.worldbody.add_frame(pos=list(mount_world)))


def servo_lead_s(robot: Robot, model: mujoco.MjModel) -> Floats:
    """Return the lead times (N,) of the rate servos [s].

    A lead time is the joint's inertia at the home pose divided by the servo's damping.
    """
    data, n = mujoco.MjData(model), len(robot.joints)
    data.qpos[:n] = robot.home_q
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    return np.diag(inertia)[:n] / model.actuator_gainprm[n : 2 * n, 0]


@lru_cache(maxsize=64)
def check_robot(robot: Robot) -> None:
    """Raise `ConfigError` if a part of a robot is missing or invalid."""
    if not isinstance(robot, Robot):
        raise ConfigError(f"A robot must be a Robot, got {type(robot).__name__}.")
    if not isinstance(robot.name, str) or not robot.name.strip():
        raise ConfigError(
            f"A robot must have a name, by which robot= selects it, got {robot.name!r}."
        )
    if not (robot.joints and robot.capsules):
        raise ConfigError(f"{robot.name}: joints and capsules must name at least one each.")
    chain = make_chain(robot, (0.0, 0.0, 0.0))
    check_names(f"watched capsule of {robot.name}", robot.watched_capsules, robot.capsules)
    if grips := robot.hand or robot.suction:
        check_names(f"capsule for the hand of {robot.name}", grips.spans, robot.capsules)
    low, high = chain.range_rad.T
    if ((robot.home_q < low) | (robot.home_q > high)).any():
        raise ConfigError(
            f"{robot.name}: home_q {robot.home_q} is outside the joints' ranges, from "
            f"{low.tolist()} to {high.tolist()}."
        )
    spread, widest = np.array(robot.spread_rad), high - low
    if ((spread < 0) | (spread > widest)).any():
        raise ConfigError(
            f"{robot.name}: spread_rad must be from 0 to the width of each joint's range, "
            f"{widest.tolist()}, got {robot.spread_rad}."
        )
    if robot.slew and min(robot.slew) <= 0:
        raise ConfigError(f"{robot.name}: slew must be positive [rad/s^2], got {robot.slew}.")
    spec = parse_mjcf(robot)  # kept in a variable, because its bodies do not keep it alive
    for body in spec.bodies[1:]:
        if body.joints and not body.explicitinertial:
            raise ConfigError(f"{robot.name}: link {body.name!r} needs an <inertial>.")


def find_grip(robot: Robot, model: mujoco.MjModel) -> Grip | None:
    """Return the indices and the motor of a robot's hand in a scene; None without a hand."""
    if robot.hand is None:
        return None
    fingers = [model.joint(PREFIX + name).qposadr[0] for name in robot.hand.joints]
    motor = model.actuator(PREFIX + robot.hand.motor)
    return Grip(
        fingers=np.array(fingers),
        open_m=float(motor.ctrlrange[1]),
        stiffness_n_m=float(motor.gainprm[0]),
        damping_n_s_m=float(-motor.biasprm[2]),
        most_n=float(motor.forcerange[1]),
    )
