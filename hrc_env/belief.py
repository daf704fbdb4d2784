"""The belief of a robot in one step: the robot's state, its task and the estimate of the workers.

It never contains the truth about the workers.
"""

import math
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.batching import change_fields
from hrc_env.core.kernels import kernel
from hrc_env.core.lending import read_only
from hrc_env.core.records import HandState, ObjectState, PoseEstimate, RobotState
from hrc_env.core.typing import Bools, Capsules, Floats, Ints, JointVelocities, Points3
from hrc_env.core.vacancy import EMPTY, POSSIBLE, STATURE_M, WALKING_M_S, Coverage, Others, Vacancy
from hrc_env.geometry.distances import Separation, closest_parameters, least_separation
from hrc_env.geometry.enclosure import enclose
from hrc_env.geometry.robot_model import RobotModel

PERSON_M = 0.5
"""Radius of the floor area that a person occupies around the hips [m]."""
NEAR_FLOOR_M = 1.5
"""Distance from a robot beyond which unseen floor is ignored [m]."""
_LAST = threading.local()
"""The last belief that was passed to a user's function, in each thread."""


@dataclass(frozen=True, slots=True, eq=False)
class UnseenFloor:
    """Patches of floor on which a person without a track may be.

    Such a person belongs to an unknown slot without a last sighting, or exceeds the number of
    slots.
    """

    floor_world: Points3
    """(N, 3) centres of the patches of floor [m]."""
    piece_m: float
    """Distance between the centre of a patch and its corners [m]."""
    level: Ints
    """(B, N) state of each patch: `POSSIBLE`, `PROBABLY_EMPTY` or `EMPTY`."""
    age_s: Floats
    """(B,) age of the oldest image from which these states were determined [s]."""
    possible_m: Floats
    """(B,) distance between the robot's surface and the space above the nearest `POSSIBLE` patch
    [m]; infinite beyond `NEAR_FLOOR_M`."""
    probable_m: Floats
    """(B,) distance between the robot's surface and the space above the nearest `PROBABLY_EMPTY`
    patch [m]; infinite beyond `NEAR_FLOOR_M`."""


@dataclass(frozen=True, slots=True)
class Belief:
    """Information that is available to a robot in one step."""

    robot: RobotState
    """Joints, tool and surface of the robot, as measured by the robot's encoders."""
    estimate: PoseEstimate
    """(B, W, ...) estimate of the workers from the cameras' images."""
    separation: Separation
    """(B, W) separation of the robot from each *estimated* body."""
    task: Any
    """The robot's knowledge about its task, as returned by `Task.view`."""
    action: Floats
    """(B, A) last action of the agent, in [-1, 1], before any shield."""
    hand: HandState | None = None
    """State of the hand; None for a robot without a hand."""
    objects: ObjectState | None = None
    """Measured state of the task's loose objects; None for a task without loose objects."""
    forecast: tuple[PoseEstimate, ...] = ()
    """Forecasts of the workers' poses, one for each horizon in `HRCConfig.forecast_s`."""
    command: JointVelocities | None = None
    """(B, N) joint velocities that are currently commanded [rad/s]."""
    shield_change: JointVelocities | None = None
    """(B, N) joint velocities that the shield allowed in the last step minus those that the agent
    commanded [rad/s]; 0 without a shield."""
    model: RobotModel | None = None
    """Geometry, limits and masses of the robot, which are constant."""
    allowed_contact: Bools | None = None
    """Mask (B, W, S) of the segments of the estimated bodies that may touch the robot's hand; None
    if no contact is allowed."""
    unseen: UnseenFloor | None = None
    """Patches of floor on which an undetected person may be; None without cameras, in which case
    the person may be anywhere."""


def lend_belief(belief: Belief) -> Belief:
    """Return a view of a belief with read-only arrays, for functions that users provide."""
    if getattr(_LAST, "belief", None) is not belief:  # several terms receive the same belief
        _LAST.lent = read_only(belief, constants=("model",))
        _LAST.belief = belief
    return _LAST.lent


def estimated_separation(robot: RobotState, estimate: PoseEstimate) -> Separation:
    """Return the separation (B, W) of each robot from each estimated body, including its hands.

    The distance is infinite for a worker without a track. `PoseEstimate.unknown` marks the slots
    for which an undetected person may be near.
    """
    bodies = enclose(estimate.mean_world)
    nearest = least_separation(
        robot.capsules_world, robot.capsule_radius_m, bodies.ends_world, bodies.radius_m
    )
    return change_fields(nearest, distance_m=np.where(estimate.tracked, nearest.distance_m, np.inf))


