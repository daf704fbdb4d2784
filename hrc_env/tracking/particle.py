"""The default estimator: particles that are hypotheses, each with a Gaussian of its own.

Given the discrete facts (is the body, or a limb, mirrored in depth; does a camera exchange
left and right) a whole body is well described by one Gaussian on the kinematic tree (`tree.state`).
What is left is discrete, and one Gaussian cannot hold it. This is a Rao-Blackwellised particle
filter (Doucet, de Freitas, Murphy and Russell, UAI 2000): the particles are the discrete facts,
the rest is integrated exactly. One particle suffices while the views agree; where one view is
left, other modes are searched for, weighted by Laplace's evidence, merged and dropped, until
the views decide (docs/tracking.md).
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.forecast import forecast, mixed
from hrc_env.tracking.hypotheses.filter import predict_all, update_all
from hrc_env.tracking.hypotheses.mixture import estimate_all, mixture_settings
from hrc_env.tracking.hypotheses.slots import Hypotheses
from hrc_env.tracking.measurements import arrays_of
from hrc_env.tracking.models.acquisition import STANDING_M
from hrc_env.tracking.models.noise import noise_model
from hrc_env.tracking.settings import settings_of
from hrc_env.tracking.tracks import blank, gaussian_tracks, report
from hrc_env.tracking.tree.state import NOISE, TREE, VIEW, forget_trees, motion
from hrc_env.tracking.tree.work import WORK


@dataclass(frozen=True, slots=True)
class ParticleEstimator:
    """Rao-Blackwellised particle filter; see `tracking.estimators.Estimator`."""

    P: Floats
    ctrl_dt: float
    config: ParticleConfig
    constants: tuple[Any, Any, Any] = field(init=False, repr=False)
    """Settings of one hypothesis, of the mixture, and its model of noise, as kernels take them."""

    def __post_init__(self) -> None:
        """Make what the kernels take, constants."""
        settings, noise = settings_of(self.config), noise_model(self.config, self.ctrl_dt)
        records = (settings, mixture_settings(self.config), noise)
        object.__setattr__(self, "constants", tuple(tuple(each) for each in records))

    def init(self, batch: int, n_workers: int) -> Hypotheses:
        """Workers whom nobody has seen."""
        lead, n_cameras = (batch, n_workers * self.config.n_hypotheses), len(self.P)
        state = Hypotheses(
            trees=np.zeros(lead, TREE).view(np.recarray),
            views=np.zeros((*lead, n_cameras), VIEW).view(np.recarray),
            noise=np.zeros((*lead, N_JOINTS, n_cameras), NOISE).view(np.recarray),
            n_alive=np.ones((batch, n_workers), np.int64),
            waited_s=np.zeros((batch, n_workers)),
        )
        self.reset(state, np.arange(batch), [])
        return state

    def reset(self, state: Hypotheses, ids: Ints, rngs: list[np.random.Generator]) -> None:
        """Forget environments `ids`; draws nothing."""
        del rngs
        forget_trees(state.trees, state.views, state.noise, ids, self.config)
        state.n_alive[ids], state.waited_s[ids] = 1, 0.0

    def predict(self, state: Hypotheses, dt_s: float, rngs: list[np.random.Generator]) -> None:
        """Move every hypothesis by its motion model; draws nothing."""
        del rngs
        model = motion(dt_s, self.config.damping, self.config.root_acceleration)
        predict_all(_plain(state), model, dt_s, *self.constants[:2], np.empty(1, WORK))

    def update(
        self, state: Hypotheses, keypoints: Keypoints, rngs: list[np.random.Generator]
    ) -> None:
        """Take one set of frames in; draws nothing."""
        del rngs
        batch, n_workers = state.n_alive.shape
        shape = (batch, len(self.P), n_workers, N_JOINTS)
        measured = (self.P, *arrays_of(keypoints, shape))
        update_all(_plain(state), *measured, STANDING_M, *self.constants, np.empty(1, WORK))

    def estimate(self, state: Hypotheses) -> PoseEstimate:
        """Mean and covariance of the mixture; ages are the heaviest hypothesis's."""
        out = blank(state.n_alive.shape)
        estimate_all(_plain(state), self.constants[0], out)
        return PoseEstimate(*out)

    def forecast(self, state: Hypotheses, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s`, hypothesis by hypothesis; see `tracking.forecast`."""
        each = report(gaussian_tracks(state.trees), self.config)
        return mixed(
            forecast(each, horizon_s, self.config), state.trees["log_weight"], state.n_alive
        )


def _plain(state: Hypotheses) -> tuple[Any, ...]:
    """Hypotheses as kernels take them."""
    return tuple(each.view(np.ndarray) for each in state)
