"""Records that the components exchange: frozen records of arrays, the batch axis first.

B environments, W workers, C cameras, J = 15 joints, S = 22 body segments, K capsules, N arm joints.
World frame: +Z up, origin on the floor, metres, seconds, radians.

Belief and truth are different records on purpose: `PoseEstimate` is the cameras' estimate of a
worker, `WorkerTruth` is the worker. Observations, rewards and shields take the first, cost and
metrics the second (`tests/test_architecture.py` verifies this).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import answer_unknown_fields
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
    """Positions of the joints (B, C, W, J, 2) [px], continuous from the image's top-left corner;
    NaN where there is no measurement."""
    confidence: Floats
    """Confidence (B, C, W, J) in [0, 1]; 0 where there is no measurement."""
    sigma_px: Floats
    """Standard deviation of each coordinate (B, C, W, J) [px]; infinite where there is no
    measurement."""
    time_s: Floats | None = None
    """Time (B, C) at which each camera took its frame [s], on the tracker's clock, which is 0 at
    the reset; NaN: no frame of that camera. None: every frame belongs to the present update."""


@dataclass(frozen=True, slots=True)
class Roi:
    """A square region of one camera's image, rotated about its centre."""

    centre_px: tuple[float, float]
    """Position of its centre, x and y [px] from the image's top-left corner."""
    side_px: float
    """Length of its sides [px]."""
    rotation_rad: float
    """Rotation of the region's upright direction, clockwise in the image [rad]; 0 is upright."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """The belief about the workers.

    It is everything that reward, observation, shield and agent know about them.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {"blind_s": "unobserved_s"}
    """Present names of fields that were renamed, by their old names."""

    mean_world: Points3
    """Means of the joints (B, W, J, 3) in the world frame [m]; without a track: the documented
    prior."""
    cov_world: Covariances3
    """Covariance of each joint's position (B, W, J, 3, 3) [m^2], always finite and positive
    definite."""
    velocity_world: Velocities3
    """(B, W, J, 3) [m/s]."""
    age_s: Floats
    """Time since a measurement last supported each joint (B, W, J) [s]."""
    tracked: Bools
    """Whether each slot has a track (B, W); False: prior, or predicted for too long (lost)."""
    unknown: Bools = None  # type: ignore[assignment]
    """Whether a person without a track may be in the slot (B, W): lost, not searched for enough,
    detected but not tracked, or on floor that no two cameras see (`tracking.presence`); True for
    all slots while there are more people than slots. A slot that is neither tracked nor unknown is
    empty. Default: every slot without a track is unknown."""
    unobserved_s: Floats = None  # type: ignore[assignment]
    """Time since the cameras last observed the worker, or that the slot is empty (B, W) [s];
    without any observation, the time since the reset. Default: age of the joint with the youngest
    measurement."""
    seen_world: Points3 = None  # type: ignore[assignment]
    """Last detected place of the worker (B, W, J, 3) [m]; NaN without any detection, or if the
    place was seen empty since. Default: the mean of a track."""

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
        """Fill in the fields that were not given."""
        given: Any = self
        if given.unknown is None:
            object.__setattr__(self, "unknown", ~self.tracked)
        if given.unobserved_s is None:
            object.__setattr__(self, "unobserved_s", self.age_s.min(-1))
        if given.seen_world is None:
            seen = np.where(self.tracked[..., None, None], self.mean_world, np.nan)
            object.__setattr__(self, "seen_world", seen)


@dataclass(frozen=True, slots=True)
class WorkerPath:
    """Places of the workers' bodies after every physics step, which physics and cost follow."""

    position_world: Points3
    """Origins of the 22 body segments after every physics step (B, T, W, S, 3) [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """Orientations of the segments (B, T, W, S, 4), world_from_segment."""


@dataclass(frozen=True, slots=True)
class Held:
    """Objects in the workers' hands, and then objects that lie ready; see `props.PROPS`."""

    kind: Ints
    """Kind of each object (B, W + L), as an index into `props.PROPS`; 0: none."""
    position_world: Points3
    """Origin of each object's frame (B, W + L, 3) [m]; meaningless where there is none."""
    quaternion_wxyz: QuaternionsWxyz
    """Orientation of each object (B, W + L, 4), world_from_prop."""


@dataclass(frozen=True, slots=True)
class WorkerMotion:
    """Pose and velocity of the workers' bodies, as the motion generator returns them."""

    position_world: Points3
    """Origins of the 22 body segments (B, W, S, 3) [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """Orientations of the segments (B, W, S, 4), world_from_segment."""
    velocity_world: Velocities3
    """Velocities of the origins (B, W, S, 3) [m/s]."""
    angular_velocity_world: Floats
    """Angular velocities of the segments in the world frame (B, W, S, 3) [rad/s]."""
    held: Held | None = None
    """Objects that the workers hold and that lie ready for them; None: none."""
    body: Ints | None = None
    """Index of each worker's body among the scene's (B, W); None: all have the first."""


@dataclass(frozen=True, slots=True)
class WorkerTruth:
    """The true workers; only emulators of detectors, cost and metrics read this record."""

    joints_world: Points3
    """True joints in BlazePose's sense (B, W, J, 3) [m]."""
    velocity_world: Velocities3
    """(B, W, J, 3) [m/s]."""
    capsules_world: Capsules
    """Capsules of the bodies (B, W, K, 2, 3), end points [m]."""
    capsule_radius_m: Floats
    """Radii of these capsules (B, W, K) [m]."""


@dataclass(frozen=True, slots=True)
class RobotState:
    """The robot's state by its own encoders: exact, so neither belief nor truth."""

    q: JointAngles
    """Joint positions (B, N) [rad], of slides [m]."""
    qd: JointVelocities
    """Joint velocities (B, N) [rad/s], of slides [m/s]."""
    tool_world: Points3
    """Position of the tool point (B, 3) [m]."""
    tool_velocity_world: Velocities3
    """Velocity of the tool point (B, 3) [m/s]."""
    tool_axes_world: Floats
    """Axes x, y and z of the tool as columns (B, 3, 3)."""
    capsules_world: Capsules
    """Capsules of the robot and its loads (B, K, 2, 3), end points [m]; those of absent loads are
    far away."""
    capsule_radius_m: Floats
    """Radii of these capsules (K,) [m]."""
    slides: Bools | None = None
    """Whether each joint is a slide (N,), with q in m and qd in m/s; None: none is."""


@dataclass(frozen=True, slots=True)
class HandState:
    """The gripper's state by its own encoders."""

    opening_m: Floats
    """Distance of each finger from the middle (B,) [m]."""
    force_n: Floats
    """Force with which the motor presses the fingers together (B,) [N]; negative: apart."""
    closed_on: Bools
    """Whether the fingers press and rest on an object (B,)."""


@dataclass(frozen=True, slots=True)
class ObjectState:
    """The loose objects of a task: true or measured poses."""

    position_world: Points3
    """Centre of each object (B, O, 3) [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """Orientation of each object (B, O, 4), world_from_object."""
    velocity_world: Velocities3
    """Velocity of the centre (B, O, 3) [m/s]."""
    spin_object: Floats
    """Angular velocity about the object's own axes (B, O, 3) [rad/s]."""
    held: Bools
    """Whether the robot holds the object (B, O)."""
