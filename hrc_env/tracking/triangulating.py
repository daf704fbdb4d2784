"""The estimators without memory: triangulate each frame, hold the last point through gaps.

`triangulation` is weighted least squares from all views; `ransac` takes the views that agree, found
by trying every pair of cameras (after Fischler and Bolles, Comm. ACM 24, 1981). A joint moves only
when two views make a point.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints, Points2, Rngs
from hrc_env.geometry.triangulation import FURTHEST_PX, triangulate
from hrc_env.tracking.config import TriangulationConfig
from hrc_env.tracking.forecast import forecast
from hrc_env.tracking.measurements import MIN_SIGMA_PX, arrays_of
from hrc_env.tracking.settings import settings_of
from hrc_env.tracking.tracks import forget, grow_older, make_tracks, report
from hrc_env.tracking.tree.acquisition import complete_body, keep_one_body


@dataclass(frozen=True, slots=True)
class TriangulationEstimator:
    """Every frame by itself; see `tracking.estimators.Estimator`."""

    P: Floats
    ctrl_dt: float
    config: TriangulationConfig
    gate_sigma: float = 0.0
    """Within how many standard deviations views must agree; 0: all are used."""

    def init(self, batch: int, n_workers: int) -> Any:
        """(B, W) records of `tracks.TRACK`, of workers whom nobody has seen."""
        return make_tracks(batch, n_workers, self.config)

    def reset(self, state: Any, ids: Ints, rngs: Rngs) -> None:
        """Forget environments `ids`; draws nothing."""
        forget(state, ids, self.config)

    def predict(self, state: Any, dt_s: float, rngs: Rngs) -> None:
        """Hold every joint where it was; its covariance grows with the square of the age."""
        _hold(state, dt_s, self.config.hold_speed_m_s)
        grow_older(state, dt_s, self.config)

    def update(self, state: Any, keypoints: Keypoints, rngs: Rngs) -> None:
        """Put every joint where its views see it."""
        config, (batch, n_workers) = self.config, state.shape
        measured = arrays_of(keypoints, (batch, len(self.P), n_workers, N_JOINTS))
        believed = _believed(*measured, config.sigma_scale)
        made = triangulate(self.P, *believed, self.gate_sigma)
        points = np.ascontiguousarray(made.points_world), np.ascontiguousarray(made.cov_world)
        _update(state, *points, settings_of(config), config.velocity_tau_s)

    def estimate(self, state: Any) -> PoseEstimate:
        """What is believed now."""
        return report(state, self.config)

    def forecast(self, state: Any, horizon_s: float) -> PoseEstimate:
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
def _hold(tracks, dt, speed):
    for b in range(tracks.shape[0]):
        for w in range(tracks.shape[1]):
            t = tracks[b, w]
            if not t.tracked:
                continue
            for j in range(len(t.age_s)):
                grown = speed * speed * dt * (2.0 * t.age_s[j] + dt)
                for i in range(3):
                    t.cov_world[j, i, i] += grown


@kernel(makes_arrays=True)
def _update(tracks, made, spread, s, tau):
    """Take in points made (B, W, J, 3) with spread (B, W, J, 3, 3), NaN where there is none."""
    found = np.empty(made.shape[2], np.bool_)
    for b in range(made.shape[0]):
        for w in range(made.shape[1]):
            t, points, around = tracks[b, w], made[b, w], spread[b, w]
            for j in range(len(found)):
                found[j] = np.isfinite(points[j, 0])
            n_found = keep_one_body(points, around, found, s.body_radius_m)
            if t.tracked:
                _follow(t, points, around, found, tau)
            elif n_found >= s.acquire_min_joints:
                complete_body(points, around, found)
                t.mean_world[:], t.cov_world[:], t.velocity_world[:] = points, around, 0.0
                for j in range(len(found)):
                    t.age_s[j] = 0.0 if found[j] else t.age_s[j]
                t.tracked = True


@kernel(makes_arrays=True)
def _follow(track, points, spread, found, tau):
    mean, velocity, age = track.mean_world, track.velocity_world, track.age_s
    for j in range(len(points)):
        elapsed = age[j]
        trust = elapsed / (tau + elapsed)
        for i in range(3):
            speed = (points[j, i] - mean[j, i]) / max(elapsed, 1e-6) if found[j] else 0.0
            velocity[j, i] += trust * (speed - velocity[j, i])
            if found[j]:
                mean[j, i] = points[j, i]
        if found[j]:
            track.cov_world[j], age[j] = spread[j], 0.0
