"""The paper's Algorithm 1, EstimatePose(N, M, C), exactly as printed.

In comments, "line" refers to a line of that listing. Where the listing is ambiguous, it is
interpreted as follows:

- Every joint has its own cloud of particles. Line 1 refers to "the i-th joint", and a single cloud
  for all 45 coordinates does not work with any affordable number of particles.
- Clouds start uniform over a volume (line 1, `find_place`) and never restart. If a worker reappears
  elsewhere, only the random walk of line 7 can move the cloud there.
- A step of the simulation is one pass of the loop in line 2. `predict` executes line 7, and
  `update` executes lines 8 to 17; further passes over the same frames (`n_iterations`) repeat both.
- The likelihoods of the cameras are multiplied (line 13). The likelihood of one camera is a
  Gaussian of the pixel distance with the detector's sigma, or 1 if the camera does not see the
  joint.
- The estimate (line 19) is the mean and the covariance of the resampled cloud.

The other fields of the estimate do not affect the particles. A joint's age is the time since a
detection was consistent with its cloud. A worker becomes `tracked` once `acquire_min_joints` joints
have age 0, and remains tracked while any age is below `lost_after_s`. Velocities are filtered
differences of the means, and 0 before a worker is tracked. `paper_restarts` adds track
initialization, joint reacquisition and track loss, which the listing does not define.
"""

import math
from dataclasses import dataclass

import numpy as np

from hrc_env.core.declared import Records2
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Covariances3, Floats, Ints, Points3, Rngs, Tensor
from hrc_env.geometry.lines_of_sight import cameras_of
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.config import PaperConfig
from hrc_env.tracking.forecast import forecast
from hrc_env.tracking.measurements import (
    Frame,
    get_keypoint_arrays,
    is_consistent,
    make_frame,
    read_worker,
)
from hrc_env.tracking.tracks import Track, make_tracks, report_tracks, reset_tracks
from hrc_env.tracking.tree.update import count_conflict

BEHIND = -1e12
"""Log-likelihood of a particle behind a camera that detected the joint. The value practically
excludes the particle."""
HEIGHTS_M = (0.0, 2.2)
"""Bounds of z for the initial particles if `PaperConfig.initial_bounds_m` is empty [m]."""
_NARROWEST_M = 1.0
"""Minimum extent of the camera positions along an axis on which they bound the initial particles
[m]."""


@dataclass(frozen=True, slots=True)
class PaperState:
    """The clouds of particles and the reported tracks."""

    tracks: Records2[Track]
    """(B, W) tracks."""
    particles: Floats
    """(B, W, J, 3, M) positions of the particles in the world frame [m]."""
    elapsed_s: Floats
    """(B,) time since the last update [s]."""


