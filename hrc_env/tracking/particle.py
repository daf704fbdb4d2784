"""The default estimator: particles that are hypotheses, each with a Gaussian of its own.

A Rao-Blackwellised particle filter (Doucet, de Freitas, Murphy and Russell, UAI 2000): particles
are the discrete facts (is the body, or a limb, mirrored in depth), the rest is a Gaussian on the
kinematic tree (`tree.state`). One particle suffices while the views agree; where one view is left,
other modes are searched for, weighted by Laplace's evidence, merged and dropped, until the views
decide (docs/tracking.md).
"""

from dataclasses import dataclass, field

import numpy as np

from hrc_env.core.declared import Records1, make_records
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints, Rngs
from hrc_env.geometry.lines_of_sight import Camera, cameras_of
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.forecast import forecast, mixed
from hrc_env.tracking.measurements import arrays_of
from hrc_env.tracking.settings import Settings, settings_of
from hrc_env.tracking.tracks import EstimateArrays, bounded
from hrc_env.tracking.tree.body_filter import predict_all, update_all
from hrc_env.tracking.tree.learning import NoiseModel, make_noise_model
from hrc_env.tracking.tree.predict import make_motion_model
from hrc_env.tracking.tree.report import estimate_all
from hrc_env.tracking.tree.state import (
    Hypotheses,
    Tree,
    Work,
    make_hypotheses,
    reset_hypotheses,
)


@dataclass(frozen=True, slots=True)
class ParticleEstimator:
    """Rao-Blackwellised particle filter; see `tracking.estimators.Estimator`."""

    P: Floats
    ctrl_dt: float
    config: ParticleConfig
    cameras: Records1[Camera] = field(init=False, repr=False)
    """(C,) cameras of the projections `P`."""
    settings: Settings = field(init=False, repr=False)
    """The part of `config` that kernels take."""
    noise_model: NoiseModel = field(init=False, repr=False)
    """Constants for learning the measurement noise."""

    def __post_init__(self) -> None:
        """Make what the kernels take."""
        object.__setattr__(self, "cameras", cameras_of(self.P))
        object.__setattr__(self, "settings", settings_of(self.config))
        object.__setattr__(self, "noise_model", make_noise_model(self.config, self.ctrl_dt))

    def init(self, batch: int, n_workers: int) -> Hypotheses:
        """Workers whom nobody has seen."""
        return make_hypotheses(batch, n_workers, len(self.P), self.config)

    def reset(self, state: Hypotheses, ids: Ints, rngs: Rngs) -> None:
        """Forget environments `ids`; draws nothing."""
        reset_hypotheses(state, ids, self.config)

    def predict(self, state: Hypotheses, dt_s: float, rngs: Rngs) -> None:
        """Move every hypothesis by its motion model; draws nothing."""
        model = make_motion_model(dt_s, self.config.damping, self.config.root_acceleration)
        predict_all(state, model, dt_s, self.settings, make_records(Work, 1))

    def update(self, state: Hypotheses, keypoints: Keypoints, rngs: Rngs) -> None:
        """Take one set of frames in; draws nothing."""
        batch, n_workers = state.n_alive.shape
        measured = arrays_of(keypoints, (batch, len(self.P), n_workers, N_JOINTS))
        work, prior = make_records(Work, 1), make_records(Tree, 1)
        update_all(state, self.cameras, measured, self.settings, self.noise_model, work, prior)

    def estimate(self, state: Hypotheses) -> PoseEstimate:
        """Mean and covariance of the mixture; ages are the heaviest hypothesis's."""
        tracked = np.empty(state.n_alive.shape, bool)
        age_s = np.empty((*tracked.shape, N_JOINTS))
        mean, velocity = np.empty((2, *age_s.shape, 3))
        out = EstimateArrays(mean, np.empty((*age_s.shape, 3, 3)), velocity, age_s, tracked)
        estimate_all(state, self.settings, out)
        return self._widened(state, PoseEstimate(*out))

    def forecast(self, state: Hypotheses, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s`, hypothesis by hypothesis; see `tracking.forecast`."""
        body, cov, age_s, tracked = (
            state.trees[name].reshape(len(state.trees), -1, *state.trees[name].shape[3:])
            for name in ("body", "cov", "age_s", "tracked")
        )
        where = body[..., :3], cov[..., :3, :3].copy(), body[..., 3:]
        each = PoseEstimate(*where, age_s, tracked)
        later = forecast(bounded(each, self.config), horizon_s, self.config)
        whole = mixed(later, state.trees["log_weight"], state.n_alive)
        return self._widened(state, whole)

    def _widened(self, state: Hypotheses, estimate: PoseEstimate) -> PoseEstimate:
        """Widen, in place, what is said of workers whom one view has begun (they may be larger, and
        farther from the camera that has them, by the same share), or two that hang askew."""
        size_std = np.where(estimate.tracked, state.trees["size_std"][:, :, 0], 0.0)
        is_misaligned = estimate.tracked & state.trees["pair"]["is_misaligned"][:, :, 0]
        if not (size_std.any() or is_misaligned.any()):
            return estimate
        displaced_m2 = state.trees["displaced_m2"][:, :, 0]
        estimate.cov_world[is_misaligned] += displaced_m2[is_misaligned][:, None]
        eyes = -np.linalg.solve(self.P[:, :, :3], self.P[:, :, 3:])[..., 0]
        eye = eyes[state.views["unseen_updates"][:, :, 0].argmin(-1)]
        grown = size_std[..., None, None] * (estimate.mean_world - eye[:, :, None])
        estimate.cov_world[...] += grown[..., :, None] * grown[..., None, :]
        return bounded(estimate, self.config)
