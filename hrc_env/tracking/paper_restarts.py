"""Algorithm 1 with what its listing lacks: it begins, is repaired and is given up as other tracks.

A cloud begins round a triangulated point, as `models.acquisition` finds it; a joint that two views
have long agreed on elsewhere begins anew there; a worker whom nothing supports is lost, and the
estimate relaxes to the prior. Between these events the clouds are those of `paper`.
"""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Covariances3, Floats, Ints, Points3
from hrc_env.tracking.measurements import Seen
from hrc_env.tracking.models.acquisition import find_again, find_body, middle_of
from hrc_env.tracking.paper import PaperEstimator, PaperState
from hrc_env.tracking.settings import settings_of
from hrc_env.tracking.tracks import forget, grow_older


@dataclass(frozen=True, slots=True)
class PaperRestarts(PaperEstimator):
    """Algorithm 1 with restarts for every worker; see `tracking.estimators.Estimator`."""

    def reset(self, state: PaperState, ids: Ints, rngs: list[np.random.Generator]) -> None:
        """Forget environments `ids`; draws nothing."""
        del rngs
        forget(state.tracks, ids, self.config)
        state.elapsed_s[ids] = 0.0

    def predict(self, state: PaperState, dt_s: float, rngs: list[np.random.Generator]) -> None:
        """Line 7 for workers with a track; count ages up, give tracks up."""
        self.walk(state, state.tracks["tracked"], dt_s, rngs)
        grow_older(state.tracks, dt_s, self.config)

    def take(
        self, state: PaperState, who: tuple[int, int], seen: Seen, rng: np.random.Generator
    ) -> None:
        """Lines 2 to 19 for a worker with a track, and what it needs; line 1 for one without."""
        track, particles, s = state.tracks[who], state.particles[who], settings_of(self.config)
        anew = np.zeros(N_JOINTS, bool)
        if track["tracked"]:
            PaperEstimator.take(self, state, who, seen, rng)
            find_joints_again(track, seen, s, anew)
        elif seen.ok.any():
            points, cov = np.empty((N_JOINTS, 3)), np.empty((N_JOINTS, 3, 3))
            if not find_body(seen, s, points, cov, anew):
                return
            track["mean_world"], track["cov_world"], track["tracked"] = points, cov, True
            track["age_s"][anew] = 0.0
            anew[:] = True
        if anew.any():
            cloud = np.empty((int(anew.sum()), *particles.shape[1:]))
            scatter(cloud, track["mean_world"][anew], track["cov_world"][anew], rng)
            particles[anew], track["velocity_world"][anew] = cloud, 0.0


@kernel(makes_arrays=True)
def find_joints_again(track, seen, s, anew):
    """Put joints where two views have seen them for a while; `anew` (J,) says which."""
    mean, cov, middle = track.mean_world, track.cov_world, np.empty(3)
    point, spread = np.empty(3), np.empty((3, 3))
    middle_of(mean, np.ones(len(mean), np.bool_), middle)
    for j in range(len(mean)):
        if track.conflict[j] < s.conflict_frames:
            continue
        if find_again(seen, j, s, middle, point, spread):
            mean[j], cov[j], anew[j] = point, spread, True
            track.age_s[j], track.conflict[j] = 0.0, 0


def scatter(particles: Floats, mean: Points3, cov: Covariances3, rng: np.random.Generator) -> None:
    """Draw clouds (..., 3, M) from Gaussians with mean (..., 3) and cov (..., 3, 3), in place."""
    root = np.linalg.cholesky(cov)
    particles[:] = mean[..., None] + root @ rng.standard_normal(particles.shape)
