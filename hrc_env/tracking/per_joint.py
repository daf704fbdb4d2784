"""The rival `per_joint`: a Gaussian particle filter per joint on a body motion model.

Each joint's belief is a Gaussian over position and velocity (Kotecha and Djuric, Gaussian
particle filtering, IEEE Trans. Signal Processing 51, 2003). An update undoes left/right swaps,
finds the posterior's mode, samples about it, weights the particles exactly, keeps their mean
and covariance, and lets bones of known length speak. Said honestly: with this likelihood and
four cameras the particles add next to nothing to the mode search; they repair heavy tails
when few views are left.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.tracking.ahead import ahead
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.joints.filter import predict_all, update_all
from hrc_env.tracking.joints.importance import make_noise
from hrc_env.tracking.measurements import arrays_of
from hrc_env.tracking.models.acquisition import STANDING_M
from hrc_env.tracking.models.bones import population
from hrc_env.tracking.models.motion import STANDING_COUNT, damped_joints
from hrc_env.tracking.settings import Settings, settings_of
from hrc_env.tracking.tracks import forget, gaussian_tracks, grow_older, report

_N_TABLES = 64


class PerJointState(NamedTuple):
    """Gaussian beliefs and what is learnt of each worker; arrays changed in place."""

    body: Floats
    """(B, W, J, 6) position [m] and velocity [m/s] in the world."""
    cov: Floats
    """(B, W, J, 6, 6)."""
    age_s: Floats
    """(B, W, J)."""
    tracked: Bools
    """(B, W)."""
    conflict: Ints
    """(B, W, J), as in `tracks.Tracks`."""
    offset: Floats
    """(B, W, J, 3) mean place of a joint on the body [m]: forward, left, up of the root."""
    offset_count: Floats
    """(B, W, J) updates that went into it."""
    bone_length: Floats
    """(B, W, 16) [m], in the order of `skeleton.BONES`."""
    bone_variance: Floats
    """(B, W, 16) [m^2]."""
    swap_chance: Floats
    """(B, W, C) probability that the camera exchanges left and right."""
    blind: Ints
    """(B, W, C) updates since the camera saw the worker."""
    believed: Ints
    """(B, W, C) updates for which it is still not asked about swaps."""
    ess: Floats
    """(B, W, J) effective sample size of the last update; 0 where there was none."""


@dataclass(frozen=True, slots=True)
class PerJointEstimator:
    """Gaussian particle filter; see `tracking.estimators.Estimator`."""

    P: Floats
    ctrl_dt: float
    config: TrackerConfig
    noise: NDArray[np.float32] = field(init=False, repr=False)
    """(n, 3, M) tables of draws, a constant."""
    n_mode: int = field(init=False)
    """How many of the M particles are drawn about the mode."""
    settings: Settings = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Make the table of noise and the kernels' settings, both constants."""
        n_prior = 2 * max(round(self.config.n_particles * self.config.defensive_share / 2), 3)
        n_mode = 2 * ((self.config.n_particles - n_prior) // 2)
        object.__setattr__(self, "n_mode", n_mode)
        object.__setattr__(self, "noise", make_noise(_N_TABLES, n_mode, n_prior))
        object.__setattr__(self, "settings", settings_of(self.config))

    def init(self, batch: int, n_workers: int) -> PerJointState:
        """Workers whom nobody has seen."""
        shape, n_cameras = (batch, n_workers), len(self.P)
        state = PerJointState(
            body=np.zeros((*shape, N_JOINTS, 6)),
            cov=np.zeros((*shape, N_JOINTS, 6, 6)),
            age_s=np.zeros((*shape, N_JOINTS)),
            tracked=np.zeros(shape, bool),
            conflict=np.zeros((*shape, N_JOINTS), np.int64),
            offset=np.zeros((*shape, N_JOINTS, 3)),
            offset_count=np.zeros((*shape, N_JOINTS)),
            bone_length=np.zeros((*shape, len(population(())[0]))),
            bone_variance=np.zeros((*shape, len(population(())[0]))),
            swap_chance=np.zeros((*shape, n_cameras)),
            blind=np.zeros((*shape, n_cameras), np.int64),
            believed=np.zeros((*shape, n_cameras), np.int64),
            ess=np.zeros((*shape, N_JOINTS)),
        )
        self._forget(state, np.arange(batch))
        return state

    def reset(self, state: PerJointState, ids: Ints, rngs: list[np.random.Generator]) -> None:
        """Forget environments `ids`; draws nothing."""
        del rngs
        self._forget(state, ids)

    def predict(self, state: PerJointState, dt_s: float, rngs: list[np.random.Generator]) -> None:
        """Move every tracked body by its motion model; draws nothing."""
        del rngs
        F, Q = damped_joints(dt_s, self.config.damping, self.config.root_acceleration)
        predict_all(state, F, Q, dt_s)
        grow_older(gaussian_tracks(state), dt_s, self.config)

    def update(
        self, state: PerJointState, keypoints: Keypoints, rngs: list[np.random.Generator]
    ) -> None:
        """Take one set of frames in; environment b draws which noise its joints get."""
        batch, n_workers = state.tracked.shape
        shape = (batch, len(self.P), n_workers, N_JOINTS)
        px, confidence, sigma_px = arrays_of(keypoints, shape)
        tables = np.empty((batch, n_workers, N_JOINTS), np.int64)
        for b in range(batch):
            tables[b] = rngs[b].integers(0, _N_TABLES, (n_workers, N_JOINTS))
        measured = (self.P, px, confidence, sigma_px)
        update_all(state, *measured, STANDING_M, self.noise, tables, self.n_mode, self.settings)

    def estimate(self, state: PerJointState) -> PoseEstimate:
        """What is believed now."""
        return report(gaussian_tracks(state), self.config)

    def ahead(self, state: PerJointState, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s`; see `tracking.ahead`."""
        return ahead(self.estimate(state), horizon_s, self.config)

    def _forget(self, state: PerJointState, ids: Ints) -> None:
        length, variance = population(())
        state.cov[ids] = np.eye(6)
        state.offset[ids], state.offset_count[ids] = STANDING_M, STANDING_COUNT
        state.bone_length[ids], state.bone_variance[ids] = length, variance
        state.swap_chance[ids] = self.config.swap_begins
        state.blind[ids], state.believed[ids], state.ess[ids] = 0, 0, 0.0
        forget(gaussian_tracks(state), ids, self.config)
