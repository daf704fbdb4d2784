"""What every estimator keeps of a worker, and how it ages, is lost and is reported."""

import math
from dataclasses import dataclass
from typing import Protocol

import numba
import numpy as np

from hrc_env.records import PoseEstimate
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.given import prior
from hrc_env.typing import Bools, Covariances3, Floats, Ints, Points3, Velocities3

_JIT = {"cache": True, "nogil": True, "error_model": "numpy"}


@dataclass(frozen=True, slots=True)
class Tracks:
    """One track per worker; the arrays are changed in place."""

    mean_world: Points3
    """(B, W, J, 3) [m]."""
    cov_world: Covariances3
    """(B, W, J, 3, 3) [m^2]."""
    velocity_world: Velocities3
    """(B, W, J, 3) [m/s]."""
    age_s: Floats
    """(B, W, J) seconds since a measurement supported the joint."""
    tracked: Bools
    """(B, W)."""
    conflict: Ints
    """(B, W, J) updates in a row in which views were there and did not support the joint."""


def make_tracks(batch: int, n_workers: int, config: TrackerConfig) -> Tracks:
    """Tracks of workers whom nobody has seen: the prior."""
    start = prior(batch, n_workers, config)
    return Tracks(
        mean_world=start.mean_world,
        cov_world=start.cov_world,
        velocity_world=start.velocity_world,
        age_s=start.age_s,
        tracked=start.tracked,
        conflict=np.zeros(start.age_s.shape, np.int64),
    )


class GaussianState(Protocol):
    """A state that holds Gaussians over positions and velocities."""

    @property
    def body(self) -> Floats:
        """(B, W, J, 6) position [m] and velocity [m/s]."""
        ...

    @property
    def cov(self) -> Floats:
        """(B, W, J, 6, 6)."""
        ...

    @property
    def age_s(self) -> Floats:
        """(B, W, J)."""
        ...

    @property
    def tracked(self) -> Bools:
        """(B, W)."""
        ...

    @property
    def conflict(self) -> Ints:
        """(B, W, J)."""
        ...


def gaussian_tracks(state: GaussianState) -> Tracks:
    """The part of a state that all estimators share, as views into it."""
    return Tracks(
        mean_world=state.body[..., :3],
        cov_world=state.cov[..., :3, :3],
        velocity_world=state.body[..., 3:],
        age_s=state.age_s,
        tracked=state.tracked,
        conflict=state.conflict,
    )


def forget(tracks: Tracks, ids: Ints, config: TrackerConfig) -> None:
    """Put environments `ids` back to the prior."""
    tracks.mean_world[ids] = config.prior_mean_world
    tracks.cov_world[ids] = config.prior_std_m**2 * np.eye(3)
    tracks.velocity_world[ids] = 0.0
    tracks.age_s[ids] = config.max_age_s
    tracks.tracked[ids] = False
    tracks.conflict[ids] = 0


def grow_older(tracks: Tracks, dt_s: float, config: TrackerConfig) -> None:
    """Count ages up, give up tracks that nothing supports, let lost ones relax to the prior.

    A lost worker's mean and covariance follow an Ornstein-Uhlenbeck process whose stationary
    distribution is the prior: the longer ago, the more it is the prior that is reported.
    """
    _grow_older(
        tracks.mean_world,
        tracks.cov_world,
        tracks.velocity_world,
        tracks.age_s,
        tracks.tracked,
        tracks.conflict,
        dt_s,
        config.max_age_s,
        config.lost_after_s,
        config.forget_s,
        config.prior_mean_world,
        config.prior_std_m,
    )


@numba.njit(**_JIT)
def _grow_older(
    mean, cov, velocity, age, tracked, conflict, dt, max_age, lost_after, forget_s, home, std
):
    keep = np.exp(-dt / forget_s)
    for b in range(mean.shape[0]):
        for w in range(mean.shape[1]):
            youngest = np.inf
            for j in range(mean.shape[2]):
                age[b, w, j] = min(age[b, w, j] + dt, max_age)
                youngest = min(youngest, age[b, w, j])
            if tracked[b, w] and youngest < lost_after - 1e-9:
                continue
            tracked[b, w] = False
            for j in range(mean.shape[2]):
                conflict[b, w, j] = 0
            relax(mean[b, w], cov[b, w], velocity[b, w], keep, home, std)


@numba.njit(**_JIT)
def relax(mean, cov, velocity, keep, home, std):
    """A body (J, ...) that nobody follows keeps a share of what was known; the rest is prior."""
    for j in range(len(mean)):
        for i in range(3):
            mean[j, i] = home[i] + keep * (mean[j, i] - home[i])
            velocity[j, i] *= keep
            for k in range(3):
                cov[j, i, k] *= keep * keep
            cov[j, i, i] += (1.0 - keep * keep) * std * std


def report(tracks: Tracks, config: TrackerConfig) -> PoseEstimate:
    """The tracks as others may see them: copies, covariances no less than the floor allows."""
    cov = np.empty(tracks.cov_world.shape)
    _bounded(tracks.cov_world, config.min_std_m**2, config.prior_std_m**2, cov)
    return PoseEstimate(
        mean_world=tracks.mean_world.copy(),
        cov_world=cov,
        velocity_world=tracks.velocity_world.copy(),
        age_s=tracks.age_s.copy(),
        tracked=tracks.tracked.copy(),
    )


@numba.njit(**_JIT)
def _bounded(cov, floor, ceiling, out):
    for b in range(cov.shape[0]):
        for w in range(cov.shape[1]):
            for j in range(cov.shape[2]):
                widest = max(cov[b, w, j, 0, 0], cov[b, w, j, 1, 1], cov[b, w, j, 2, 2])
                scale = min(1.0, ceiling / widest)
                for i in range(3):
                    for k in range(i, 3):
                        out[b, w, j, i, k] = scale * cov[b, w, j, i, k]
                        out[b, w, j, k, i] = out[b, w, j, i, k]
                missing = max(floor - least_eigenvalue(out[b, w, j]), 0.0)
                for i in range(3):
                    out[b, w, j, i, i] += missing


@numba.njit(**_JIT)
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
