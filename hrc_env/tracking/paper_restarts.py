"""Algorithm 1 with what its listing lacks: it begins, is repaired and is given up as other tracks.

A cloud begins round a triangulated point, as `tree.acquisition` finds it; a joint that two views
have long agreed on elsewhere begins anew there; a worker whom nothing supports is lost, and the
estimate relaxes to the prior. Between these events the clouds are those of `paper`.
"""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Ints, Rngs
from hrc_env.tracking.measurements import Frame
from hrc_env.tracking.paper import PaperEstimator, PaperState
from hrc_env.tracking.settings import settings_of
from hrc_env.tracking.tracks import forget, grow_older
from hrc_env.tracking.tree.acquisition import find_again, find_body


@dataclass(frozen=True, slots=True)
class PaperRestarts(PaperEstimator):
    """Algorithm 1 with restarts for every worker; see `tracking.estimators.Estimator`."""

    def reset(self, state: PaperState, ids: Ints, rngs: Rngs) -> None:
        """Forget environments `ids`; draws nothing."""
        forget(state.tracks, ids, self.config)
        state.elapsed_s[ids] = 0.0

    def predict(self, state: PaperState, dt_s: float, rngs: Rngs) -> None:
        """Line 7 for workers with a track; count ages up, give tracks up."""
        self.walk(state, state.tracks["tracked"], dt_s, rngs)
        grow_older(state.tracks, dt_s, self.config)

    def take(
        self, state: PaperState, who: tuple[int, int], frame: Frame, rng: np.random.Generator
    ) -> None:
        """Lines 2 to 19 for a worker with a track, and what it needs; line 1 for one without."""
        track, s, anew = state.tracks[who], settings_of(self.config), np.zeros(N_JOINTS, bool)
        points, cov = np.empty((N_JOINTS, 3)), np.empty((N_JOINTS, 3, 3))
        if track["tracked"]:
            PaperEstimator.take(self, state, who, frame, rng)
            middle = np.median(track["mean_world"], axis=0)
            for j in np.flatnonzero(track["conflict"] >= s.conflict_frames):
                anew[j] = find_again(frame, j, s, middle, points[j], cov[j])
            track["age_s"][anew], track["conflict"][anew] = 0.0, 0
        elif frame.ok.any() and find_body(frame, s, points, cov, anew):
            track["age_s"][anew] = 0.0
            track["tracked"], anew[:] = True, True
        if anew.any():
            track["mean_world"][anew], track["cov_world"][anew] = points[anew], cov[anew]
            track["velocity_world"][anew] = 0.0
            root, n_particles = np.linalg.cholesky(cov[anew]), self.config.n_particles
            steps = rng.standard_normal((len(root), 3, n_particles))
            state.particles[who][anew] = points[anew, :, None] + root @ steps
