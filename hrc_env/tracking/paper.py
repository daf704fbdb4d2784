"""The paper's Algorithm 1, EstimatePose(N, M, C), as printed, and nothing else.

"Line" in a comment is a line of that listing. What the listing leaves open is read so:

- every joint has its own cloud (line 1 speaks of "the i-th joint"; one cloud for all 45
  coordinates does not work with any number of particles that one can afford);
- clouds begin uniform over the place (line 1, `place_of`) and are never begun again: who comes
  back elsewhere is reached by line 7 alone;
- a step of the simulation is one pass of the loop of line 2: line 7 happens in `predict`,
  lines 8 to 17 in `update`; more passes over the same frames (`n_iterations`) repeat both;
- the likelihoods of cameras are multiplied (line 13), that of one camera is a Gaussian of the
  pixel distance with the detector's sigma; a joint that a camera does not see multiplies by 1;
- the estimate (line 19) is the mean and the covariance of the resampled cloud.

What a report needs besides moves no particle: a joint's age is the time since a detection lay where
its cloud may be seen; a worker is `tracked` once `acquire_min_joints` joints have age 0, while one
age is below `lost_after_s`; velocities, 0 until then, are filtered differences of the means.
`paper_restarts` has what the listing lacks.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints, Rngs
from hrc_env.geometry.lines_of_sight import cameras_of
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.config import PaperConfig
from hrc_env.tracking.forecast import forecast
from hrc_env.tracking.measurements import Frame, arrays_of, make_frame, read_worker, supports
from hrc_env.tracking.tracks import forget, make_tracks, report
from hrc_env.tracking.tree.update import count_conflict

BEHIND = -1e12
"""Log-likelihood of a particle behind the camera that saw the joint: the last to be chosen."""
HEIGHTS_M = (0.0, 2.2)
"""Between these joints are expected where `PaperConfig.place_m` does not say."""
_NARROWEST_M = 1.0
"""Cameras that hang nearer together along an axis do not say how long the place is."""


@dataclass(frozen=True, slots=True)
class PaperState:
    """The clouds, and what is said of them."""

    tracks: Any
    """(B, W) records of `tracks.TRACK`."""
    particles: Floats
    """(B, W, J, 3, M) [m]."""
    elapsed_s: Floats
    """(B,) time since the last update [s]."""


@dataclass(frozen=True, slots=True)
class PaperEstimator:
    """Algorithm 1 for every worker; see `tracking.estimators.Estimator`."""

    P: Floats
    ctrl_dt: float
    config: PaperConfig

    def init(self, batch: int, n_workers: int) -> PaperState:
        """Workers whom nobody has seen; `reset` draws their clouds anew."""
        shape = (batch, n_workers, N_JOINTS, 3, self.config.n_particles)
        tracks = make_tracks(batch, n_workers, self.config)
        state = PaperState(tracks, np.zeros(shape), np.zeros(batch))
        self.reset(state, np.arange(batch), [np.random.default_rng(b) for b in range(batch)])
        return state

    def reset(self, state: PaperState, ids: Ints, rngs: Rngs) -> None:
        """Line 1, initialize_particle(M): clouds all over the place, in environments `ids`."""
        forget(state.tracks, ids, self.config)
        state.elapsed_s[ids] = 0.0
        place = place_of(self.P, self.config)
        for b in ids:
            drawn = rngs[b].random(state.particles.shape[1:])
            state.particles[b] = place[:, :1] + np.diff(place) * drawn
            for track, particles in zip(state.tracks[b], state.particles[b], strict=True):
                moments(particles, track["mean_world"], track["cov_world"])

    def predict(self, state: PaperState, dt_s: float, rngs: Rngs) -> None:
        """Line 7."""
        self.walk(state, np.ones_like(state.tracks["tracked"]), dt_s, rngs)
        age_s = state.tracks["age_s"]
        age_s[...] = np.minimum(age_s + dt_s, self.config.max_age_s)
        state.tracks["tracked"] &= (age_s < self.config.lost_after_s - 1e-9).any(-1)

    def update(self, state: PaperState, keypoints: Keypoints, rngs: Rngs) -> None:
        """Lines 8 to 17."""
        batch, n_workers = state.tracks.shape
        measured = arrays_of(keypoints, (batch, len(self.P), n_workers, N_JOINTS))
        frame = make_frame(cameras_of(self.P))
        for b, w in np.ndindex(state.tracks.shape):
            read_worker(measured, b, w, self.config.sigma_scale, frame)
            self.take(state, (b, w), frame, rngs[b])
        state.elapsed_s[:] = 0.0

    def estimate(self, state: PaperState) -> PoseEstimate:
        """Line 19: what is believed now."""
        return report(state.tracks, self.config)

    def forecast(self, state: PaperState, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s`; see `tracking.forecast`."""
        return forecast(self.estimate(state), horizon_s, self.config)

    def walk(self, state: PaperState, who: Bools, dt_s: float, rngs: Rngs) -> None:
        """Line 7 for workers `who` (B, W); the walk's variance, by which the estimate's covariance
        grows, is proportional to time."""
        sigma_m = self.config.sigma_m * np.sqrt(dt_s / self.ctrl_dt)
        state.elapsed_s[:] += dt_s
        for b, w in np.argwhere(who):
            roll(state.particles[b, w], sigma_m, rngs[b])  # line 7
            state.tracks["cov_world"][b, w] += sigma_m**2 * np.eye(3)

    def take(
        self, state: PaperState, who: tuple[int, int], frame: Frame, rng: np.random.Generator
    ) -> None:
        """What one set of frames does to a worker: the loop of lines 2 to 18, then line 19."""
        track, particles, config = state.tracks[who], state.particles[who], self.config
        for n in range(config.n_iterations):  # line 2: for n = 1 to N
            if n > 0:
                roll(particles, config.sigma_m, rng)  # line 7, of further passes
            waits = rng.standard_exponential((N_JOINTS, particles.shape[-1] + 1))
            weigh_and_resample(frame, particles, waits)
        mean, cov = np.empty((N_JOINTS, 3)), np.empty((N_JOINTS, 3, 3))
        moments(particles, mean, cov)  # line 19
        elapsed_s = max(state.elapsed_s.item(who[0]), 1e-6)
        if track["tracked"]:
            change = (mean - track["mean_world"]) / elapsed_s - track["velocity_world"]
            track["velocity_world"] += elapsed_s / (config.velocity_tau_s + elapsed_s) * change
        track["mean_world"], track["cov_world"] = mean, cov
        n_supported = note_support(track, frame, config.gate_sigma)
        track["tracked"] |= n_supported >= config.acquire_min_joints


