"""Records exchanged between components: frozen records of arrays whose first axis is the batch.

B environments, W workers, C cameras, J = 15 joints, S = 22 body segments, K capsules, N arm joints.
World frame: +Z up, origin on the floor. Units: metres, seconds, radians.

Belief and truth are separate records: `PoseEstimate` is the workers' pose as estimated from the
cameras, `WorkerTruth` is their true pose. Observations, rewards and shields read the former, cost
and metrics the latter (`tests/test_architecture.py` verifies this).
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
    """Measurements of the joints in the images, made by a detector or its emulator.

    A joint that was not found has NaN coordinates and confidence 0; this is not an error.
    """

    px: Points2
    """Image coordinates of the joints (B, C, W, J, 2) [px], continuous, with the origin at the
    image's top-left corner; NaN where there is no measurement."""
    confidence: Floats
    """Confidence (B, C, W, J) in [0, 1]; 0 where there is no measurement."""
    sigma_px: Floats
    """Standard deviation of each coordinate (B, C, W, J) [px]; infinite where there is no
    measurement."""
    time_s: Floats | None = None
    """Time (B, C) at which each camera took its frame [s], on the tracker's clock, which is 0 at
    the reset; NaN if a camera has no frame. None if every frame belongs to the current update."""


@dataclass(frozen=True, slots=True)
class Roi:
    """A square region of one camera's image, rotated about its centre."""

    centre_px: tuple[float, float]
    """Image coordinates x, y of the region's centre [px], relative to the image's top-left
    corner."""
    side_px: float
    """Side length of the region [px]."""
    rotation_rad: float
    """Rotation of the region's upright direction, clockwise in the image [rad]; 0 is upright."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """The belief: the estimated state of the workers.

    Rewards, observations, shields and agents receive no other information about the workers.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {"blind_s": "unobserved_s"}
    """Current names of renamed fields, by their old names."""

    mean_world: Points3
    """Mean positions of the joints (B, W, J, 3) in the world frame [m]; for slots without a track,
    the means of the prior."""
    cov_world: Covariances3
    """Covariance of each joint's position (B, W, J, 3, 3) [m^2], always finite and positive
    definite."""
    velocity_world: Velocities3
    """Velocities of the joints (B, W, J, 3) in the world frame [m/s]."""
    age_s: Floats
    """Time since each joint was last supported by a measurement (B, W, J) [s]."""
    tracked: Bools
    """Whether each slot has a track (B, W). A slot without a track has the prior, or a prediction
    that is too old to count as a track."""
    unknown: Bools = None  # type: ignore[assignment]
    """Whether the slot may contain an untracked person (B, W), because a track was lost, the
    searches do not suffice, a detected person is not tracked, or fewer than two cameras see part of
    the floor (`tracking.presence`); True for all slots while there are more people than slots. A
    slot that is neither tracked nor unknown is empty. Default: every slot without a track is
    unknown."""
    unobserved_s: Floats = None  # type: ignore[assignment]
    """Time since the cameras last observed the worker, or observed that the slot is empty (B, W)
    [s]; without any observation, the time since the reset. Default: age of the joint with the most
    recent measurement."""
    seen_world: Points3 = None  # type: ignore[assignment]
    """Joint positions at the last detection of the worker (B, W, J, 3) [m]; NaN if there was no
    detection, or if cameras have since observed that no person is at these positions. Default: the
    means of slots with a track, otherwise NaN."""
    n_views: Ints = None  # type: ignore[assignment]
    """Number of cameras that located each joint where it is estimated in their last images (B, W,
    J) (`tracking.agreement`). Pipelines with cameras measure it. Default: 0."""
    misfit: Floats = None  # type: ignore[assignment]
    """Sum over the cameras of the squared distances between each joint's measurement and the
    estimate, in units of the measurement's standard deviation (B, W, J). Pipelines with cameras
    measure it. Default: NaN, not measured."""
    calibrated: Bools = None  # type: ignore[assignment]
    """Whether bounds on the errors of such estimates are calibrated (B, W), which is the case for
    the default estimator with the default settings and for the truth (`safety.error_bounds`).
    Default: False."""

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
        if given.n_views is None:
            object.__setattr__(self, "n_views", np.zeros(self.age_s.shape, np.int64))
        if given.misfit is None:
            object.__setattr__(self, "misfit", np.full(self.age_s.shape, np.nan))
        if given.calibrated is None:
            object.__setattr__(self, "calibrated", np.zeros(self.tracked.shape, np.bool_))


