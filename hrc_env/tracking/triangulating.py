"""The estimator without memory: triangulate each frame, hold the last point through gaps.

What Algorithm 1 has to beat. A joint moves only when at least two views agree on it.
"""

from dataclasses import dataclass

import numba
import numpy as np

from hrc_env.records import Keypoints, PoseEstimate
from hrc_env.skeleton import N_JOINTS
from hrc_env.tracking.acquisition import STANDING_M, complete_body, triangulate_body
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.measurements import arrays_of, read_worker
from hrc_env.tracking.tracks import Tracks, forget, grow_older, make_tracks, report
from hrc_env.typing import Floats, Ints

_JIT = {"cache": True, "nogil": True, "error_model": "numpy"}


@dataclass(frozen=True, slots=True)
class TriangulationEstimator:
    """Robust triangulation of every frame; see `tracking.estimators.Estimator`."""

    P: Floats
    ctrl_dt: float
    config: TrackerConfig

    def init(self, batch: int, n_workers: int) -> Tracks:
        """Workers whom nobody has seen."""
        return make_tracks(batch, n_workers, self.config)

    def reset(self, state: Tracks, ids: Ints, rngs: list[np.random.Generator]) -> None:
        """Forget environments `ids`; draws nothing."""
        del rngs
        forget(state, ids, self.config)

    def predict(self, state: Tracks, dt_s: float, rngs: list[np.random.Generator]) -> None:
        """Hold every joint where it was; its covariance grows with the square of the age."""
        del rngs
        config = self.config
        _hold(state.cov_world, state.age_s, state.tracked, dt_s, config.hold_speed_m_s)
        grow_older(state, dt_s, config)

    def update(self, state: Tracks, keypoints: Keypoints, rngs: list[np.random.Generator]) -> None:
        """Put every joint on which two views agree where they see it."""
        del rngs
        config = self.config
        batch, n_workers = state.tracked.shape
        measured = arrays_of(keypoints, (batch, len(self.P), n_workers, N_JOINTS))
        _update(
            self.P,
            *measured,
            state.mean_world,
            state.cov_world,
            state.velocity_world,
            state.age_s,
            state.tracked,
            STANDING_M,
            config.sigma_scale,
            config.gate_sigma,
            config.body_radius_m,
            config.acquire_min_joints,
            config.velocity_tau_s,
        )

    def estimate(self, state: Tracks) -> PoseEstimate:
        """What is believed now."""
        return report(state, self.config)


@numba.njit(**_JIT)
def _hold(cov, age, tracked, dt, speed):
    for b in range(cov.shape[0]):
        for w in range(cov.shape[1]):
            if not tracked[b, w]:
                continue
            for j in range(cov.shape[2]):
                grown = speed * speed * dt * (2.0 * age[b, w, j] + dt)
                for i in range(3):
                    cov[b, w, j, i, i] += grown


@numba.njit(**_JIT)
def _update(
    P, px, confidence, sigma_px, mean, cov, velocity, age, tracked,
    standing, scale, gate_sigma, radius, min_joints, tau,
):  # fmt: skip
    n_batch, n_cameras, n_workers, n_joints = confidence.shape
    z, sigma = np.empty((n_joints, n_cameras, 2)), np.empty((n_joints, n_cameras))
    ok, found = np.empty((n_joints, n_cameras), np.bool_), np.empty(n_joints, np.bool_)
    points, spread = np.empty((n_joints, 3)), np.ones((n_joints, 3, 3))
    for b in range(n_batch):
        for w in range(n_workers):
            if not read_worker(px, confidence, sigma_px, b, w, scale, z, sigma, ok):
                continue
            n_found = triangulate_body(P, z, sigma, ok, gate_sigma, radius, points, spread, found)
            if tracked[b, w]:
                _follow(
                    points, spread, found, tau, mean[b, w], cov[b, w], velocity[b, w], age[b, w]
                )
            elif n_found >= min_joints:
                complete_body(standing, points, spread, found)
                mean[b, w], cov[b, w], velocity[b, w] = points, spread, 0.0
                for j in range(n_joints):
                    age[b, w, j] = 0.0 if found[j] else age[b, w, j]
                tracked[b, w] = True


@numba.njit(**_JIT)
def _follow(points, spread, found, tau, mean, cov, velocity, age):
    for j in range(len(points)):
        elapsed = age[j]
        trust = elapsed / (tau + elapsed)
        for i in range(3):
            speed = (points[j, i] - mean[j, i]) / max(elapsed, 1e-6) if found[j] else 0.0
            velocity[j, i] += trust * (speed - velocity[j, i])
            if found[j]:
                mean[j, i] = points[j, i]
        if found[j]:
            cov[j], age[j] = spread[j], 0.0
