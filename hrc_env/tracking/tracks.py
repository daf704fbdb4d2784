"""Tracks of the estimators without hypotheses, and functions that age and report all tracks."""

import math
from typing import Annotated, NamedTuple

import numpy as np

from hrc_env.core.declared import Records2, dtype_of, make_records
from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Covariances3, Floats, Ints, Points3, Velocities3
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.settings import Settings, make_settings

_ROUNDING = 1e-6
"""Tolerance for the smallest eigenvalue, as a fraction of the largest variance."""


class Track:
    """The estimate of one worker, and the number of successive contradictions of each joint."""

    mean_world: Annotated[Points3, (N_JOINTS, 3)]
    """Position of each joint in the world frame [m]."""
    cov_world: Annotated[Covariances3, (N_JOINTS, 3, 3)]
    """Covariance of each joint's position [m^2]."""
    velocity_world: Annotated[Velocities3, (N_JOINTS, 3)]
    """Velocity of each joint in the world frame [m/s]."""
    age_s: Annotated[Floats, (N_JOINTS,)]
    """Time since a measurement last supported the joint [s]."""
    conflict: Annotated[Ints, (N_JOINTS,)]
    """Number of successive updates in which views contradicted the joint."""
    tracked: bool
    """Whether the worker is tracked; if not, the estimate relaxes to the prior."""


TRACK = dtype_of(Track)


class EstimateArrays(NamedTuple):
    """The arrays of a `PoseEstimate` that estimators fill in, as a tuple for compiled functions."""

    mean_world: Points3
    """(B, W, J, 3) positions in the world frame [m]."""
    cov_world: Covariances3
    """(B, W, J, 3, 3) covariances of the positions [m^2]."""
    velocity_world: Velocities3
    """(B, W, J, 3) velocities in the world frame [m/s]."""
    age_s: Floats
    """(B, W, J) time since a measurement last supported the joint [s]."""
    tracked: Bools
    """(B, W) mask of the tracked workers."""


def get_estimate_arrays(estimate: PoseEstimate) -> EstimateArrays:
    """Return the arrays of an estimate, copied where they are not contiguous."""
    return EstimateArrays(
        mean_world=np.ascontiguousarray(estimate.mean_world, np.float64),
        cov_world=np.ascontiguousarray(estimate.cov_world, np.float64),
        velocity_world=np.ascontiguousarray(estimate.velocity_world, np.float64),
        age_s=np.ascontiguousarray(estimate.age_s, np.float64),
        tracked=np.ascontiguousarray(estimate.tracked),
    )


def make_tracks(batch: int, n_workers: int, config: TrackerConfig) -> Records2[Track]:
    """Return tracks (B, W) of workers that have never been detected.

    Args:
        batch: number of environments B.
        n_workers: number of workers W in each environment.
        config: settings that contain the prior and the maximum age.
    """
    tracks = make_records(Track, (batch, n_workers))
    reset_tracks(tracks, np.arange(batch), config)
    return tracks


def reset_tracks(tracks: Records2[Track], ids: Ints, config: TrackerConfig) -> None:
    """Reset the tracks of some environments to the prior, in place.

    Args:
        tracks: (B, W) tracks of the whole batch.
        ids: indices of the environments to reset.
        config: settings that contain the prior and the maximum age.
    """
    fresh = np.zeros((), TRACK)
    fresh["mean_world"] = config.prior_mean_world
    fresh["cov_world"] = config.prior_std_m**2 * np.eye(3)
    fresh["age_s"] = config.max_age_s
    tracks[ids] = fresh


def age_tracks(tracks: Records2[Track], dt_s: float, config: TrackerConfig) -> None:
    """Increase ages, end tracks that no measurement supports, and relax lost ones to the prior.

    The mean and the covariance of a lost worker follow an Ornstein-Uhlenbeck process with the
    prior as its stationary distribution.

    Args:
        tracks: (B, W) tracks, changed in place.
        dt_s: time that passes [s].
        config: settings that contain the prior, `lost_after_s` and `lost_relaxation_s`.
    """
    _age_tracks(tracks, dt_s, make_settings(config))


@kernel
def _age_tracks(tracks: Records2[Track], dt: float, settings: Settings) -> None:
    """Apply `age_worker` to every track (B, W)."""
    for b in range(tracks.shape[0]):
        for w in range(tracks.shape[1]):
            t = tracks[b, w]
            t.tracked = age_worker(
                t.mean_world,
                t.cov_world,
                t.velocity_world,
                t.age_s,
                t.conflict,
                t.tracked,
                dt,
                settings,
            )


@kernel
def age_worker(
    mean: Points3,
    cov: Covariances3,
    velocity: Velocities3,
    age: Floats,
    conflict: Ints,
    tracked: bool,
    dt: float,
    settings: Settings,
) -> bool:
    """Increase the ages of one worker's joints and return whether the worker is still tracked.

    Args:
        mean: (J, 3) positions [m], relaxed in place if the worker is not tracked.
        cov: (J, 3, 3) covariances [m^2], relaxed in the same way.
        velocity: (J, 3) velocities [m/s], relaxed in the same way.
        age: (J,) ages [s], increased in place.
        conflict: (J,) counts of contradictions, set to zero if the worker is not tracked.
        tracked: whether the worker was tracked before.
        dt: time that passes [s].
        settings: settings that contain the prior, `lost_after_s` and `lost_relaxation_s`.
    """
    youngest = count_up(age, dt, settings.max_age_s)
    if tracked and youngest < settings.lost_after_s - 1e-9:
        return True
    for j in range(len(conflict)):
        conflict[j] = 0
    keep = np.exp(-dt / settings.lost_relaxation_s)
    relax(mean, cov, velocity, keep, settings.prior_mean_world, settings.prior_std_m)
    return False


