"""What really happened: cost, separation and tracking error, counted on the truth."""

import math
from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate, WorkerTruth
from hrc_env.core.typing import Bools, Capsules, Floats
from hrc_env.geometry.assignment import assign_rows
from hrc_env.geometry.distances import least_separation


@dataclass(frozen=True, slots=True)
class CostConfig:
    """What counts as unsafe, and what happens then."""

    proximity_m: float = 0.15
    """A step costs 1 when the true surfaces come nearer than this [m]."""
    contact_terminates: bool = False
    """Whether a contact ends the episode."""

    def __post_init__(self) -> None:
        if self.proximity_m < 0:
            raise ConfigError(f"CostConfig.proximity_m must be >= 0, got {self.proximity_m}.")


@dataclass(frozen=True, slots=True)
class Cost:
    """The cost of one step, per environment (B,)."""

    proximity: Floats
    contact: Floats
    min_separation_m: Floats
    """Smallest true separation of the step; infinite without workers."""

    @property
    def total(self) -> Floats:
        """(B,) sum of the parts."""
        return self.proximity + self.contact


def cost(
    robot_world: Capsules,
    robot_radius_m: Floats,
    workers_world: Capsules,
    worker_radius_m: Floats,
    config: CostConfig,
) -> Cost:
    """Cost of a step: of the robot's capsules (B, T, K, 2, 3) and radii (K,), and of the workers'
    true ones (B, T, W, L, 2, 3) and (B, W, L), at every substep [m].

    Contact is decided by distance: a mocap hand can pass through a thin arm between two
    substeps of the contact solver.
    """
    batch, steps = robot_world.shape[:2]
    bodies = workers_world.reshape(batch, steps, -1, 2, 3)
    radii_m = worker_radius_m.reshape(batch, -1)
    nearest = least_separation(robot_world, robot_radius_m, bodies, radii_m)
    nearest_m = nearest.distance_m.min(axis=1)
    return Cost(
        proximity=(nearest_m < config.proximity_m).astype(float),
        contact=(nearest_m <= 0.0).astype(float),
        min_separation_m=nearest_m,
    )


def tracking_error(
    estimate: PoseEstimate, truth: WorkerTruth, present: Bools
) -> tuple[Floats, Bools]:
    """(B,) mean error of joints between tracks and the workers whom they fit best [m], NaN where
    nobody is tracked; and (B,) whether a worker who is there (`present` (B, W)) has no track."""
    tracked = estimate.tracked
    error_m, lost = np.empty(len(tracked)), np.zeros(len(tracked), np.bool_)
    _tracking_error(estimate.mean_world, truth.joints_world, tracked, present, error_m, lost)
    return error_m, lost


@kernel(makes_arrays=True)
def _tracking_error(mean_world, joints_world, tracked, there, error_m, lost):
    n_workers, n_joints = tracked.shape[1], mean_world.shape[2]
    error, whom = np.empty((n_workers, n_workers)), np.empty(n_workers, np.int64)
    for b in range(tracked.shape[0]):
        total, count, wanted = 0.0, 0, 0
        for w in range(n_workers):
            wanted += there[b, w]
            if tracked[b, w]:
                for k in range(n_workers):
                    error[count, k] = _joint_error(mean_world[b, w], joints_world[b, k])
                count += 1
        lost[b] = count < wanted
        assign_rows(error[:count], whom)
        for row in range(count):
            total += error[row, whom[row]]
        error_m[b] = total / (count * n_joints) if count else np.nan


@kernel
def _joint_error(mean_world, joints_world):
    """Sum over joints of the distances between two bodies [m]."""
    total = 0.0
    for j in range(mean_world.shape[0]):
        squared = 0.0
        for i in range(3):
            squared += (mean_world[j, i] - joints_world[j, i]) ** 2
        total += math.sqrt(squared)
    return total
