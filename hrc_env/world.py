"""Records that scene, workers and tasks exchange, such as signals and the true state of the world.

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
"""Position of the base of stationary robots in every scene [m]."""
AWAY_M = 0.43
"""Distance between a worker at a workplace and the loads in front of the worker [m]."""


@dataclass(frozen=True, slots=True)
class Workplace:
    """A location where a worker stands and works."""

    name: str
    """Name of the workplace, unique in its scene."""
    kind: str
    """Kind of work, one of `WORKPLACE_KINDS`."""
    xy_m: tuple[float, float]
    """Position where the worker stands, x and y in the world frame [m]."""
    yaw_rad: float
    """Heading of the worker, measured from world +x [rad]."""
    height_m: float
    """Height above the floor [m] of the hands at work, of the surface with the loads, or of a step,
    depending on `kind`; 0 if none of them applies."""
    ahead_m: float = AWAY_M
    """Distance between the worker and the loads, cart handles or wall in front [m]."""
    loads: tuple[str, ...] = ()
    """Names of the props (`props.PROPS`) that are initially stacked at the workplace, from the
    bottom up."""


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
"""Kinds of workplaces, in this order: beside the robot with the hands in its workspace, at a table,
kneeling on the floor, at a wall, above the head, at a pile of material, at a cart, in front of a
step 0.3 m ahead, on open floor, and at an object of the task."""


@dataclass(frozen=True, slots=True, eq=False)
class Grounds:
    """The floor plan of a scene, with the area where people stand, walk and work."""

    walkable_x_m: tuple[float, float]
    """Minimum and maximum x of the area where workers stand and walk [m]."""
    walkable_y_m: tuple[float, float]
    """Minimum and maximum y of the area where workers stand and walk [m]."""
    blocked: Floats
    """(N, 5) footprints of obstacles on the floor, except the robot's pedestal: centre x and y,
    half length and half width [m], and yaw of the longitudinal axis from world +x [rad]."""
    places: tuple[Workplace, ...]
    """Workplaces, which are inside the walkable area and outside of `blocked`."""
    robot_xy_m: tuple[float, float]
    """Position of the robot's first joint axis, x and y in the world [m]; the robot faces world
    +x."""
    robot_clearance_m: float
    """Minimum distance of workers' paths from the robot's first joint axis [m]: the pedestal's
    radius plus half the width of a person."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Weld:
    """Connection of two sites that keeps their relative pose while active; initially inactive."""

    name: str
    """Name of the weld in `Effects.welded`."""
    sites: tuple[str, str]
    """Names of the two sites in the scene: "robot/...", "task/...", "worker_1/..."."""
    solref: tuple[float, float] = (0.02, 1.0)
    """Stiffness and damping of the constraint: MuJoCo's `solref`."""
    turns: bool = True
    """Whether the relative rotation of the sites is also kept, in addition to their relative
    position."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class TaskScene:
    """A task's part of a scene, in the frame of the robot's base [m]."""

    mjcf: str = ""
    """MJCF with bodies that consist of boxes: loose bodies have a free joint and contype 16, fixed
    bodies have contype 1."""
    welds: tuple[Weld, ...] = ()
    """Connections of sites that the task activates and deactivates."""
    places: tuple[Workplace, ...] = ()
    """Workplaces at the task's objects, of the kind "task"."""


NOTHING = TaskScene()
"""Empty part of a scene, for tasks that add nothing to the scene."""


@dataclass(frozen=True, slots=True)
class WorkerProgress:
    """Progress of workers in their part of a task."""

    present: Bools
    """Mask (B, W) of the workers that are in the scene."""
    screws: Ints
    """(B, W) number of screws that each worker has driven."""
    boring: Bools
    """Mask (B, W) of the workers that are driving a screw."""
    takes: Bools
    """Mask (B, W) of the workers that extend a hand to take an object from the robot."""
    grip_world: Points3
    """(B, W, 3) position of the grip point of each worker's active hand [m]."""
    grip_velocity_world: Velocities3
    """(B, W, 3) velocity of the grip point of each worker's active hand [m/s]."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class WorkerSignal:
    """Signal of a task to the workers that wait for it."""

    stage: Ints
    """(B,) stage of the task: 0 while workers wait, 1 when they may begin, 2 after one of them has
    taken an object."""
    offered_world: Points3
    """(B, 3) position at which an object is offered [m]; NaN if none is offered."""


@dataclass(frozen=True, slots=True)
class World:
    """True state of robots and objects for the evaluation of a task, with a row per environment."""

    robot: RobotState
    """Joints and tool of the robot, as measured by the robot's encoders."""
    hand: HandState | None = None
    """State of the hand; None for a robot without a hand."""
    objects: ObjectState | None = None
    """True poses and velocities of the task's loose objects; None for a task without objects."""
    workers: WorkerProgress | None = None
    """Progress of workers that wait for signals (`Task.signal`); None if no worker waits, and at
    the start of an episode."""
    touched: Bools | None = None
    """Mask (B,) of the environments in which the robot touched a worker in this step. This is true
    state: use it to determine the success of an episode, but not for a reward or an observation."""
    place: Any = None
    """The task's map of the scene, as returned by `Task.survey`."""


@dataclass(frozen=True, slots=True)
class Effects:
    """Welds and external forces that a task applies to its loose objects in a step."""

    welded: Mapping[str, Bools]
    """Mask (B,) of the environments in which a weld of the task is active, by name of the weld."""
    push_world: Floats
    """(B, O, 6) force [N] and torque [Nm] at the centre of each object, in the world frame."""