@dataclass(frozen=True, slots=True)
class PaperEstimator:
    """Estimator that applies Algorithm 1 to every worker; see `tracking.estimators.Estimator`."""

    P: Floats
    """(C, 3, 4) projections from the world [m] to pixels."""
    ctrl_dt: float
    """Nominal time between two updates [s]."""
    config: PaperConfig
    """Settings of the algorithm."""

    def init(self, batch: int, n_workers: int) -> PaperState:
        """Return the state before any detection, with clouds as after `reset`."""
        shape = (batch, n_workers, N_JOINTS, 3, self.config.n_particles)
        tracks = make_tracks(batch, n_workers, self.config)
        state = PaperState(tracks, np.zeros(shape), np.zeros(batch))
        self.reset(state, np.arange(batch), [np.random.default_rng(b) for b in range(batch)])
        return state

    def reset(self, state: PaperState, ids: Ints, rngs: Rngs) -> None:
        """Sample uniform clouds for environments `ids` (line 1, initialize_particle(M))."""
        reset_tracks(state.tracks, ids, self.config)
        state.elapsed_s[ids] = 0.0
        place = find_place(self.P, self.config)
        for b in map(int, ids):
            drawn = rngs[b].random(state.particles.shape[1:])
            state.particles[b] = place[:, :1] + np.diff(place) * drawn
            mean, cov = state.tracks["mean_world"], state.tracks["cov_world"]
            for w in range(state.tracks.shape[1]):
                compute_moments(state.particles[b, w], mean[b, w], cov[b, w])

    def predict(self, state: PaperState, dt_s: float, rngs: Rngs) -> None:
        """Move the particles (line 7) and increase the ages."""
        self.walk(state, np.ones_like(state.tracks["tracked"]), dt_s, rngs)
        age_s = state.tracks["age_s"]
        age_s[...] = np.minimum(age_s + dt_s, self.config.max_age_s)
        state.tracks["tracked"] &= (age_s < self.config.lost_after_s - 1e-9).any(-1)

    def update(self, state: PaperState, keypoints: Keypoints, rngs: Rngs) -> None:
        """Weight and resample the clouds by one set of frames (lines 8 to 17)."""
        batch, n_workers = state.tracks.shape
        detections = get_keypoint_arrays(keypoints, (batch, len(self.P), n_workers, N_JOINTS))
        frame = make_frame(cameras_of(self.P))
        for b in range(batch):
            for w in range(n_workers):
                read_worker(detections, b, w, self.config.sigma_scale, frame)
                self.apply_frame(state, b, w, frame, rngs[b])
        state.elapsed_s[:] = 0.0

    def estimate(self, state: PaperState) -> PoseEstimate:
        """Return the current estimate (line 19)."""
        return report_tracks(state.tracks, self.config)

    def forecast(self, state: PaperState, horizon_s: float) -> PoseEstimate:
        """Return the estimate expected after `horizon_s` [s]; see `tracking.forecast`."""
        return forecast(self.estimate(state), horizon_s, self.config)

    def walk(self, state: PaperState, moving: Bools, dt_s: float, rngs: Rngs) -> None:
        """Move the particles of some workers by a random walk (line 7).

        The covariance of the estimate grows by the variance of the walk, which is proportional to
        time.

        Args:
            state: changed in place.
            moving: (B, W) mask of the workers with particles to move.
            dt_s: time that passes [s].
            rngs: (B,) one generator for each environment.
        """
        sigma_m = self.config.sigma_m * np.sqrt(dt_s / self.ctrl_dt)
        state.elapsed_s[:] += dt_s
        for b in range(len(moving)):
            for w in np.flatnonzero(moving[b]):
                roll(state.particles[b, w], sigma_m, rngs[b])  # line 7
                state.tracks["cov_world"][b, w] += sigma_m**2 * np.eye(3)

    def apply_frame(
        self, state: PaperState, b: int, w: int, frame: Frame, rng: np.random.Generator
    ) -> None:
        """Update one worker by one set of frames (the loop of lines 2 to 18, then line 19).

        Args:
            state: changed in place.
            b: index of the environment.
            w: index of the worker.
            frame: detections of that worker.
            rng: generator of that environment.
        """
        tracks, particles, config = state.tracks, state.particles[b, w], self.config
        for n in range(config.n_iterations):  # line 2: for n = 1 to N
            if n > 0:
                roll(particles, config.sigma_m, rng)  # line 7 of further passes
            waits = rng.standard_exponential((N_JOINTS, particles.shape[-1] + 1))
            weigh_and_resample(frame, particles, waits)
        mean, cov = np.empty((N_JOINTS, 3)), np.empty((N_JOINTS, 3, 3))
        compute_moments(particles, mean, cov)  # line 19
        elapsed_s = max(state.elapsed_s.item(b), 1e-6)
        if tracks["tracked"][b, w]:
            velocity = tracks["velocity_world"][b, w]
            change = (mean - tracks["mean_world"][b, w]) / elapsed_s - velocity
            velocity += elapsed_s / (config.velocity_tau_s + elapsed_s) * change
        tracks["mean_world"][b, w], tracks["cov_world"][b, w] = mean, cov
        n_supported = count_support(tracks, b, w, frame, config.gate_sigma)
        tracks["tracked"][b, w] |= n_supported >= config.acquire_min_joints


def find_place(P: Floats, config: PaperConfig) -> Floats:
    """Return the bounds (3, 2) of x, y and z within which initial particles are sampled [m].

    If the settings contain no bounds, the bounds are those of the cameras' positions. Along an axis
    on which the cameras are too close to each other, they are two standard deviations about the
    prior mean.

    Args:
        P: (C, 3, 4) projections.
        config: settings of the algorithm.
    """
    if config.initial_bounds_m:
        return np.array(config.initial_bounds_m)
    centres = -np.linalg.solve(P[:, :, :3], P[:, :, 3:])[:, :2, 0]
    place = np.array([*zip(centres.min(0), centres.max(0), strict=True), HEIGHTS_M])
    for i in np.flatnonzero(np.diff(place)[:, 0] < _NARROWEST_M):
        place[i] = config.prior_mean_world[i] + 2 * config.prior_std_m * np.array([-1, 1])
    return place


@kernel(makes_arrays=True)
def weigh_and_resample(frame: Frame, particles: Points3, waits: Floats) -> None:
    """Weight and resample the clouds of one worker (lines 8 to 17).

    Args:
        frame: detections of the worker.
        particles: (J, 3, M) positions of the particles [m], changed in place.
        waits: (J, M + 1) standard exponential variates, for `draw_multinomial`.
    """
    P, z, sigma, ok = frame.P, frame.z, frame.sigma, frame.ok
    n_joints, n_cameras = ok.shape
    n_particles = particles.shape[2]
    log_weights, weights = np.empty(n_particles), np.empty(n_particles)
    ancestors, before = np.empty(n_particles, np.int64), np.empty((3, n_particles))
    for j in range(n_joints):  # each joint has a separate filter
        log_weights[:] = 0.0  # line 8: W[m] = 0 (a logarithm)
        for c in range(n_cameras):  # line 9
            if ok[j, c]:
                # lines 11 to 13: project_2d, the detection, update; for all m of line 6
                u, v = z[j, c, 0], z[j, c, 1]
                add_log_likelihood(P[c], u, v, sigma[j, c], particles[j], log_weights)
        normalise(log_weights, weights)  # line 16
        draw_multinomial(weights, waits[j], ancestors)  # line 17
        before[:] = particles[j]
        for i in range(3):
            for m in range(n_particles):
                particles[j, i, m] = before[i, ancestors[m]]