def place_of(P: Floats, config: PaperConfig) -> Floats:
    """(3, 2) least and most x, y, z of the first particles [m]: as configured, else what the
    cameras P (C, 3, 4) stand round or, along an axis on which they do not, two standard deviations
    about the prior."""
    if config.place_m:
        return np.array(config.place_m)
    eyes = -np.linalg.solve(P[:, :, :3], P[:, :, 3:])[:, :2, 0]
    place = np.array([*zip(eyes.min(0), eyes.max(0), strict=True), HEIGHTS_M])
    for i in np.flatnonzero(np.diff(place)[:, 0] < _NARROWEST_M):
        place[i] = config.prior_mean_world[i] + 2 * config.prior_std_m * np.array([-1, 1])
    return place


@kernel(makes_arrays=True)
def weigh_and_resample(frame, particles, waits):
    """Lines 8 to 17 for clouds (J, 3, M) of one worker, in place; `waits` are `multinomial`'s."""
    P, z, sigma, ok = frame.P, frame.z, frame.sigma, frame.ok
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
        multinomial(weights, waits[j], ancestors)  # line 17
        before[:] = particles[j]
        for i in range(3):
            for m in range(n_particles):
                particles[j, i, m] = before[i, ancestors[m]]


@kernel(makes_arrays=True)
def note_support(track, frame, gate_sigma):
    """Count ages and conflicts of one worker's joints; how many of these a view supports."""
    mean, cov, n_supported = track.mean_world, track.cov_world, 0
    for j in range(len(mean)):
        n_ok, n_supporting = 0, 0
        for c in range(frame.ok.shape[1]):
            if frame.ok[j, c]:
                z, sigma = frame.z[j, c], frame.sigma[j, c]
                n_ok += 1
                n_supporting += supports(frame.P[c], z, sigma, gate_sigma, mean[j], cov[j])
        track.conflict[j] = count_conflict(n_ok, n_supporting, track.conflict[j])
        if n_supporting > 0:
            track.age_s[j] = 0.0
            n_supported += 1
    return n_supported


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
    """M independent choices `ancestors` (M,), sorted, by weights (M,) that sum to one.

    The normalised cumulative sums of `waits` (M + 1,), standard exponential variates, are M sorted
    uniform ones (Devroye, Non-Uniform Random Variate Generation, V.3).
    """
    total = waits.sum()
    particle, cumulative, position = 0, weights[0], 0.0
    for m in range(len(ancestors)):
        position += waits[m] / total
        while cumulative < position and particle < len(weights) - 1:
            particle += 1
            cumulative += weights[particle]
        ancestors[m] = particle
