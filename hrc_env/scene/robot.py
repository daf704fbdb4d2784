"""Robots: an MJCF file and a record that says what in it the environment moves and watches.

A robot's file has the middle of its foot at the origin, looks to +x, and holds for each joint two
servos on one command [rad/s]: first all that hold its integral (`intvelocity`), then all that
follow it (`velocity`); one of them alone has 3-20 mm of tool error instead of 0.1. What is an
angle [rad] of a hinge is a way [m] of a slide, here and everywhere.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

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
from hrc_env.scene.robot_chain import chain_of, parsed
from hrc_env.scene.robot_looks import bare_capsules
from hrc_env.worker.body import assets_dir

PREFIX = "robot/"
"""What the names of a robot's parts begin with in a scene."""
DEFAULT = "ur10e_like"


@answer_unknown_fields
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


@answer_unknown_fields
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


@answer_unknown_fields
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
    """The fingers that it grips with; None: none."""
    suction: Suction | None = None
    """The cups that it grips with; None: none."""
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
        check_kind(f"{self.name}: hand", self.hand, Hand, None)
        check_kind(f"{self.name}: suction", self.suction, Suction, None)
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
BUILT_IN = frozenset(ROBOTS.data.values())
"""Those in `assets/robots`; none of their capsules reaches out of the looks by `BARE_M`."""


def robot_called(robot: str | Robot | Mapping[str, Any]) -> Robot:
    """A robot by its name, or itself, as a record or a mapping of its fields.

    Raises:
        ConfigError: there is no such name, or something is missing or wrong in a robot.
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


def add_robot(spec: Any, robot: Robot, mount_world: Sequence[float]) -> None:
    """Put a robot into a scene that is being built, its foot at a point [m]."""
    child, hand = parsed(robot), robot.hand or robot.suction
    pads, spans = (hand.pads, hand.spans) if hand else ((), ())
    drawn = () if robot in BUILT_IN else bare_capsules(robot)
    for geom in child.geoms:
        if geom.name in robot.capsules:
            geom.group = ROBOT_LOOKS if geom.name in drawn else ROBOT_CAPSULES
            geom.contype = ROBOT_BIT
            things = 0 if geom.name in spans else SCENE_BIT | OBJECT_BIT
            geom.conaffinity = WORKER_BIT | things
        elif geom.name in pads:
            geom.group, geom.contype = ROBOT_CAPSULES, PAD_BIT
            geom.conaffinity = SCENE_BIT | OBJECT_BIT
        else:
            geom.group, geom.contype, geom.conaffinity = ROBOT_LOOKS, 0, 0
    spec.attach(child, prefix=PREFIX, frame=spec.worldbody.add_frame(pos=list(mount_world)))


def servo_lead_s(robot: Robot, model: mujoco.MjModel) -> Floats:
    """(N,) inertia at rest over damping: by how much the rate servos run ahead [s]."""
    data, n = mujoco.MjData(model), len(robot.joints)
    data.qpos[:n] = robot.home_q
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    return np.diag(inertia)[:n] / model.actuator_gainprm[n : 2 * n, 0]


@lru_cache(maxsize=64)
def check_robot(robot: Robot) -> None:
    """Raise `ConfigError` for what is missing or wrong in a robot."""
    if not isinstance(robot, Robot):
        raise ConfigError(f"A robot must be a Robot, got {type(robot).__name__}.")
    if not isinstance(robot.name, str) or not robot.name.strip():
        raise ConfigError(
            f"A robot must have a name, by which robot= knows it, got {robot.name!r}."
        )
    if not (robot.joints and robot.capsules):
        raise ConfigError(f"{robot.name}: joints and capsules must name at least one each.")
    chain = chain_of(robot, (0.0, 0.0, 0.0))
    check_names(f"watched capsule of {robot.name}", robot.watched, robot.capsules)
    if grips := robot.hand or robot.suction:
        check_names(f"capsule for the hand of {robot.name}", grips.spans, robot.capsules)
    low, high = chain.range_rad.T
    if ((robot.home_q < low) | (robot.home_q > high)).any():
        raise ConfigError(
            f"{robot.name}: home_q {robot.home_q} is outside of the joints' ranges, from "
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
    spec = parsed(robot)  # its bodies do not keep it
    for body in spec.bodies[1:]:
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
