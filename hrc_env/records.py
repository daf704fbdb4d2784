"""What the organs hand to each other: frozen records of arrays, the batch axis first.

B environments, W workers, C cameras, J = 15 joints, S = 22 body segments, K capsules,
N arm joints. World frame: +Z up, origin on the floor, metres, seconds, radians.

Belief and truth are different records on purpose: `PoseEstimate` is what the cameras made
of a worker, `WorkerTruth` is the worker. Observations, rewards and shields take the first,
cost and metrics the second (`tests/test_architecture.py` holds this).
"""

from dataclasses import dataclass

from hrc_env.typing import (
    Bools,
    Capsules,
    Covariances3,
    Floats,
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
class CropWindow:
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


@dataclass(frozen=True, slots=True)
class WorkerPath:
    """Where the worker's body goes: what physics and cost follow from substep to substep."""

    position_world: Points3
    """(B, T, W, S, 3) origins of the 22 body segments after every substep [m]."""
    quaternion_wxyz: QuaternionsWxyz
    """(B, T, W, S, 4) world_from_segment."""


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
    """(K,) [m]."""


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
    capsules_world: Capsules
    """(B, K, 2, 3) [m]."""
    capsule_radius_m: Floats
    """(K,) [m]."""
