"""What a robot believes in one step: itself, its task and the estimate. No truth in here."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hrc_env.core.records import HandState, ObjectState, PoseEstimate, RobotState
from hrc_env.core.skeleton import SEGMENT_RADIUS_M
from hrc_env.core.typing import Bools, Floats, JointVelocities
from hrc_env.geometry.distances import Separation, least_separation, segments
from hrc_env.safety.robot import RobotModel


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
    """(B, A) the last action, in [-1, 1], as the agent wanted it."""
    hand: HandState | None = None
    """Its gripper, if it has one."""
    objects: ObjectState | None = None
    """The task's loose objects as they are measured, if there are any."""
    forecast: tuple[PoseEstimate, ...] = ()
    """What is expected of the workers at each of `HRCConfig.forecast_s` from now."""
    command: JointVelocities | None = None
    """(B, N) the joint velocities that are in force [rad/s]."""
    shield_change: JointVelocities | None = None
    """(B, N) what the shield gave in the last step less what was asked for [rad/s]; 0 without."""
    model: RobotModel | None = None
    """What the robot knows of itself for good."""
    welcome: Callable[["Belief"], Bools] | None = None
    """Who may come to its hand (`Task.welcome`)."""


def estimated_separation(robot: RobotState, estimate: PoseEstimate) -> Separation:
    """(B, W) narrowest place between the robot's capsules and each estimated body, hands included.

    A worker without a track is infinitely far: where they are is not known. Whether one may be
    there all the same says `PoseEstimate.unknown`.
    """
    bodies = segments(estimate.mean_world)
    nearest = least_separation(
        robot.capsules_world, robot.capsule_radius_m, bodies, SEGMENT_RADIUS_M
    )
    return replace(nearest, distance_m=np.where(estimate.tracked, nearest.distance_m, np.inf))


def standard_deviation_m(estimate: PoseEstimate) -> Floats:
    """(B, W, J) root of the mean variance over the axes [m]."""
    cov = estimate.cov_world
    return np.sqrt((cov[..., 0, 0] + cov[..., 1, 1] + cov[..., 2, 2]) / 3.0)


def deviation_towards_robot_m(robot: RobotState, estimate: PoseEstimate) -> Floats:
    """(B, W, J) sqrt(n' C n) [m]: n is the unit vector from a joint's mean to the nearest point on
    the axes of the robot's capsules, of that whose surface is nearest; C is its covariance. A joint
    on an axis has no such direction: there the root of the mean variance."""
    points = np.repeat(estimate.mean_world[..., None, None, :], 2, axis=-2)
    nearest = least_separation(robot.capsules_world, robot.capsule_radius_m, points, np.zeros(1))
    towards = nearest.point_a_world - estimate.mean_world
    away_m = np.linalg.norm(towards, axis=-1)
    squared = (towards[..., None, :] @ estimate.cov_world @ towards[..., None])[..., 0, 0]
    along = np.sqrt(squared) / np.where(away_m > 0, away_m, 1.0)
    return np.where(away_m > 0, along, standard_deviation_m(estimate))


def covariance_factor_m(estimate: PoseEstimate) -> Floats:
    """(B, W, J, 6) Cholesky factor L of each covariance L L' [m]: xx, yx, yy, zx, zy, zz.

    Six numbers that hold all of it and, unlike axes and their deviations, change continuously.
    """
    return np.asarray(np.linalg.cholesky(estimate.cov_world)[..., *np.tril_indices(3)], float)