@kernel
def count_up(age: Floats, dt: float, max_age: float) -> float:
    """Increase the ages of joints and return the smallest age [s].

    Args:
        age: (J,) ages [s], changed in place.
        dt: time that passes [s].
        max_age: upper bound of the ages [s].
    """
    youngest = np.inf
    for j in range(len(age)):
        age[j] = min(age[j] + dt, max_age)
        youngest = min(youngest, age[j])
    return youngest


@kernel
def relax(
    mean: Points3,
    cov: Covariances3,
    velocity: Velocities3,
    keep: float,
    prior_mean: tuple[float, float, float],
    prior_std: float,
) -> None:
    """Move the estimate of a body towards the prior, in place.

    Args:
        mean: (J, 3) positions [m].
        cov: (J, 3, 3) covariances [m^2].
        velocity: (J, 3) velocities [m/s].
        keep: fraction of the deviation from the prior that remains.
        prior_mean: mean of the prior position [m].
        prior_std: standard deviation of the prior on each axis [m].
    """
    for j in range(len(mean)):
        for i in range(3):
            mean[j, i] = prior_mean[i] + keep * (mean[j, i] - prior_mean[i])
            velocity[j, i] *= keep
            for k in range(3):
                cov[j, i, k] *= keep * keep
            cov[j, i, i] += (1.0 - keep * keep) * prior_std * prior_std


def copy_estimate(tracks: Records2[Track]) -> PoseEstimate:
    """Return the estimate of tracks (B, W) in new arrays."""
    return PoseEstimate(*(tracks[name].copy() for name in EstimateArrays._fields))


def report_tracks(tracks: Records2[Track], config: TrackerConfig) -> PoseEstimate:
    """Return the estimate of tracks (B, W), with the covariances bounded as configured."""
    return bound_estimate(copy_estimate(tracks), config)


def bound_estimate(estimate: PoseEstimate, config: TrackerConfig) -> PoseEstimate:
    """Bound the covariances of an estimate by the settings, in place, and return the estimate."""
    _bound_all(estimate.cov_world, config.min_std_m, config.prior_std_m)
    return estimate


@kernel
def _bound_all(cov: Covariances3, min_std: float, max_std: float) -> None:
    """Apply `bound` to every worker's covariances (B, W, J, 3, 3)."""
    for b in range(cov.shape[0]):
        for w in range(cov.shape[1]):
            bound(cov[b, w], min_std, max_std)


@kernel
def bound(cov: Covariances3, min_std: float, max_std: float) -> None:
    """Bound covariances from below and from above, in place.

    Args:
        cov: (J, 3, 3) covariances [m^2]. Only their upper triangles are read.
        min_std: smallest standard deviation in any direction [m].
        max_std: largest standard deviation on any axis [m].
    """
    floor, ceiling = min_std * min_std, max_std * max_std
    for j in range(len(cov)):
        widest = max(cov[j, 0, 0], cov[j, 1, 1], cov[j, 2, 2])
        scale = min(1.0, ceiling / widest)
        for i in range(3):
            for k in range(i, 3):
                cov[j, i, k] = cov[j, k, i] = scale * cov[j, i, k]
        if not _is_wider(cov[j], floor + _ROUNDING * widest):
            missing = max(floor - find_least_eigenvalue(cov[j]), 0.0)
            for i in range(3):
                cov[j, i, i] += missing


@kernel
def _is_wider(a: Floats, floor: float) -> bool:
    """Return whether all eigenvalues of a symmetric 3x3 matrix exceed `floor`."""
    x, y, z = a[0, 0] - floor, a[1, 1] - floor, a[2, 2] - floor
    f, g, h = a[0, 1], a[0, 2], a[1, 2]
    determinant = x * (y * z - h * h) - f * (f * z - g * h) + g * (f * h - g * y)
    return x > 0.0 and x * y - f * f > 0.0 and determinant > 0.0


@kernel
def find_least_eigenvalue(a: Floats) -> float:
    """Return the smallest eigenvalue of a symmetric 3x3 matrix (Smith, Comm. ACM 4, 1961)."""
    mean = (a[0, 0] + a[1, 1] + a[2, 2]) / 3.0
    x, y, z = a[0, 0] - mean, a[1, 1] - mean, a[2, 2] - mean
    f, g, h = a[0, 1], a[0, 2], a[1, 2]
    size = math.sqrt((x * x + y * y + z * z + 2.0 * (f * f + g * g + h * h)) / 6.0)
    if not size > 0.0:
        return mean
    determinant = x * (y * z - h * h) - f * (f * z - g * h) + g * (f * h - g * y)
    cosine = min(max(0.5 * determinant / size**3, -1.0), 1.0)
    return mean + 2.0 * size * math.cos((math.acos(cosine) + 2.0 * math.pi) / 3.0)
