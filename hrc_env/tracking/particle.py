"""The default estimator: a particle filter with hypotheses about Gaussian bodies as particles.

It is a Rao-Blackwellised particle filter (Doucet, de Freitas, Murphy and Russell, UAI 2000). The
particles represent discrete variables, such as whether the body or a limb is mirrored in depth; the
continuous state is a Gaussian on the kinematic tree (`tree.state`). One particle suffices while the
views agree. When only one view remains, the estimator searches for other modes, weights them by
Laplace's evidence, and merges and drops them until the views resolve the ambiguity
(docs/tracking.md).
"""

from dataclasses import dataclass, field

import numpy as np

from hrc_env.core.declared import Records1
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints, Rngs
from hrc_env.geometry.lines_of_sight import Camera, cameras_of
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.forecast import forecast, mix_hypotheses
from hrc_env.tracking.measurements import get_keypoint_arrays
from hrc_env.tracking.settings import Settings, make_settings
from hrc_env.tracking.tracks import EstimateArrays, bound_estimate
from hrc_env.tracking.tree.body_filter import predict_all, update_all
from hrc_env.tracking.tree.learning import NoiseModel, make_noise_model
from hrc_env.tracking.tree.predict import make_motion_model
from hrc_env.tracking.tree.report import estimate_all
from hrc_env.tracking.tree.state import (
    Hypotheses,
    lend_scratch,
    make_hypotheses,
    reset_hypotheses,
)


@dataclass(frozen=True, slots=True)
class ParticleEstimator:
    """Estimator by Rao-Blackwellised particle filtering; see `tracking.estimators.Estimator`."""

    P: Floats
    """(C, 3, 4) projections from the world [m] to pixels."""
    ctrl_dt: float
    """Nominal time between two updates [s]."""
    config: ParticleConfig
    """Settings of the estimator."""
    cameras: Records1[Camera] = field(init=False, repr=False)
    """(C,) cameras of the projections `P`."""
    settings: Settings = field(init=False, repr=False)
    """Settings as a named tuple, which compiled functions accept."""
    noise_model: NoiseModel = field(init=False, repr=False)
    """Constants for learning the measurement noise."""

    def __post_init__(self) -> None:
        """Compute the fields that compiled functions take as arguments."""
        object.__setattr__(self, "cameras", cameras_of(self.P))
        object.__setattr__(self, "settings", make_settings(self.config))
        object.__setattr__(self, "noise_model", make_noise_model(self.config, self.ctrl_dt))

    def init(self, batch: int, n_workers: int) -> Hypotheses:
        """Return a state with one hypothesis at the prior for every worker."""
        return make_hypotheses(batch, n_workers, len(self.P), self.config)

    def reset(self, state: Hypotheses, ids: Ints, rngs: Rngs) -> None:
        """Reset environments `ids` to the prior; `rngs` is not used."""
        reset_hypotheses(state, ids, self.config)

    def predict(self, state: Hypotheses, dt_s: float, rngs: Rngs) -> None:
        """Move every hypothesis by its motion model; `rngs` is not used."""
        model = make_motion_model(dt_s, self.config.damping, self.config.root_acceleration)
        predict_all(state, model, dt_s, self.settings, lend_scratch().work)

    def update(self, state: Hypotheses, keypoints: Keypoints, rngs: Rngs) -> None:
        """Condition every hypothesis on one set of frames; `rngs` is not used."""
        batch, n_workers = state.n_alive.shape
        measured = get_keypoint_arrays(keypoints, (batch, len(self.P), n_workers, N_JOINTS))
        scratch = lend_scratch()
        update_all(
            state, self.cameras, measured, self.settings, self.noise_model, scratch.work,
            scratch.prior,
        )  # fmt: skip

    def estimate(self, state: Hypotheses) -> PoseEstimate:
        """Return the moments of the mixture of hypotheses, with the ages of the heaviest one."""
        tracked = np.empty(state.n_alive.shape, np.bool_)
        age_s = np.empty((*tracked.shape, N_JOINTS))
        mean, velocity = np.empty((2, *age_s.shape, 3))
        out = EstimateArrays(mean, np.empty((*age_s.shape, 3, 3)), velocity, age_s, tracked)
        is_displaced = estimate_all(state, self.settings, out)
        estimate = PoseEstimate(*out)
        return self._widen(state, estimate) if is_displaced else estimate

    def forecast(self, state: Hypotheses, horizon_s: float) -> PoseEstimate:
        """Return the estimate expected after `horizon_s` [s], a mixture over all hypotheses."""
        batch, n_workers, n = state.trees.shape
        fields = (state.trees[name] for name in ("body", "cov", "age_s", "tracked"))
        shape = batch, n_workers * n
        body, cov, age_s, tracked = (each.reshape(*shape, *each.shape[3:]) for each in fields)
        now = PoseEstimate(
            mean_world=body[..., :3],
            cov_world=cov[..., :3, :3].copy(),
            velocity_world=body[..., 3:],
            age_s=age_s,
            tracked=tracked,
        )
        later = forecast(bound_estimate(now, self.config), horizon_s, self.config)
        mixture = mix_hypotheses(later, state.trees["log_weight"], state.n_alive)
        return self._widen(state, mixture)

    def _widen(self, state: Hypotheses, estimate: PoseEstimate) -> PoseEstimate:
        """Add errors that the hypotheses do not represent, and return the bounded estimate.

        Two errors displace all joints of a worker together. If two cameras are misaligned, the
        whole body may be displaced; the covariance of this displacement is added to that of every
        joint. If the track was started from one view, the body may be larger and, by the same
        factor, farther from the camera; every joint then has an error along its ray, proportional
        to its distance from the camera. Finally, the covariances are bounded by the settings.

        Args:
            state: the hypotheses, of which the heaviest (index 0 of axis H) is read.
            estimate: (B, W, ...) estimate, changed in place.
        """
        trees, views = state.trees, state.views  # (B, W, H) and (B, W, H, C)
        # (B, W) relative error of body size and distance; 0 once two cameras agree
        size_std = np.where(estimate.tracked, trees["size_std"][:, :, 0], 0.0)
        is_misaligned = estimate.tracked & trees["pair"]["is_misaligned"][:, :, 0]  # (B, W)
        if not (size_std.any() or is_misaligned.any()):
            return estimate

        # (n, 3, 3) for the n workers with misaligned cameras
        displacement_cov = trees["displaced_m2"][:, :, 0][is_misaligned]
        estimate.cov_world[is_misaligned] += displacement_cov[:, None]  # the same for all J joints

        camera_centres = -np.linalg.solve(self.P[:, :, :3], self.P[:, :, 3:])[..., 0]  # (C, 3)
        # (B, W) camera that saw the worker last
        last_camera = views["unseen_updates"][:, :, 0].argmin(-1)
        rays = estimate.mean_world - camera_centres[last_camera][:, :, None]  # (B, W, J, 3)
        radial_std = size_std[..., None, None] * rays  # (B, W, J, 3) vector of length one sigma
        estimate.cov_world[...] += radial_std[..., :, None] * radial_std[..., None, :]
        return bound_estimate(estimate, self.config)
