"""What scene, workers and tasks exchange: places of work, the task's objects, signals, the world.

A task reads and writes these records; nothing here is part of a belief.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.records import HandState, ObjectState, RobotState
from hrc_env.core.typing import Bools, Floats, Ints, Points3, Velocities3

FOOT_M = (-0.75, 0.0, 0.75)
FOOT_WORLD = np.array(FOOT_M)
"""The foot of robots that do not drive, in every scene [m]."""
AWAY_M = 0.43
"""How far ahead of who stands there loads lie on the floor or a table [m]."""


@dataclass(frozen=True, slots=True)
class Workplace:
    """A place where a worker stands and works."""

    name: str
    """Unique in its scene."""
    kind: str
    """One of `WORKPLACE_KINDS`."""
    xy_m: tuple[float, float]
    """Where the worker stands [m]."""
    yaw_rad: float
    """Which way the worker looks, from world +x [rad]."""
    height_m: float
    """How high above the floor the work is [m]: where hands work, on what loads lie, or how
    high a step is; 0 where there is nothing."""
    ahead_m: float = AWAY_M
    """How far ahead of who stands there loads lie, a cart's handles or a wall are [m]."""
    loads: tuple[str, ...] = ()
    """What lies there at first to be taken up, from the bottom up: names of `props.PROPS`."""


WORKPLACE_KINDS = (
    "robot", "bench", "floor", "wall", "overhead", "pile", "cart", "step", "open", "task",
)  # fmt: skip
"""Beside the robot, hands in its workspace; at a table; kneeling; at a wall; above the head; at
materials to lift; where a cart is taken or left; before a tread 0.3 m ahead; nothing there; at what
a task has put there."""


@dataclass(frozen=True, slots=True, eq=False)
class Grounds:
    """Where people can stand, walk and work in a scene."""

    walkable_x_m: tuple[float, float]
    """Where workers stand and walk, least and greatest x [m]."""
    walkable_y_m: tuple[float, float]
    """The same along y [m]."""
    blocked: Floats
    """(N, 5) footprints of what stands on the floor, the robot's pedestal left out: middle x
    and y, half length and half width [m], yaw of the length from world +x [rad]."""
    places: tuple[Workplace, ...]
    """Where there is work, all of them inside the walkable area and outside `blocked`."""
    robot_xy_m: tuple[float, float]
    """The axis of the robot's first joint [m]; its front looks to world +x."""
    robot_clearance_m: float
    """Paths keep so far from that axis [m]: a pedestal's radius and half a person."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Weld:
    """Two sites that can be held together, as wide as they are apart; off at first."""

    name: str
    """By which `Effects.welded` knows it."""
    sites: tuple[str, str]
    """By their names in the scene: "robot/...", "task/...", "worker_1/..."."""
    solref: tuple[float, float] = (0.02, 1.0)
    """How stiff it is, as MuJoCo has it."""
    turns: bool = True
    """Whether it holds their turns, too."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class TaskScene:
    """What a task puts into a scene, from the middle of the robot's foot on [m]."""

    mjcf: str = ""
    """Bodies of boxes, loose with a free joint and contype 16, fixed with contype 1."""
    welds: tuple[Weld, ...] = ()
    """What can be held together."""
    places: tuple[Workplace, ...] = ()
    """Where workers work at them; kind "task"."""


NOTHING = TaskScene()


@dataclass(frozen=True, slots=True)
class WorkerProgress:
    """What workers have done for a task in what they are at."""

    present: Bools
    """(B, W) who is there."""
    screws: Ints
    """(B, W) how many they have driven,"""
    boring: Bools
    """(B, W) and whether they drive one,"""
    takes: Bools
    """(B, W) whether they put out a hand for what is brought."""
    grip_world: Points3
    """(B, W, 3) where the hand that they use grips [m],"""
    grip_velocity_world: Velocities3
    """(B, W, 3) and how fast it is [m/s]."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class WorkerSignal:
    """What a task says to workers who wait for it."""

    stage: Ints
    """(B,) how far it has come: 0 not yet, 1 there, 2 theirs."""
    offered_world: Points3
    """(B, 3) where it is offered [m]; not a number: nowhere."""


@dataclass(frozen=True, slots=True)
class World:
    """What a task judges, and what the robot feels; rows are the environments in question."""

    robot: RobotState
    """Joints and tool, by the robot's own encoders."""
    hand: HandState | None = None
    """Of an arm with a gripper."""
    objects: ObjectState | None = None
    """The task's loose objects as they are."""
    workers: WorkerProgress | None = None
    """What workers have done who wait for signals (`Task.signal`); None: nobody waits, or an
    episode begins."""
    touched: Bools | None = None
    """(B,) whether the robot touched a worker in this step: true, so for success only, and for no
    reward or observation."""
    place: Any = None
    """What the task made of the place (`Task.survey`)."""


@dataclass(frozen=True, slots=True)
class Effects:
    """What a task does to its loose objects in a step."""

    welded: Mapping[str, Bools]
    """(B,) whether each of its welds holds, by name."""
    push_world: Floats
    """(B, O, 6) force [N] and torque [Nm] at the middle of each."""
