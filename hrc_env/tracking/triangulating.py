"""The estimators without memory: triangulate each frame, hold the last point through gaps.

What Algorithm 1 has to beat. `triangulation` is weighted least squares from all views (the
linear solution, refined on the reprojection error), whatever they show; `ransac` takes the
views that agree, found by trying every pair of cameras, which is RANSAC without luck
(Fischler and Bolles, Comm. ACM 24, 1981). A joint moves only when two views make a point.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints, Points2
from hrc_env.geometry.triangulation import (
    FURTHEST_PX,
    Triangulation,
    triangulate,
)
from hrc_env.tracking.config import TriangulationConfig
from hrc_env.tracking.forecast import forecast
from hrc_env.tracking.measurements import MIN_SIGMA_PX, arrays_of
from hrc_env.tracking.models.acquisition import STANDING_M, complete_body, keep_one_body
from hrc_env.tracking.tracks import Tracks, forget, grow_older, make_tracks, report

Solve: TypeAlias = Callable[[Floats, Points2, Floats], Triangulation]
"""From P (C, 3, 4), px (B, C, W, J, 2) and sigma (B, C, W, J) to points."""


def triangulation(
    P: Floats, ctrl_dt: float, config: TriangulationConfig
) -> "TriangulationEstimator":
    """Weighted least squares from all views."""
    return TriangulationEstimator(P, ctrl_dt, config, triangulate)


def ransac(P: Floats, ctrl_dt: float, config: TriangulationConfig) -> "TriangulationEstimator":
    """Least squares from the views that agree within `gate_sigma`."""

    def solve(P: Floats, px: Points2, sigma_px: Floats) -> Triangulation:
        return triangulate(P, px, sigma_px, config.gate_sigma)

    return TriangulationEstimator(P, ctrl_dt, config, solve)


@dataclass(frozen=True, slots=True)
class TriangulationEstimator:
    """Every frame by itself; see `tracking.estimators.Estimator`."""

    P: Floats
    ctrl_dt: float
    config: TriangulationConfig
    solve: Solve
    """How points are made of pixels."""

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
        """Put every joint where its views see it."""
        del rngs
        config = self.config
        batch, n_workers = state.tracked.shape
        measured = arrays_of(keypoints, (batch, len(self.P), n_workers, N_JOINTS))
        made = self.solve(self.P, *_believed(*measured, config.sigma_scale))
        _update(
            np.ascontiguousarray(made.points_world),
            np.ascontiguousarray(made.cov_world),
            state.mean_world,
            state.cov_world,
            state.velocity_world,
            state.age_s,
            state.tracked,
            STANDING_M,
            config.body_radius_m,
            config.acquire_min_joints,
            config.velocity_tau_s,
        )

    def estimate(self, state: Tracks) -> PoseEstimate:
        """What is believed now."""
        return report(state, self.config)

    def forecast(self, state: Tracks, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s`; see `tracking.forecast`."""
        return forecast(self.estimate(state), horizon_s, self.config)


def _believed(
    px: Points2, confidence: Floats, sigma_px: Floats, scale: float
) -> tuple[Points2, Floats]:
    """Pixels and sigma, NaN and infinite where a detector's word is no measurement."""
    inside = np.all(np.abs(px) < FURTHEST_PX, axis=-1)
    ok = inside & (confidence > 0) & (confidence <= 1 + 1e-6)
    ok &= (sigma_px > 0) & (sigma_px < FURTHEST_PX)
    sigma = np.maximum(np.where(ok, sigma_px * scale, np.inf), MIN_SIGMA_PX)
    return np.where(ok[..., None], px, np.nan), sigma


@kernel(makes_arrays=True)
def _hold(cov, age, tracked, dt, speed):
    for b in range(cov.shape[0]):
        for w in range(cov.shape[1]):
            if not tracked[b, w]:
                continue
            for j in range(cov.shape[2]):
                grown = speed * speed * dt * (2.0 * age[b, w, j] + dt)
                for i in range(3):
                    cov[b, w, j, i, i] += grown


@kernel(makes_arrays=True)
def _update(made, spread, mean, cov, velocity, age, tracked, standing, radius, min_joints, tau):
    """Take in points made (B, W, J, 3) with spread (B, W, J, 3, 3), NaN where there is none."""
    found = np.empty(made.shape[2], np.bool_)
    for b in range(made.shape[0]):
        for w in range(made.shape[1]):
            points, around = made[b, w], spread[b, w]
            for j in range(len(found)):
                found[j] = np.isfinite(points[j, 0])
            n_found = keep_one_body(points, around, found, radius)
            if tracked[b, w]:
                _follow(
                    points, around, found, tau, mean[b, w], cov[b, w], velocity[b, w], age[b, w]
                )
            elif n_found >= min_joints:
                complete_body(standing, points, around, found)
                mean[b, w], cov[b, w], velocity[b, w] = points, around, 0.0
                for j in range(len(found)):
                    age[b, w, j] = 0.0 if found[j] else age[b, w, j]
                tracked[b, w] = True


@kernel(makes_arrays=True)
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
