"""What a robot believes in one step: itself, its task and the estimate. No truth in here."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.records import PoseEstimate, RobotState
from hrc_env.core.skeleton import SEGMENT_RADIUS_M
from hrc_env.core.typing import Floats
from hrc_env.geometry.distances import Separation, least_separation, segments


@dataclass(frozen=True, slots=True)
class Belief:
    """Everything a robot may know in one step: itself, its task, and the estimate."""

    robot: RobotState
    estimate: PoseEstimate
    separation: Separation
    """(B, W) narrowest place between the robot and each *estimated* body."""
    task: Any
    """What the task says to the robot (`Task.view`)."""
    action: Floats
    """(B, A) the last action, in [-1, 1]."""
    forecast: tuple[PoseEstimate, ...] = ()
    """What is expected of the workers at each of `HRCConfig.forecast_s` from now."""


def estimated_separation(robot: RobotState, estimate: PoseEstimate) -> Separation:
    """(B, W) narrowest place between the robot's capsules and each estimated body, hands included.

    A worker without a track is infinitely far: the robot knows of nothing to keep away from.
    """
    bodies = segments(estimate.mean_world)
    nearest = least_separation(
        robot.capsules_world, robot.capsule_radius_m, bodies, SEGMENT_RADIUS_M
    )
    return Separation(
        np.where(estimate.tracked, nearest.distance_m, np.inf),
        nearest.point_a_world,
        nearest.point_b_world,
    )


def standard_deviation_m(estimate: PoseEstimate) -> Floats:
    """(B, W, J) root of the mean variance over the axes [m]."""
    cov = estimate.cov_world
    return np.sqrt((cov[..., 0, 0] + cov[..., 1, 1] + cov[..., 2, 2]) / 3.0)