@kernel(makes_arrays=True)
def count_support(tracks: Records2[Track], b: int, w: int, frame: Frame, gate_sigma: float) -> int:
    """Count the joints of one worker that any view supports, and update ages and conflicts.

    Args:
        tracks: (B, W) tracks; the ages and conflicts of the worker are changed in place.
        b: index of the environment.
        w: index of the worker.
        frame: detections of the worker.
        gate_sigma: gate around the expected pixel, in standard deviations.
    """
    track = tracks[b, w]
    mean, cov, n_supported = track.mean_world, track.cov_world, 0
    for j in range(len(mean)):
        n_ok, n_supporting = 0, 0
        for c in range(frame.ok.shape[1]):
            if frame.ok[j, c]:
                z, sigma = frame.z[j, c], frame.sigma[j, c]
                n_ok += 1
                n_supporting += is_consistent(frame.P[c], z, sigma, gate_sigma, mean[j], cov[j])
        track.conflict[j] = count_conflict(n_ok, n_supporting, track.conflict[j])
        if n_supporting > 0:
            track.age_s[j] = 0.0
            n_supported += 1
    return n_supported


def roll(particles: Floats, sigma_m: float, rng: np.random.Generator) -> None:
    """Add a random Gaussian step to the position of each particle, in place.

    Args:
        particles: (J, 3, M) positions [m].
        sigma_m: standard deviation of a step on each axis [m].
        rng: generator of the steps.
    """
    _add_scaled(particles, rng.standard_normal(particles.shape, dtype=np.float32), sigma_m)


@kernel(makes_arrays=True)
def _add_scaled(particles: Points3, noise: Tensor, scale: float) -> None:
    """Add `scale` [m] times `noise` (J, 3, M) to particles (J, 3, M), in place."""
    for j in range(particles.shape[0]):
        for i in range(3):
            for m in range(particles.shape[2]):
                particles[j, i, m] += scale * noise[j, i, m]


@kernel(makes_arrays=True)
def compute_moments(particles: Points3, mean: Points3, cov: Covariances3) -> None:
    """Compute the means and the covariances of unweighted clouds.

    Args:
        particles: (J, 3, M) positions [m].
        mean: (J, 3) means [m], filled in.
        cov: (J, 3, 3) covariances [m^2], filled in.
    """
    n = particles.shape[2]
    for j in range(particles.shape[0]):
        for i in range(3):
            mean[j, i] = particles[j, i].mean()
        for i in range(3):
            for k in range(i + 1):
                total = 0.0
                for m in range(n):
                    total += (particles[j, i, m] - mean[j, i]) * (particles[j, k, m] - mean[j, k])
                cov[j, i, k] = cov[j, k, i] = total / n


@kernel(makes_arrays=True)
def add_log_likelihood(
    camera: Floats, u: float, v: float, sigma: float, particles: Points3, log_weights: Floats
) -> None:
    """Add the log-likelihood of a detection in one camera to the log-weights of particles.

    Args:
        camera: (3, 4) projection.
        u: column of the detected pixel [px].
        v: row of the detected pixel [px].
        sigma: standard deviation of each coordinate [px].
        particles: (3, M) positions [m].
        log_weights: (M,) log-weights, increased in place.
    """
    for m in range(particles.shape[1]):
        expected_u, expected_v, depth = pixel_of(
            camera, particles[0, m], particles[1, m], particles[2, m]
        )
        if depth > NEAREST_DEPTH_M:
            distance_squared = (u - expected_u) ** 2 + (v - expected_v) ** 2
            log_weights[m] += -0.5 * distance_squared / (sigma * sigma)
        else:
            log_weights[m] += BEHIND


@kernel(makes_arrays=True)
def normalise(log_weights: Floats, weights: Floats) -> None:
    """Compute normalised `weights` (M,) from log-weights (M,)."""
    largest = log_weights.max()
    total = 0.0
    for m in range(len(log_weights)):
        weights[m] = math.exp(log_weights[m] - largest)
        total += weights[m]
    for m in range(len(weights)):
        weights[m] /= total


@kernel(makes_arrays=True)
def draw_multinomial(weights: Floats, waits: Floats, ancestors: Ints) -> None:
    """Sample M independent indices with given probabilities, in ascending order.

    The normalised cumulative sums of M + 1 standard exponential variates are M sorted uniform
    variates (Devroye, Non-Uniform Random Variate Generation, V.3).

    Args:
        weights: (M,) probabilities; their sum is one.
        waits: (M + 1,) standard exponential variates.
        ancestors: (M,) indices, filled in.
    """
    total = waits.sum()
    particle, cumulative, position = 0, weights[0], 0.0
    for m in range(len(ancestors)):
        position += waits[m] / total
        while cumulative < position and particle < len(weights) - 1:
            particle += 1
            cumulative += weights[particle]
        ancestors[m] = particle