@dataclass(frozen=True, slots=True)
class WorkerPath:
    """Poses of the workers' bodies after every physics step, which physics and cost use."""

    position_world: Points3
    """Origins of the 22 body segments after every physics step (B, T, W, S, 3) [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """Orientations of the segments (B, T, W, S, 4), world_from_segment."""


@dataclass(frozen=True, slots=True)
class Held:
    """Objects in the workers' hands, followed by L objects that are ready to be used.

    `props.PROPS` lists the kinds of objects.
    """

    kind: Ints
    """Kind of each object (B, W + L), as an index into `props.PROPS`; 0 for no object."""
    position_world: Points3
    """Origin of each object's frame (B, W + L, 3) [m]; meaningless where there is no object."""
    quaternion_wxyz: QuaternionsWxyz
    """Orientation of each object (B, W + L, 4), world_from_prop."""


@dataclass(frozen=True, slots=True)
class WorkerMotion:
    """Poses and velocities of the workers' bodies, as the motion generator returns them."""

    position_world: Points3
    """Origins of the 22 body segments (B, W, S, 3) [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """Orientations of the segments (B, W, S, 4), world_from_segment."""
    velocity_world: Velocities3
    """Velocities of the origins (B, W, S, 3) [m/s]."""
    angular_velocity_world: Floats
    """Angular velocities of the segments in the world frame (B, W, S, 3) [rad/s]."""
    held: Held | None = None
    """Objects that the workers hold, and objects that are ready for them; None if there are
    none."""
    body: Ints | None = None
    """Index of each worker's body in the scene's list of bodies (B, W); None if all workers have
    the first body."""


@dataclass(frozen=True, slots=True)
class WorkerTruth:
    """True state of the workers; only emulators of detectors, cost and metrics read this record."""

    joints_world: Points3
    """True positions of the joints (B, W, J, 3), defined as in BlazePose [m]."""
    velocity_world: Velocities3
    """Velocities of the joints (B, W, J, 3) [m/s]."""
    capsules_world: Capsules
    """End points of the capsules of the bodies (B, W, K, 2, 3) [m]."""
    capsule_radius_m: Floats
    """Radii of the capsules in `capsules_world` (B, W, K) [m]."""


@dataclass(frozen=True, slots=True)
class RobotState:
    """State of the robot according to its encoders: exact, hence neither belief nor truth."""

    q: JointAngles
    """Joint positions (B, N) [rad], or [m] for slides."""
    qd: JointVelocities
    """Joint velocities (B, N) [rad/s], or [m/s] for slides."""
    tool_world: Points3
    """Position of the tool point (B, 3) [m]."""
    tool_velocity_world: Velocities3
    """Velocity of the tool point (B, 3) [m/s]."""
    tool_axes_world: Floats
    """Axes x, y and z of the tool in the world frame, as columns (B, 3, 3)."""
    capsules_world: Capsules
    """End points of the capsules of the robot and its loads (B, K, 2, 3) [m]; the capsules of
    absent loads are far away."""
    capsule_radius_m: Floats
    """Radii of the capsules in `capsules_world` (K,) [m]."""
    slides: Bools | None = None
    """Whether each joint is a slide (N,), with `q` in [m] and `qd` in [m/s]; None if there are no
    slides."""


@dataclass(frozen=True, slots=True)
class HandState:
    """State of the gripper from the robot's encoders."""

    opening_m: Floats
    """Distance of each finger from the middle of the gripper (B,) [m]."""
    force_n: Floats
    """Force with which the motor presses the fingers together (B,) [N]; negative if it opens the
    gripper."""
    closed_on: Bools
    """Whether the fingers press and rest on an object (B,)."""


@dataclass(frozen=True, slots=True)
class ObjectState:
    """Poses and velocities of a task's loose objects, either true or measured."""

    position_world: Points3
    """Centre of each object (B, O, 3) [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """Orientation of each object (B, O, 4), world_from_object."""
    velocity_world: Velocities3
    """Velocity of the centre (B, O, 3) [m/s]."""
    spin_object: Floats
    """Angular velocity in the object's frame (B, O, 3) [rad/s]."""
    held: Bools
    """Whether the robot holds the object (B, O)."""
