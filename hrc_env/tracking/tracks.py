"""What the estimators without hypotheses keep of a worker, and how all of them age and report."""

import math
from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Covariances3, Floats, Ints, Points3, Velocities3
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.settings import settings_of

_J = N_JOINTS
TRACK = np.dtype(
    [
        # position [m], its covariance [m^2] and velocity [m/s]
        ("mean_world", "f8", (_J, 3)), ("cov_world", "f8", (_J, 3, 3)),
        ("velocity_world", "f8", (_J, 3)),
        # since a measurement supported the joint [s]; updates in a row in which views did not
        ("age_s", "f8", (_J,)), ("conflict", "i8", (_J,)), ("tracked", "?"),
    ],
    align=True,
)  # fmt: skip
"""What is believed of one worker."""


class EstimateArrays(NamedTuple):
    """The arrays of a `PoseEstimate` that estimators fill, as compiled functions take them."""

    mean_world: Points3
    """(B, W, J, 3) positions in the world frame [m]."""
    cov_world: Covariances3
    """(B, W, J, 3, 3) covariances of the positions [m^2]."""
    velocity_world: Velocities3
    """(B, W, J, 3) velocities in the world frame [m/s]."""
    age_s: Floats
    """(B, W, J) time since a measurement last supported the joint [s]."""
    tracked: Bools
    """(B, W) whether the worker is tracked."""


REPORTED = ("mean_world", "cov_world", "velocity_world", "age_s", "tracked")
"""Fields of a `PoseEstimate` that tracks hold."""
_ROUNDING = 1e-6
"""Least eigenvalues may be wrong by no more than this share of the largest."""


def make_tracks(batch: int, n_workers: int, config: TrackerConfig) -> Any:
    """(B, W) records of `TRACK`, of workers whom nobody has seen."""
    tracks = np.zeros((batch, n_workers), TRACK)
    forget(tracks, np.arange(batch), config)
    return tracks


def forget(tracks: Any, ids: Ints, config: TrackerConfig) -> None:
    """Put environments `ids` back to the prior."""
    fresh = np.zeros((), TRACK)
    fresh["mean_world"] = config.prior_mean_world
    fresh["cov_world"] = config.prior_std_m**2 * np.eye(3)
    fresh["age_s"] = config.max_age_s
    tracks[ids] = fresh


def grow_older(tracks: Any, dt_s: float, config: TrackerConfig) -> None:
    """Count ages up, give up tracks that nothing supports, let lost ones relax to the prior.

    A lost worker's mean and covariance follow an Ornstein-Uhlenbeck process whose stationary
    distribution is the prior.
    """
    _grow_older(tracks, dt_s, settings_of(config))


@kernel
def _grow_older(tracks, dt, s):
    for b in range(tracks.shape[0]):
        for w in range(tracks.shape[1]):
            t = tracks[b, w]
            gaussian = (t.mean_world, t.cov_world, t.velocity_world)
            t.tracked = age_worker(*gaussian, t.age_s, t.conflict, t.tracked, dt, s)


@kernel
def age_worker(mean, cov, velocity, age, conflict, tracked, dt, s):
    """A worker (J, ...) gets older by dt [s], in place; whether they are still tracked.

    `s` are `settings.Settings`.
    """
    youngest = count_up(age, dt, s.max_age_s)
    if tracked and youngest < s.lost_after_s - 1e-9:
        return True
    for j in range(len(conflict)):
        conflict[j] = 0
    relax(mean, cov, velocity, np.exp(-dt / s.forget_s), s.prior_mean_world, s.prior_std_m)
    return False


@kernel
def count_up(age, dt, most):
    """Ages (J,) dt [s] later, in place; the youngest."""
    youngest = np.inf
    for j in range(len(age)):
        age[j] = min(age[j] + dt, most)
        youngest = min(youngest, age[j])
    return youngest


@kernel
def relax(mean, cov, velocity, keep, home, std):
    """A body (J, ...) that nobody follows keeps a share of what was known; the rest is prior."""
    for j in range(len(mean)):
        for i in range(3):
            mean[j, i] = home[i] + keep * (mean[j, i] - home[i])
            velocity[j, i] *= keep
            for k in range(3):
                cov[j, i, k] *= keep * keep
            cov[j, i, i] += (1.0 - keep * keep) * std * std


def as_estimate(tracks: Any) -> PoseEstimate:
    """The tracks in arrays of their own."""
    return PoseEstimate(*(tracks[name].copy() for name in REPORTED))


def report(tracks: Any, config: TrackerConfig) -> PoseEstimate:
    """The tracks as others may see them."""
    return bounded(as_estimate(tracks), config)


def bounded(estimate: PoseEstimate, config: TrackerConfig) -> PoseEstimate:
    """An estimate whose covariances were put, in place, between the floor and the prior."""
    _bound_all(estimate.cov_world, config.min_std_m, config.prior_std_m)
    return estimate


@kernel
def _bound_all(cov, least_std, most_std):
    for b in range(cov.shape[0]):
        for w in range(cov.shape[1]):
            bound(cov[b, w], least_std, most_std)


@kernel
def bound(cov, least_std, most_std):
    """Make covariances (J, 3, 3) no narrower and no wider than these [m], in place.

    Only their upper halves are looked at.
    """
    floor, ceiling = least_std * least_std, most_std * most_std
    for j in range(len(cov)):
        widest = max(cov[j, 0, 0], cov[j, 1, 1], cov[j, 2, 2])
        scale = min(1.0, ceiling / widest)
        for i in range(3):
            for k in range(i, 3):
                cov[j, i, k] = cov[j, k, i] = scale * cov[j, i, k]
        if not _is_wider(cov[j], floor + _ROUNDING * widest):
            missing = max(floor - least_eigenvalue(cov[j]), 0.0)
            for i in range(3):
                cov[j, i, i] += missing


@kernel
def _is_wider(a, floor):
    """Whether every eigenvalue of a symmetric 3x3 matrix is above `floor`, without any root."""
    x, y, z = a[0, 0] - floor, a[1, 1] - floor, a[2, 2] - floor
    f, g, h = a[0, 1], a[0, 2], a[1, 2]
    determinant = x * (y * z - h * h) - f * (f * z - g * h) + g * (f * h - g * y)
    return x > 0.0 and x * y - f * f > 0.0 and determinant > 0.0


@kernel
def least_eigenvalue(a):
    """Smallest eigenvalue of a symmetric 3x3 matrix (Smith, Comm. ACM 4, 1961)."""
    mean = (a[0, 0] + a[1, 1] + a[2, 2]) / 3.0
    x, y, z = a[0, 0] - mean, a[1, 1] - mean, a[2, 2] - mean
    f, g, h = a[0, 1], a[0, 2], a[1, 2]
    size = math.sqrt((x * x + y * y + z * z + 2.0 * (f * f + g * g + h * h)) / 6.0)
    if not size > 0.0:
        return mean
    determinant = x * (y * z - h * h) - f * (f * z - g * h) + g * (f * h - g * y)
    cosine = min(max(0.5 * determinant / size**3, -1.0), 1.0)
    return mean + 2.0 * size * math.cos((math.acos(cosine) + 2.0 * math.pi) / 3.0)
