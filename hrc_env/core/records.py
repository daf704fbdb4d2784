"""What the components hand to each other: frozen records of arrays, the batch axis first.

B environments, W workers, C cameras, J = 15 joints, S = 22 body segments, K capsules,
N arm joints. World frame: +Z up, origin on the floor, metres, seconds, radians.

Belief and truth are different records on purpose: `PoseEstimate` is what the cameras made
of a worker, `WorkerTruth` is the worker. Observations, rewards and shields take the first,
cost and metrics the second (`tests/test_architecture.py` holds this).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import (
    Bools,
    Capsules,
    Covariances3,
    Floats,
    Ints,
    JointAngles,
    JointVelocities,
    Points2,
    Points3,
    QuaternionsWxyz,
    Velocities3,
)


@dataclass(frozen=True, slots=True)
class Keypoints:
    """2D joints as a detector (or its emulator) reports them, in full-image pixels.

    A joint that was not found is NaN with confidence 0: data, not an error.
    """

    px: Points2
    """(B, C, W, J, 2) pixels, continuous from the image's top-left corner."""
    confidence: Floats
    """(B, C, W, J) in [0, 1]; 0 where there is no measurement."""
    sigma_px: Floats
    """(B, C, W, J) standard deviation of each coordinate [px]; infinite where missing."""
    time_s: Floats | None = None
    """(B, C) when each camera's frame was taken [s], on the tracker's clock, which is 0 at the
    reset; NaN: no frame of that camera. None: every frame is of this very update."""


@dataclass(frozen=True, slots=True)
class Roi:
    """A square region of one camera's image, turned about its centre."""

    centre_px: tuple[float, float]
    side_px: float
    rotation_rad: float
    """Turn of the window's upright, clockwise in the image; 0 is the image's own upright."""


@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """What the robot believes about the workers (the only worker it may look at)."""

    mean_world: Points3
    """(B, W, J, 3) [m]; of a worker not yet acquired: the documented prior."""
    cov_world: Covariances3
    """(B, W, J, 3, 3) [m^2], finite and positive definite always."""
    velocity_world: Velocities3
    """(B, W, J, 3) [m/s]."""
    age_s: Floats
    """(B, W, J) seconds since a measurement last supported the joint."""
    tracked: Bools
    """(B, W) whether there is a track; False: prior or predicting for too long (lost)."""
    unknown: Bools = None  # type: ignore[assignment]
    """(B, W) whether a person without a track may be there: lost, not searched for enough, detected
    but not tracked, or on floor that no two cameras see (`tracking.presence`); every slot while
    there are more people than slots. A slot that is neither tracked nor unknown is empty. Not
    given: every slot without a track is unknown."""
    blind_s: Floats = None  # type: ignore[assignment]
    """(B, W) seconds since cameras last said something: saw the worker, or that nobody is there;
    of who was never seen or looked for, since the reset. Not given: the youngest joint's age."""
    seen_world: Points3 = None  # type: ignore[assignment]
    """(B, W, J, 3) where the worker was believed to be when a camera showed them last [m]; NaN of
    whom none has, or where it is known since that nobody is. Not given: the mean of a track."""

    def __post_init__(self) -> None:
        try:
            self._complete()
        except (AttributeError, TypeError, ValueError, IndexError) as error:
            shapes = {name: np.shape(getattr(self, name)) for name in ("mean_world", "tracked")}
            raise ConfigError(
                "A PoseEstimate must be of arrays: mean_world (B, W, J, 3), age_s (B, W, J), "
                f"tracked (B, W) true or false; got {shapes}: {error}"
            ) from error

    def _complete(self) -> None:
        if self.unknown is None:
            object.__setattr__(self, "unknown", ~self.tracked)
        if self.blind_s is None:
            object.__setattr__(self, "blind_s", self.age_s.min(-1))
        if self.seen_world is None:
            seen = np.where(self.tracked[..., None, None], self.mean_world, np.nan)
            object.__setattr__(self, "seen_world", seen)


