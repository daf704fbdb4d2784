"""Records that scene, workers and tasks exchange: workplaces, objects, signals and the true world.

A task reads and writes these records; none of them is part of a belief.
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
"""Place of the foot of robots that do not drive, in every scene [m]."""
AWAY_M = 0.43
"""Distance of loads on the floor or a table ahead of the worker at a workplace [m]."""


@dataclass(frozen=True, slots=True)
class Workplace:
    """A place where a worker stands and works."""

    name: str
    """Name of the place, unique in its scene."""
    kind: str
    """Kind of work, one of `WORKPLACE_KINDS`."""
    xy_m: tuple[float, float]
    """Place where the worker stands, x and y in the world [m]."""
    yaw_rad: float
    """Direction in which the worker looks, from world +x [rad]."""
    height_m: float
    """Height of the work above the floor [m]: of the hands, of the surface with the loads, or of
    a step; 0 if there is none."""
    ahead_m: float = AWAY_M
    """Distance of loads, a cart's handles or a wall ahead of the worker [m]."""
    loads: tuple[str, ...] = ()
    """Props that lie there at the start, from the bottom up: names of `props.PROPS`."""


WORKPLACE_KINDS = (
    "robot",
    "bench",
    "floor",
    "wall",
    "overhead",
    "pile",
    "cart",
    "step",
    "open",
    "task",
)
"""Kinds of workplaces: beside the robot, with the hands in its workspace; at a table; kneeling; at
a wall; above the head; at materials to lift; at a place where a cart is taken or left; before a
tread 0.3 m ahead; on open floor; at an object of the task."""


@dataclass(frozen=True, slots=True, eq=False)
class Grounds:
    """The floor plan of a scene: the area where people stand, walk and work."""

    walkable_x_m: tuple[float, float]
    """Least and greatest x of the area where workers stand and walk [m]."""
    walkable_y_m: tuple[float, float]
    """Least and greatest y of that area [m]."""
    blocked: Floats
    """(N, 5) footprints of obstacles on the floor without the robot's pedestal: middle x and y,
    half length and half width [m], yaw of the length from world +x [rad]."""
    places: tuple[Workplace, ...]
    """Workplaces, all of them inside the walkable area and outside of `blocked`."""
    robot_xy_m: tuple[float, float]
    """Axis of the robot's first joint, x and y in the world [m]; its front looks to world +x."""
    robot_clearance_m: float
    """Distance that workers' paths keep from that axis [m]: a pedestal's radius and half a person.
    """


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Weld:
    """A connection of two sites that keeps their distance while it is on; at first it is off."""

    name: str
    """Name of the weld in `Effects.welded`."""
    sites: tuple[str, str]
    """Names of the two sites in the scene: "robot/...", "task/...", "worker_1/..."."""
    solref: tuple[float, float] = (0.02, 1.0)
    """Stiffness and damping of the constraint: MuJoCo's `solref`."""
    turns: bool = True
    """Whether the sites' relative rotation is held, too."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class TaskScene:
    """A task's part of a scene, in the frame of the robot's foot [m]."""

    mjcf: str = ""
    """MJCF with bodies of boxes: loose with a free joint and contype 16, fixed with contype 1."""
    welds: tuple[Weld, ...] = ()
    """Connections of sites that the task switches on and off."""
    places: tuple[Workplace, ...] = ()
    """Workplaces at the task's objects, of the kind "task"."""


NOTHING = TaskScene()
"""The part of a task that adds nothing to a scene."""


@dataclass(frozen=True, slots=True)
class WorkerProgress:
    """Progress of workers in their part of a task."""

    present: Bools
    """(B, W) whether each worker is in the scene."""
    screws: Ints
    """(B, W) number of screws that each worker has driven."""
    boring: Bools
    """(B, W) whether each worker drives a screw now."""
    takes: Bools
    """(B, W) whether each worker puts out a hand for an object that the robot brings."""
    grip_world: Points3
    """(B, W, 3) place of the grip of each worker's active hand [m]."""
    grip_velocity_world: Velocities3
    """(B, W, 3) velocity of that grip [m/s]."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class WorkerSignal:
    """A task's signal to workers that wait for it."""

    stage: Ints
    """(B,) stage of the task: 0 while workers wait, 1 from when they may begin, 2 from when an
    object is theirs."""
    offered_world: Points3
    """(B, 3) place where an object is offered [m]; NaN if none is."""


@dataclass(frozen=True, slots=True)
class World:
    """The true state of robot and objects, from which a task is judged; a row an environment."""

    robot: RobotState
    """Joints and tool, by the robot's own encoders."""
    hand: HandState | None = None
    """State of the gripper; None for an arm without."""
    objects: ObjectState | None = None
    """True poses and velocities of the task's loose objects; None for a task without."""
    workers: WorkerProgress | None = None
    """Progress of workers that wait for signals (`Task.signal`); None if no worker waits, and at
    the start of an episode."""
    touched: Bools | None = None
    """(B,) whether the robot touched a worker in this step. It is the truth: use it for the
    success of an episode, not for a reward or an observation."""
    place: Any = None
    """The task's own map of the place, as `Task.survey` returned it."""


@dataclass(frozen=True, slots=True)
class Effects:
    """Welds and external forces of a task on its loose objects in a step."""

    welded: Mapping[str, Bools]
    """(B,) whether each of the task's welds is on, by its name."""
    push_world: Floats
    """(B, O, 6) force [N] and torque [Nm] at the middle of each object, in the world frame."""
