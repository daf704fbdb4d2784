"""What the components hand to each other: frozen records of arrays, the batch axis first.

B environments, W workers, C cameras, J = 15 joints, S = 22 body segments, K capsules,
N arm joints. World frame: +Z up, origin on the floor, metres, seconds, radians.

Belief and truth are different records on purpose: `PoseEstimate` is what the cameras made
of a worker, `WorkerTruth` is the worker. Observations, rewards and shields take the first,
cost and metrics the second (`tests/test_architecture.py` holds this).
"""

from dataclasses import dataclass

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
    """Joints in the images, as a detector or its emulator reports them [px].

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
    """Place of its middle, x and y [px] from the image's top-left corner."""
    side_px: float
    """Length of its sides [px]."""
    rotation_rad: float
    """Turn of the window's upright, clockwise in the image; 0 is the image's own upright."""


@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """The belief about the workers: all that reward, observation, shield and agent know of them."""

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
