"""Estimators that triangulate each frame and hold the last position of a joint during gaps.

`triangulation` is weighted least squares from all views. `ransac` uses the views that agree, which
it finds by trying every pair of cameras (after Fischler and Bolles, Comm. ACM 24, 1981). A joint
moves only if at least two views can be triangulated.
"""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.declared import Records2
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Covariances3, Floats, Ints, Points3, Rngs
from hrc_env.geometry.triangulation import FURTHEST_PX, triangulate
from hrc_env.tracking.config import TriangulationConfig
from hrc_env.tracking.forecast import forecast
from hrc_env.tracking.measurements import MIN_SIGMA_PX, KeypointArrays, get_keypoint_arrays
from hrc_env.tracking.settings import Settings, make_settings
from hrc_env.tracking.tracks import Track, age_tracks, make_tracks, report_tracks, reset_tracks
from hrc_env.tracking.tree.acquisition import complete_body, keep_one_body


@dataclass(frozen=True, slots=True)
class TriangulationEstimator:
    """Estimator that triangulates each frame independently; see `tracking.estimators.Estimator`."""

    P: Floats
    """(C, 3, 4) projections from the world [m] to pixels."""
    ctrl_dt: float
    """Nominal time between two updates [s]."""
    config: TriangulationConfig
    """Settings of the estimator."""
    gate_sigma: float = 0.0
    """Maximum residual at which views agree, in standard deviations. With 0, all views are used."""

    def init(self, batch: int, n_workers: int) -> Records2[Track]:
        """Return the tracks (B, W) of workers that have never been detected."""
        return make_tracks(batch, n_workers, self.config)

    def reset(self, state: Records2[Track], ids: Ints, rngs: Rngs) -> None:
        """Reset environments `ids` to the prior; `rngs` is not used."""
        reset_tracks(state, ids, self.config)

    def predict(self, state: Records2[Track], dt_s: float, rngs: Rngs) -> None:
        """Keep the positions of all joints; covariances grow with the squares of the ages."""
        _grow_covariances(state, dt_s, self.config.hold_speed_m_s)
        age_tracks(state, dt_s, self.config)

    def update(self, state: Records2[Track], keypoints: Keypoints, rngs: Rngs) -> None:
        """Move every joint to its triangulated position."""
        config, (batch, n_workers) = self.config, state.shape
        detections = get_keypoint_arrays(keypoints, (batch, len(self.P), n_workers, N_JOINTS))
        valid = _mask_invalid(detections, config.sigma_scale)
        made = triangulate(self.P, valid.px, valid.sigma_px, self.gate_sigma)
        points = np.ascontiguousarray(made.points_world), np.ascontiguousarray(made.cov_world)
        _update(state, *points, make_settings(config), config.velocity_tau_s)

    def estimate(self, state: Records2[Track]) -> PoseEstimate:
        """Return the current estimate."""
        return report_tracks(state, self.config)

    def forecast(self, state: Records2[Track], horizon_s: float) -> PoseEstimate:
        """Return the estimate expected after `horizon_s` [s]; see `tracking.forecast`."""
        return forecast(self.estimate(state), horizon_s, self.config)


def _mask_invalid(detections: KeypointArrays, sigma_scale: float) -> KeypointArrays:
    """Return detections in which invalid ones have NaN pixels and infinite standard deviations.

    Args:
        detections: (B, C, W, J) detections.
        sigma_scale: factor on the standard deviations of the valid ones.
    """
    px, confidence, sigma_px = detections.px, detections.confidence, detections.sigma_px
    inside = np.all(np.abs(px) < FURTHEST_PX, axis=-1)
    ok = inside & (confidence > 0) & (confidence <= 1 + 1e-6)
    ok &= (sigma_px > 0) & (sigma_px < FURTHEST_PX)
    sigma = np.maximum(np.where(ok, sigma_px * sigma_scale, np.inf), MIN_SIGMA_PX)
    return KeypointArrays(np.where(ok[..., None], px, np.nan), confidence, sigma)


@kernel(makes_arrays=True)
def _grow_covariances(tracks: Records2[Track], dt: float, speed: float) -> None:
    """Grow the covariances of tracked workers (B, W) with the square of their ages, in place.

    Args:
        tracks: (B, W) tracks.
        dt: time that passes [s].
        speed: growth of the standard deviation [m/s].
    """
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
def _update(
    tracks: Records2[Track],
    made: Points3,
    cov: Covariances3,
    settings: Settings,
    velocity_tau: float,
) -> None:
    """Update tracks (B, W) with triangulated points, in place.

    Args:
        tracks: (B, W) tracks.
        made: (B, W, J, 3) triangulated points [m]; NaN where there is none.
        cov: (B, W, J, 3, 3) covariances of the points [m^2].
        settings: settings of the estimator.
        velocity_tau: time constant of the filter on velocities [s].
    """
    found = np.empty(made.shape[2], np.bool_)
    for b in range(made.shape[0]):
        for w in range(made.shape[1]):
            track, points, spread = tracks[b, w], made[b, w], cov[b, w]
            for j in range(len(found)):
                found[j] = np.isfinite(points[j, 0])
            n_found = keep_one_body(points, spread, found, settings.body_radius_m)
            if track.tracked:
                _update_track(track, points, spread, found, velocity_tau)
            elif n_found >= settings.acquire_min_joints:
                complete_body(points, spread, found)
                track.mean_world[:], track.cov_world[:] = points, spread
                track.velocity_world[:] = 0.0
                for j in range(len(found)):
                    track.age_s[j] = 0.0 if found[j] else track.age_s[j]
                track.tracked = True


@kernel(makes_arrays=True)
def _update_track(
    track: Track, points: Points3, spread: Covariances3, found: Bools, velocity_tau: float
) -> None:
    """Move the joints of a track to new points and filter their velocities, in place.

    Args:
        track: the track.
        points: (J, 3) points [m].
        spread: (J, 3, 3) covariances of the points [m^2].
        found: (J,) mask of the joints with a new point.
        velocity_tau: time constant of the filter on velocities [s].
    """
    mean, velocity, age = track.mean_world, track.velocity_world, track.age_s
    for j in range(len(points)):
        elapsed = age[j]
        trust = elapsed / (velocity_tau + elapsed)
        for i in range(3):
            speed = (points[j, i] - mean[j, i]) / max(elapsed, 1e-6) if found[j] else 0.0
            velocity[j, i] += trust * (speed - velocity[j, i])
            if found[j]:
                mean[j, i] = points[j, i]
        if found[j]:
            track.cov_world[j], age[j] = spread[j], 0.0