@dataclass(frozen=True, slots=True)
class WorkerPath:
    """Where the worker's body goes: what physics and cost follow from substep to substep."""

    position_world: Points3
    """(B, T, W, S, 3) origins of the 22 body segments after every substep [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """(B, T, W, S, 4) world_from_segment."""


@dataclass(frozen=True, slots=True)
class Held:
    """What the workers' hands hold, and then what lies there for them; see `props.PROPS`."""

    kind: Ints
    """(B, W + L) index into `props.PROPS`; 0: nothing."""
    position_world: Points3
    """(B, W + L, 3) origin of the prop's frame [m]; of no meaning where there is nothing."""
    quaternion_wxyz: QuaternionsWxyz
    """(B, W + L, 4) world_from_prop."""


@dataclass(frozen=True, slots=True)
class WorkerMotion:
    """Where the worker's body is and how it moves: what the motion generator says."""

    position_world: Points3
    """(B, W, S, 3) origins of the 22 body segments [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """(B, W, S, 4) world_from_segment."""
    velocity_world: Velocities3
    """(B, W, S, 3) velocity of the origins [m/s], from the generator."""
    angular_velocity_world: Floats
    """(B, W, S, 3) [rad/s]."""
    held: Held | None = None
    """What they hold and what lies there for them; None: nothing."""
    body: Ints | None = None
    """(B, W) which of the scene's bodies each has; None: all have the first."""


@dataclass(frozen=True, slots=True)
class WorkerTruth:
    """The worker as they are. Only the estimator's emulators, cost and metrics read it."""

    joints_world: Points3
    """(B, W, J, 3) true joints in BlazePose's sense [m]."""
    velocity_world: Velocities3
    """(B, W, J, 3) [m/s]."""
    capsules_world: Capsules
    """(B, W, K, 2, 3) the body's capsules [m]."""
    capsule_radius_m: Floats
    """(B, W, K) [m]."""


@dataclass(frozen=True, slots=True)
class RobotState:
    """The robot as its own encoders know it (exact, so neither belief nor truth)."""

    q: JointAngles
    """(B, N) [rad]."""
    qd: JointVelocities
    """(B, N) [rad/s]."""
    tool_world: Points3
    """(B, 3) [m]."""
    tool_velocity_world: Velocities3
    """(B, 3) [m/s]."""
    tool_axes_world: Floats
    """(B, 3, 3) the tool's x, y and z axes as columns."""
    capsules_world: Capsules
    """(B, K, 2, 3) [m], with those of what it carries; far away where it carries nothing."""
    capsule_radius_m: Floats
    """(K,) [m]."""
    slides: Bools | None = None
    """(N,) which joints are slides, whose q are in m and qd in m/s; None: none is."""


@dataclass(frozen=True, slots=True)
class HandState:
    """The gripper as its own encoders know it."""

    opening_m: Floats
    """(B,) how far each finger is from the middle [m]."""
    force_n: Floats
    """(B,) with which its motor presses the fingers together; negative: apart [N]."""
    closed_on: Bools
    """(B,) whether the fingers press and have come to rest on something."""


@dataclass(frozen=True, slots=True)
class ObjectState:
    """A task's loose objects: where they are, or are measured to be."""

    position_world: Points3
    """(B, O, 3) the middle of each [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """(B, O, 4) world_from_object."""
    velocity_world: Velocities3
    """(B, O, 3) of its middle [m/s]."""
    spin_object: Floats
    """(B, O, 3) turn rate about its own axes [rad/s]."""
    held: Bools
    """(B, O) whether the robot holds it."""


@dataclass(frozen=True, slots=True)
class Deeds:
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


@dataclass(frozen=True, slots=True)
class Cue:
    """What a task says to workers who wait for it."""

    stage: Ints
    """(B,) how far it has come: 0 not yet, 1 there, 2 theirs."""
    offered_world: Points3
    """(B, 3) where it is offered [m]; not a number: nowhere."""


@dataclass(frozen=True, slots=True)
class World:
    """What a task judges, and what the robot feels; rows are the environments in question."""

    robot: RobotState
    hand: HandState | None = None
    """Of an arm with a gripper."""
    objects: ObjectState | None = None
    """The task's loose objects as they are."""
    deeds: Deeds | None = None
    """What workers have done who wait for something (`Task.cue`); None: an episode begins."""
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
