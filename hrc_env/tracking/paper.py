"""The paper's Algorithm 1, EstimatePose(N, M, C), as printed.

"Line" in a comment is a line of that listing. What the listing leaves open is read so:

- every joint has its own cloud (line 1 speaks of "the i-th joint"; one cloud for all 45
  coordinates does not work with any number of particles that one can afford);
- a step of the simulation is one pass of the loop of line 2: line 7 happens in `predict`,
  lines 8 to 17 in `update`; more passes over the same frames (`n_iterations`) repeat both;
- the likelihoods of cameras are multiplied (line 13), that of one camera is a Gaussian of the
  pixel distance with the detector's sigma; a joint that a camera does not see multiplies by 1;
- a cloud starts round a triangulated point (line 1), as `acquisition` finds it: a start all
  over the room never locks on;
- the estimate (line 19) is the mean and the covariance of the resampled cloud.
"""

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Covariances3, Floats, Ints, Points3
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.config import PaperConfig
from hrc_env.tracking.forecast import forecast
from hrc_env.tracking.measurements import arrays_of, read_worker, supports
from hrc_env.tracking.models.acquisition import (
    STANDING_M,
    complete_body,
    count_conflict,
    find_again,
    middle_of,
    triangulate_body,
)
from hrc_env.tracking.tracks import Tracks, forget, grow_older, make_tracks, report

Measured: TypeAlias = tuple[Floats, Floats, Bools]
"""One worker's pixels (J, C, 2), sigma (J, C) and whether there are any (J, C)."""
BEHIND = -1e12
"""Log-likelihood of a particle behind the camera that saw the joint: the last to be chosen."""


@dataclass(frozen=True, slots=True)
class PaperState:
    """The clouds, and what is said of them."""

    tracks: Tracks
    particles: Floats
    """(B, W, J, 3, M) [m]; of a worker who is not tracked: without meaning."""
    elapsed_s: Floats
    """(B,) time since the last update [s]."""


