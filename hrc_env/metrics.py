"""What really happened: cost, separation and tracking error, counted on the truth."""

from dataclasses import dataclass

import numpy as np

from hrc_env.errors import ConfigError
from hrc_env.geometry.distances import narrowest_gap
from hrc_env.records import PoseEstimate, WorkerTruth
from hrc_env.typing import Bools, Capsules, Floats


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
    """Smallest true gap of the step; infinite without workers."""

    @property
    def total(self) -> Floats:
        """(B,) sum of the parts."""
        return self.proximity + self.contact


def cost(
    robot_capsules_world: Capsules, radius_m: Floats, truth: WorkerTruth, config: CostConfig
) -> Cost:
    """Cost of a step from the true bodies at every substep.

    Contact is decided by distance: a mocap hand can pass through a thin arm between two
    substeps of the contact solver.

    Args:
        robot_capsules_world: (B, T, K, 2, 3) at every substep [m].
        radius_m: (K,) of the robot's capsules.
        truth: the workers at the same times, (B, T, W, ...).
    """
    batch, steps = robot_capsules_world.shape[:2]
    bodies = truth.capsules_world.reshape(batch, steps, -1, 2, 3)
    gap = narrowest_gap(robot_capsules_world, radius_m, bodies, truth.capsule_radius_m)
    nearest_m = gap.distance_m.min(axis=1)
    return Cost(
        proximity=(nearest_m < config.proximity_m).astype(float),
        contact=(nearest_m <= 0.0).astype(float),
        min_separation_m=nearest_m,
    )


def tracking_error(estimate: PoseEstimate, truth: WorkerTruth) -> tuple[Floats, Bools]:
    """Mean joint position error of the tracked workers.

    Returns:
        (B,) mean over tracked workers and joints [m], NaN where nobody is tracked, and
        (B,) whether a worker is there whom the estimator does not track.
    """
    error_m = np.linalg.norm(estimate.mean_world - truth.joints_world, axis=-1).mean(-1)
    n_tracked = estimate.tracked.sum(-1)
    summed = np.where(estimate.tracked, error_m, 0.0).sum(-1)
    mean = np.where(n_tracked > 0, summed / np.maximum(n_tracked, 1), np.nan)
    lost: Bools = np.logical_not(estimate.tracked.all(-1))
    return mean, lost