def find_unseen_floor(
    robot: RobotState, estimate: PoseEstimate, vacancy: Vacancy | None
) -> UnseenFloor | None:
    """Find the patches of floor that were not seen to be empty, and their distance from each robot.

    The function considers unknown slots without a last sighting, and people in excess of the slots.

    Args:
        robot: (B, ...) state of the robots.
        estimate: (B, W, ...) estimate of the workers.
        vacancy: state of the floor; None without cameras.

    Returns:
        The patches with their states and distances; None without cameras.
    """
    if vacancy is None:
        return None
    coverage, others = vacancy.coverage, vacancy.others
    is_unseen = estimate.unknown & _never_seen(estimate)
    level = np.full((len(is_unseen), len(coverage.group)), EMPTY)
    gaps, age_s = np.full((len(is_unseen), EMPTY), np.inf), np.zeros(len(is_unseen))
    if is_unseen.any() or others.any.any():
        of_group = np.where(is_unseen[..., None], vacancy.level, EMPTY).min(1)
        level = of_group[:, coverage.group]
        level[_reachable(others, coverage)] = POSSIBLE
        age_s = np.where(is_unseen, vacancy.age_s, 0.0).max(1)
        capsules, radius_m = robot.capsules_world, robot.capsule_radius_m
        _find_nearest_floor(capsules, radius_m, coverage.floor_world, coverage.piece_m, level, gaps)
    return UnseenFloor(coverage.floor_world, coverage.piece_m, level, age_s, gaps[:, 0], gaps[:, 1])


def drop_distant_unknown(estimate: PoseEstimate, unseen: UnseenFloor | None) -> PoseEstimate:
    """Return an estimate in which a slot is unknown only if an undetected person may be near."""
    if unseen is None:
        return estimate
    far = np.isinf(unseen.possible_m) & np.isinf(unseen.probable_m)
    elsewhere = far[:, None] & (_never_seen(estimate) | estimate.tracked)
    return change_fields(estimate, unknown=estimate.unknown & ~elsewhere)


def _never_seen(estimate: PoseEstimate) -> Bools:
    """Return a mask (B, W) of the slots without a last sighting."""
    return np.isnan(estimate.seen_world[..., 0, 0])


def _reachable(others: Others, coverage: Coverage) -> Bools:
    """Return a mask (B, N) of the patches that people in excess of the slots may have reached."""
    off_xy_m = coverage.floor_world[:, None, :2] - others.hips_world[:, None, :, :2]
    reach_m = PERSON_M + WALKING_M_S * np.where(np.isinf(others.age_s), 0.0, others.age_s)
    return (np.linalg.norm(off_xy_m, axis=-1) < reach_m[:, None]).any(-1)


@kernel(makes_arrays=True)
def _find_nearest_floor(
    capsules: Capsules, radius: Floats, floor: Points3, piece_m: float, level: Ints, gaps: Floats
) -> None:
    """Compute the gaps between robots and the space above the nearest patch of each state.

    Args:
        capsules: (B, K, 2, 3) capsules of the robots [m].
        radius: (K,) radii of the capsules [m].
        floor: (N, 3) centres of the patches of floor [m].
        piece_m: distance between the centre of a patch and its corners [m].
        level: (B, N) state of each patch.
        gaps: (B, `EMPTY`) smallest gap for each state of a patch [m], updated in place.
    """
    head = np.empty(3)
    for b in range(len(capsules)):
        for n in range(len(floor)):
            state = level[b, n]
            if state == EMPTY:
                continue
            head[0], head[1], head[2] = floor[n, 0], floor[n, 1], floor[n, 2] + STATURE_M
            for k in range(capsules.shape[1]):
                closest = closest_parameters(capsules[b, k, 0], capsules[b, k, 1], floor[n], head)
                gap = math.sqrt(closest.squared_distance) - radius[k] - piece_m
                if gap < NEAR_FLOOR_M:
                    gaps[b, state] = min(gaps[b, state], gap)


def standard_deviation_m(estimate: PoseEstimate) -> Floats:
    """Return the standard deviation (B, W, J) of each joint [m].

    It is the square root of the mean variance along the three axes.
    """
    cov = estimate.cov_world
    return np.sqrt((cov[..., 0, 0] + cov[..., 1, 1] + cov[..., 2, 2]) / 3.0)


def deviation_towards_robot_m(robot: RobotState, estimate: PoseEstimate) -> Floats:
    """Return the standard deviation (B, W, J) of each joint in the direction of the robot [m].

    It is sqrt(n' C n), where C is the joint's covariance and n the unit vector from its mean to the
    nearest point on the axis of the robot's nearest capsule. For a joint that lies on this axis, n
    is undefined, and `standard_deviation_m` is returned.
    """
    points = np.repeat(estimate.mean_world[..., None, None, :], 2, axis=-2)
    nearest = least_separation(robot.capsules_world, robot.capsule_radius_m, points, np.zeros(1))
    towards = nearest.point_a_world - estimate.mean_world
    away_m = np.linalg.norm(towards, axis=-1)
    squared = (towards[..., None, :] @ estimate.cov_world @ towards[..., None])[..., 0, 0]
    along = np.sqrt(squared) / np.where(away_m > 0, away_m, 1.0)
    return np.where(away_m > 0, along, standard_deviation_m(estimate))


def covariance_factor_m(estimate: PoseEstimate) -> Floats:
    """Return the Cholesky factor L of each covariance L L' [m].

    Unlike principal axes and their standard deviations, its entries are continuous functions of the
    covariance.

    Returns:
        (B, W, J, 6) entries xx, yx, yy, zx, zy, zz.
    """
    return np.asarray(np.linalg.cholesky(estimate.cov_world)[..., *np.tril_indices(3)], float)
