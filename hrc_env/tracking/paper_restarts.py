"""Algorithm 1 extended with track initialization, joint reacquisition and track loss.

The published listing does not define these steps. A cloud starts around a triangulated point, which
`tree.acquisition` finds. The cloud of a joint restarts if two views have agreed on another position
for `conflict_frames` updates. A worker that no detection supports is lost, and the estimate relaxes
to the prior. Between these events, the clouds evolve as in `paper`.
"""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Ints, Rngs
from hrc_env.tracking.measurements import Frame
from hrc_env.tracking.paper import PaperEstimator, PaperState
from hrc_env.tracking.settings import make_settings
from hrc_env.tracking.tracks import age_tracks, reset_tracks
from hrc_env.tracking.tree.acquisition import find_again, find_body


@dataclass(frozen=True, slots=True)
class PaperRestarts(PaperEstimator):
    """Estimator that applies Algorithm 1 with restarts; see `tracking.estimators.Estimator`."""

    def reset(self, state: PaperState, ids: Ints, rngs: Rngs) -> None:
        """Reset environments `ids` to the prior; `rngs` is not used."""
        reset_tracks(state.tracks, ids, self.config)
        state.elapsed_s[ids] = 0.0

    def predict(self, state: PaperState, dt_s: float, rngs: Rngs) -> None:
        """Move the particles of tracked workers (line 7), increase ages and end tracks."""
        self.walk(state, state.tracks["tracked"], dt_s, rngs)
        age_tracks(state.tracks, dt_s, self.config)

    def apply_frame(
        self, state: PaperState, b: int, w: int, frame: Frame, rng: np.random.Generator
    ) -> None:
        """Update one worker by one set of frames, or start a track if the worker has none.

        Args:
            state: changed in place.
            b: index of the environment.
            w: index of the worker.
            frame: detections of that worker.
            rng: generator of that environment.
        """
        mean, cov = state.tracks["mean_world"][b, w], state.tracks["cov_world"][b, w]
        age_s, conflict = state.tracks["age_s"][b, w], state.tracks["conflict"][b, w]
        settings, anew = make_settings(self.config), np.zeros(N_JOINTS, np.bool_)
        new_mean, new_cov = np.empty((N_JOINTS, 3)), np.empty((N_JOINTS, 3, 3))
        if state.tracks["tracked"][b, w]:
            PaperEstimator.apply_frame(self, state, b, w, frame, rng)
            middle = np.median(mean, axis=0)
            for j in map(int, np.flatnonzero(conflict >= settings.conflict_frames)):
                anew[j] = find_again(frame, j, settings, middle, new_mean[j], new_cov[j])
            age_s[anew], conflict[anew] = 0.0, 0
        elif frame.ok.any() and find_body(frame, settings, new_mean, new_cov, anew):
            age_s[anew] = 0.0
            state.tracks["tracked"][b, w], anew[:] = True, True
        if anew.any():
            mean[anew], cov[anew] = new_mean[anew], new_cov[anew]
            state.tracks["velocity_world"][b, w, anew] = 0.0
            root, n_particles = np.linalg.cholesky(new_cov[anew]), self.config.n_particles
            steps = rng.standard_normal((len(root), 3, n_particles))
            state.particles[b, w][anew] = new_mean[anew, :, None] + root @ steps
