"""What a robot believes in one step: itself, its task and the estimate. No truth in here."""

import math
import threading
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.lending import read_only
from hrc_env.core.records import HandState, ObjectState, PoseEstimate, RobotState
from hrc_env.core.skeleton import SEGMENT_RADIUS_M
from hrc_env.core.typing import Bools, Floats, Ints, JointVelocities, Points3
from hrc_env.core.vacancy import EMPTY, POSSIBLE, STATURE_M, WALKING_M_S, Coverage, Others, Vacancy
from hrc_env.geometry.distances import (
    Separation,
    closest_parameters,
    least_separation,
    segments,
)
from hrc_env.geometry.robot_model import RobotModel

PERSON_M = 0.5
"""Distance of the floor that people take up from their hips [m]."""
NEAR_FLOOR_M = 1.5
"""Floor farther from a robot than this is of no concern [m]."""
_LAST = threading.local()
"""The belief that was lent last, in each thread."""


@dataclass(frozen=True, slots=True, eq=False)
class UnseenFloor:
    """The floor on which a person without a track may be: of unknown slots without a last sighting,
    and of people beyond the slots."""

    floor_world: Points3
    """(N, 3) centres of pieces of floor [m]."""
    piece_m: float
    """Distance of a piece's centre from its corners [m]."""
    level: Ints
    """(B, N) the state of each piece: `POSSIBLE`, `PROBABLY_EMPTY` or `EMPTY`."""
    age_s: Floats
    """(B,) age of the oldest look behind these states [s]."""
    possible_m: Floats
    """(B,) distance of the robot's surface from the space above the nearest `POSSIBLE` piece [m];
    infinite beyond `NEAR_FLOOR_M`."""
    probable_m: Floats
    """(B,) the same for the nearest `PROBABLY_EMPTY` piece [m]."""


@dataclass(frozen=True, slots=True)
class Belief:
    """Everything a robot may know in one step: itself, its task, and the estimate."""

    robot: RobotState
    """Joints, tool and surface of the robot, by its own encoders."""
    estimate: PoseEstimate
    """The workers as the cameras show them: (B, W, ...)."""
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
    allowed_contact: Bools | None = None
    """(B, W, S) which segments of estimated bodies may touch its hand; None: none of them."""
    unseen: UnseenFloor | None = None
    """Where an undetected person may be; None: anywhere."""


def lent_belief(now: Belief) -> Belief:
    """Return a belief with read-only arrays, for functions of users."""
    if getattr(_LAST, "now", None) is not now:  # several terms are given the same one
        _LAST.lent = read_only(now, constants=("model",))
        _LAST.now = now
    return _LAST.lent


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


def unseen_floor(
    robot: RobotState, estimate: PoseEstimate, vacancy: Vacancy | None
) -> UnseenFloor | None:
    """Find the floor that was not seen empty, and its distance from each robot.

    Only unknown slots without a last sighting count; for the others the floor is `EMPTY`. None
    without cameras that could say.
    """
    if vacancy is None:
        return None
    coverage, others = vacancy.coverage, vacancy.others
    asked = estimate.unknown & _never_seen(estimate)
    level = np.full((len(asked), len(coverage.group)), EMPTY)
    gaps, age_s = np.full((len(asked), EMPTY), np.inf), np.zeros(len(asked))
    if asked.any() or others.any.any():
        of_group = np.where(asked[..., None], vacancy.level, EMPTY).min(1)
        level = of_group[:, coverage.group]
        level[_reached(others, coverage)] = POSSIBLE
        age_s = np.where(asked, vacancy.age_s, 0.0).max(1)
        capsules, radius_m = robot.capsules_world, robot.capsule_radius_m
        _nearest_floor(capsules, radius_m, coverage.floor_world, coverage.piece_m, level, gaps)
    return UnseenFloor(coverage.floor_world, coverage.piece_m, level, age_s, gaps[:, 0], gaps[:, 1])


def of_concern(estimate: PoseEstimate, unseen: UnseenFloor | None) -> PoseEstimate:
    """Return the estimate in which slots are unknown only if the undetected person may be near."""
    if unseen is None:
        return estimate
    far = np.isinf(unseen.possible_m) & np.isinf(unseen.probable_m)
    elsewhere = far[:, None] & (_never_seen(estimate) | estimate.tracked)
    return replace(estimate, unknown=estimate.unknown & ~elsewhere)


def _never_seen(estimate: PoseEstimate) -> Bools:
    return np.isnan(estimate.seen_world[..., 0, 0])


def _reached(others: Others, coverage: Coverage) -> Bools:
    """Return (B, N) the pieces of floor where people beyond the slots may be by now."""
    off_xy_m = coverage.floor_world[:, None, :2] - others.hips_world[:, None, :, :2]
    reach_m = PERSON_M + WALKING_M_S * np.where(np.isinf(others.age_s), 0.0, others.age_s)
    return (np.linalg.norm(off_xy_m, axis=-1) < reach_m[:, None]).any(-1)


@kernel(makes_arrays=True)
def _nearest_floor(capsules, radius, floor, piece_m, level, gaps):
    """Write the gaps (B, 2) between capsules (B, K, 2, 3) and the floor (N, 3) of each level."""
    head = np.empty(3)
    for b in range(len(capsules)):
        for n in range(len(floor)):
            now = level[b, n]
            if now == EMPTY:
                continue
            head[0], head[1], head[2] = floor[n, 0], floor[n, 1], floor[n, 2] + STATURE_M
            for k in range(capsules.shape[1]):
                squared, _, _ = closest_parameters(
                    capsules[b, k, 0], capsules[b, k, 1], floor[n], head
                )
                gap = math.sqrt(squared) - radius[k] - piece_m
                if gap < NEAR_FLOOR_M:
                    gaps[b, now] = min(gaps[b, now], gap)


def standard_deviation_m(estimate: PoseEstimate) -> Floats:
    """Return the standard deviation of each joint [m], (B, W, J).

    It is the root of the mean variance over the axes.
    """
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