@dataclass(frozen=True, slots=True)
class PaperEstimator:
    """Algorithm 1 for every worker; see `tracking.estimators.Estimator`."""

    P: Floats
    ctrl_dt: float
    config: PaperConfig

    def init(self, batch: int, n_workers: int) -> PaperState:
        """Workers whom nobody has seen."""
        shape = (batch, n_workers, N_JOINTS, 3, self.config.n_particles)
        tracks = make_tracks(batch, n_workers, self.config)
        return PaperState(tracks, np.zeros(shape), np.zeros(batch))

    def reset(self, state: PaperState, ids: Ints, rngs: list[np.random.Generator]) -> None:
        """Forget environments `ids`; draws nothing."""
        del rngs
        forget(state.tracks, ids, self.config)
        state.elapsed_s[ids] = 0.0

    def predict(self, state: PaperState, dt_s: float, rngs: list[np.random.Generator]) -> None:
        """Line 7; the walk's variance is proportional to time.

        The estimate keeps its mean (the walk has none) and its covariance grows by the walk's.
        """
        sigma_m = self.config.sigma_m * np.sqrt(dt_s / self.ctrl_dt)
        state.elapsed_s[:] += dt_s
        for b, w in np.argwhere(state.tracks.tracked):
            roll(state.particles[b, w], sigma_m, rngs[b])  # line 7
            state.tracks.cov_world[b, w] += sigma_m**2 * np.eye(3)
        grow_older(state.tracks, dt_s, self.config)

    def update(
        self, state: PaperState, keypoints: Keypoints, rngs: list[np.random.Generator]
    ) -> None:
        """Lines 8 to 17 for workers with a track; line 1 for those without."""
        batch, n_workers = state.tracks.tracked.shape
        n_cameras, scale = len(self.P), self.config.sigma_scale
        px, confidence, sigma_px = arrays_of(keypoints, (batch, n_cameras, n_workers, N_JOINTS))
        z, sigma = np.empty((N_JOINTS, n_cameras, 2)), np.empty((N_JOINTS, n_cameras))
        ok = np.empty((N_JOINTS, n_cameras), bool)
        for b in range(batch):
            for w in range(n_workers):
                read_worker(px, confidence, sigma_px, b, w, scale, z, sigma, ok)
                if state.tracks.tracked[b, w]:
                    self._follow(state, b, w, (z, sigma, ok), rngs[b])
                elif ok.any():
                    self._initialize(state, b, w, (z, sigma, ok), rngs[b])
        state.elapsed_s[:] = 0.0

    def estimate(self, state: PaperState) -> PoseEstimate:
        """Line 19: what is believed now."""
        return report(state.tracks, self.config)

    def forecast(self, state: PaperState, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s`; see `tracking.forecast`."""
        return forecast(self.estimate(state), horizon_s, self.config)

    def _initialize(
        self, state: PaperState, b: int, w: int, measured: Measured, rng: np.random.Generator
    ) -> None:
        """Line 1, initialize_particle(M): clouds round the points on which views agree."""
        config, tracks = self.config, state.tracks
        points, cov = np.empty((N_JOINTS, 3)), np.ones((N_JOINTS, 3, 3))
        found = np.empty(N_JOINTS, bool)
        gate, radius = config.gate_sigma, config.body_radius_m
        n_found = triangulate_body(self.P, *measured, gate, radius, points, cov, found)
        if n_found < config.acquire_min_joints:
            return
        complete_body(STANDING_M, points, cov, found)
        scatter(state.particles[b, w], points, cov, rng)
        tracks.mean_world[b, w], tracks.cov_world[b, w] = points, cov
        tracks.velocity_world[b, w] = 0.0
        tracks.age_s[b, w, found] = 0.0
        tracks.tracked[b, w] = True

    def _follow(
        self, state: PaperState, b: int, w: int, measured: Measured, rng: np.random.Generator
    ) -> None:
        """The loop of lines 2 to 18 for one worker, then the estimate of line 19."""
        config, tracks, particles = self.config, state.tracks, state.particles[b, w]
        for n in range(config.n_iterations):  # line 2: for n = 1 to N
            if n > 0:
                roll(particles, config.sigma_m, rng)  # line 7, of further passes
            by_weight = config.resampling == "multinomial"
            chance = _chance(by_weight, particles.shape[-1], rng)
            weigh_and_resample(self.P, *measured, particles, by_weight, chance)
        mean, cov = np.empty((N_JOINTS, 3)), np.empty((N_JOINTS, 3, 3))
        moments(particles, mean, cov)  # line 19
        elapsed_s = max(state.elapsed_s[b], 1e-6)
        change = (mean - tracks.mean_world[b, w]) / elapsed_s - tracks.velocity_world[b, w]
        trust = elapsed_s / (config.velocity_tau_s + elapsed_s)
        tracks.velocity_world[b, w] += trust * change
        tracks.mean_world[b, w], tracks.cov_world[b, w] = mean, cov
        again = np.zeros(N_JOINTS, bool)
        _look_after(
            self.P,
            *measured,
            config.gate_sigma,
            config.body_radius_m,
            config.conflict_frames,
            tracks.mean_world[b, w],
            tracks.cov_world[b, w],
            tracks.age_s[b, w],
            tracks.conflict[b, w],
            again,
        )
        if again.any():
            cloud = np.empty((int(again.sum()), *particles.shape[1:]))
            scatter(cloud, tracks.mean_world[b, w, again], tracks.cov_world[b, w, again], rng)
            particles[again] = cloud
            tracks.velocity_world[b, w, again] = 0.0


def _chance(by_weight: bool, n_particles: int, rng: np.random.Generator) -> Floats:
    """(J, M + 1) random numbers that the resampling of one frame takes."""
    if by_weight:
        return rng.standard_exponential((N_JOINTS, n_particles + 1))
    return np.repeat(rng.random((N_JOINTS, 1)), n_particles + 1, axis=1)


@kernel(makes_arrays=True)
def weigh_and_resample(P, z, sigma, ok, particles, by_weight, chance):
    """Lines 8 to 17 for the clouds (J, 3, M) of one worker, in place."""
    n_joints, n_cameras = ok.shape
    n_particles = particles.shape[2]
    log_weights, weights = np.empty(n_particles), np.empty(n_particles)
    ancestors, before = np.empty(n_particles, np.int64), np.empty((3, n_particles))
    for j in range(n_joints):  # each joint is a filter of its own
        log_weights[:] = 0.0  # line 8: W[m] = 0 (a logarithm)
        for c in range(n_cameras):  # line 9
            if ok[j, c]:
                # lines 11 to 13: project_2d, the detection, update; for all m of line 6
                u, v = z[j, c, 0], z[j, c, 1]
                add_log_likelihood(P[c], u, v, sigma[j, c], particles[j], log_weights)
        normalise(log_weights, weights)  # line 16
        if by_weight:
            multinomial(weights, chance[j], ancestors)  # line 17
        else:
            systematic(weights, chance[j, 0], ancestors)
        before[:] = particles[j]
        for i in range(3):
            for m in range(n_particles):
                particles[j, i, m] = before[i, ancestors[m]]


@kernel(makes_arrays=True)
def _look_after(
    P, z, sigma, ok, gate_sigma, radius, conflict_frames, mean, cov, age, conflict, again
):
    """Ages and conflicts of one worker; joints that views agree on elsewhere are found again."""
    n_joints, n_cameras = ok.shape
    middle, point, spread = np.empty(3), np.empty(3), np.empty((3, 3))
    middle_of(mean, np.ones(n_joints, np.bool_), middle)
    for j in range(n_joints):
        n_ok, n_supporting = 0, 0
        for c in range(n_cameras):
            if ok[j, c]:
                n_ok += 1
                n_supporting += supports(P[c], z[j, c], sigma[j, c], gate_sigma, mean[j], cov[j])
        conflict[j] = count_conflict(n_ok, n_supporting, conflict[j])
        if n_supporting > 0:
            age[j] = 0.0
        if conflict[j] < conflict_frames:
            continue
        if find_again(P, z[j], sigma[j], ok[j], gate_sigma, radius, middle, point, spread):
            mean[j], cov[j], age[j], conflict[j], again[j] = point, spread, 0.0, 0, True


def scatter(particles: Floats, mean: Points3, cov: Covariances3, rng: np.random.Generator) -> None:
    """Draw clouds (..., 3, M) from Gaussians with mean (..., 3) and cov (..., 3, 3), in place."""
    root = np.linalg.cholesky(cov)
    particles[:] = mean[..., None] + root @ rng.standard_normal(particles.shape)


def roll(particles: Floats, sigma_m: float, rng: np.random.Generator) -> None:
    """Move every particle a Gaussian step of `sigma_m` on each axis, in place."""
    _add_scaled(particles, rng.standard_normal(particles.shape, dtype=np.float32), sigma_m)


@kernel(makes_arrays=True)
def _add_scaled(particles, noise, scale):
    for j in range(particles.shape[0]):
        for i in range(3):
            for m in range(particles.shape[2]):
                particles[j, i, m] += scale * noise[j, i, m]


@kernel(makes_arrays=True)
def moments(particles, mean, cov):
    """Mean (J, 3) and covariance (J, 3, 3) of unweighted clouds (J, 3, M)."""
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
def add_log_likelihood(camera, u, v, sigma, particles, log_weights):
    """Add one camera's log-likelihood of pixel (u, v) to the log-weights of particles (3, M)."""
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
def normalise(log_weights, weights):
    """Weights that sum to one."""
    largest = log_weights.max()
    total = 0.0
    for m in range(len(log_weights)):
        weights[m] = math.exp(log_weights[m] - largest)
        total += weights[m]
    for m in range(len(weights)):
        weights[m] /= total


@kernel(makes_arrays=True)
def multinomial(weights, waits, ancestors):
    """M independent choices, sorted.

    Args:
        weights: (M,) summing to one.
        waits: (M + 1,) standard exponential variates: their normalised cumulative sums are
            M sorted uniform variates (Devroye, Non-Uniform Random Variate Generation, V.3).
        ancestors: (M,) int, filled.
    """
    total = waits.sum()
    particle, cumulative, position = 0, weights[0], 0.0
    for m in range(len(ancestors)):
        position += waits[m] / total
        while cumulative < position and particle < len(weights) - 1:
            particle += 1
            cumulative += weights[particle]
        ancestors[m] = particle


@kernel(makes_arrays=True)
def systematic(weights, start, ancestors):
    """Choices at even distances (Kitagawa, 1996): the counts differ from M w_m by less than one.

    Args:
        weights: (M,) summing to one.
        start: one uniform variate in [0, 1).
        ancestors: (M,) int, filled.
    """
    n = len(ancestors)
    particle, cumulative = 0, weights[0]
    for m in range(n):
        while cumulative < (m + start) / n and particle < len(weights) - 1:
            particle += 1
            cumulative += weights[particle]
        ancestors[m] = particle
