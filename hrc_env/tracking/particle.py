"""The default estimator: particles that are hypotheses, each with a Gaussian of its own.

A Rao-Blackwellised particle filter (Doucet, de Freitas, Murphy and Russell, UAI 2000): particles
are the discrete facts (is the body, or a limb, mirrored in depth), the rest is a Gaussian on the
kinematic tree (`tree.state`). One particle suffices while the views agree; where one view is left,
other modes are searched for, weighted by Laplace's evidence, merged and dropped, until the views
decide (docs/tracking.md).
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints, Rngs
from hrc_env.geometry.lines_of_sight import cameras_of
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.forecast import forecast, mixed
from hrc_env.tracking.measurements import arrays_of
from hrc_env.tracking.settings import settings_of
from hrc_env.tracking.tracks import bounded
from hrc_env.tracking.tree.body_filter import predict_all, update_all
from hrc_env.tracking.tree.learning import noise_model
from hrc_env.tracking.tree.predict import motion
from hrc_env.tracking.tree.report import estimate_all
from hrc_env.tracking.tree.state import NOISE, PACE, TREE, VIEW, WORK, Hypotheses, forget_trees


@dataclass(frozen=True, slots=True)
class ParticleEstimator:
    """Rao-Blackwellised particle filter; see `tracking.estimators.Estimator`."""

    P: Floats
    ctrl_dt: float
    config: ParticleConfig
    cameras: Any = field(init=False, repr=False)
    """(C,) records of `lines_of_sight.CAMERA`, of the projections `P`."""
    settings: tuple[Any, ...] = field(init=False, repr=False)
    noise: tuple[Any, ...] = field(init=False, repr=False)
    """`settings.Settings` and `learning.NoiseModel` as kernels take them."""

    def __post_init__(self) -> None:
        """Make what the kernels take."""
        object.__setattr__(self, "cameras", cameras_of(self.P))
        object.__setattr__(self, "settings", tuple(settings_of(self.config)))
        object.__setattr__(self, "noise", tuple(noise_model(self.config, self.ctrl_dt)))

    def init(self, batch: int, n_workers: int) -> Hypotheses:
        """Workers whom nobody has seen."""
        lead, n_cameras = (batch, n_workers, self.config.n_hypotheses), len(self.P)
        state = Hypotheses(
            trees=np.zeros(lead, TREE),
            views=np.zeros((*lead, n_cameras), VIEW),
            noise=np.zeros((*lead, N_JOINTS, n_cameras), NOISE),
            n_alive=np.ones((batch, n_workers), np.int64),
            waited_s=np.zeros((batch, n_workers)),
            pace=np.zeros((batch, n_workers), PACE),
        )
        self.reset(state, np.arange(batch), [])
        return state

    def reset(self, state: Hypotheses, ids: Ints, rngs: Rngs) -> None:
        """Forget environments `ids`; draws nothing."""
        forget_trees(state.trees, state.views, state.noise, ids, self.config)
        state.n_alive[ids], state.waited_s[ids] = 1, 0.0
        state.pace[ids] = np.zeros((), PACE)

    def predict(self, state: Hypotheses, dt_s: float, rngs: Rngs) -> None:
        """Move every hypothesis by its motion model; draws nothing."""
        model = motion(dt_s, self.config.damping, self.config.root_acceleration)
        predict_all(tuple(state), model, dt_s, self.settings, np.empty(1, WORK))

    def update(self, state: Hypotheses, keypoints: Keypoints, rngs: Rngs) -> None:
        """Take one set of frames in; draws nothing."""
        batch, n_workers = state.n_alive.shape
        measured = arrays_of(keypoints, (batch, len(self.P), n_workers, N_JOINTS))
        constants = (self.settings, self.noise)
        scratch = np.empty(1, WORK), np.empty(1, TREE)
        update_all(tuple(state), self.cameras, measured, *constants, *scratch)

    def estimate(self, state: Hypotheses) -> PoseEstimate:
        """Mean and covariance of the mixture; ages are the heaviest hypothesis's."""
        tracked = np.empty(state.n_alive.shape, bool)
        age_s = np.empty((*tracked.shape, N_JOINTS))
        mean, velocity = np.empty((2, *age_s.shape, 3))
        out = mean, np.empty((*age_s.shape, 3, 3)), velocity, age_s, tracked
        estimate_all(tuple(state), self.settings, out)
        return self._widened(state, PoseEstimate(*out))

    def forecast(self, state: Hypotheses, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s`, hypothesis by hypothesis; see `tracking.forecast`."""
        trees = state.trees.reshape(len(state.trees), state.trees[0].size)
        body, cov = trees["body"], trees["cov"]
        where = body[..., :3], cov[..., :3, :3].copy(), body[..., 3:]
        each = PoseEstimate(*where, trees["age_s"], trees["tracked"])
        later = forecast(bounded(each, self.config), horizon_s, self.config)
        whole = mixed(later, state.trees["log_weight"], state.n_alive)
        return self._widened(state, whole)

    def _widened(self, state: Hypotheses, estimate: PoseEstimate) -> PoseEstimate:
        """Widen, in place, what is said of workers whom one view has begun (they may be larger, and
        farther from the camera that has them, by the same share), or two that hang askew."""
        best = state.trees[:, :, 0]
        size_std = np.where(estimate.tracked, best["size_std"], 0.0)
        askew = estimate.tracked & best["pair"]["askew"]
        if not (size_std.any() or askew.any()):
            return estimate
        estimate.cov_world[askew] += best["displaced_m2"][askew][:, None]
        eyes = -np.linalg.solve(self.P[:, :, :3], self.P[:, :, 3:])[..., 0]
        eye = eyes[state.views["blind"][:, :, 0].argmin(-1)]
        grown = size_std[..., None, None] * (estimate.mean_world - eye[:, :, None])
        estimate.cov_world[...] += grown[..., :, None] * grown[..., None, :]
        return bounded(estimate, self.config)
