"""The state of Gaussians on the kinematic tree, one for every hypothesis about every worker.

The joints of a body share their errors: with one view the depth of all of them is wrong
together. A filter that keeps each joint for itself counts one shared uncertainty fifteen times
over and believes what it should not. Here the whole body is one Gaussian whose dependencies
are the kinematic tree's: a prediction with exact moments (`predict`), a robust search (`search`),
one exact update and a step from the mode to the mean (`update`), with bones of known length on
every edge (`bone_lengths`) and a noise of every camera that is learnt (`models.noise`).
"""

import functools
from typing import NamedTuple

import numpy as np

from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.models.acquisition import STANDING_M
from hrc_env.tracking.models.motion import STANDING_COUNT, damped_joints, whole_body_noise
from hrc_env.tracking.models.noise import N_SUMS, first_factor
from hrc_env.tracking.tracks import forget, gaussian_tracks
from hrc_env.tracking.tree.bone_lengths import population_edges


class Trees(NamedTuple):
    """The Gaussian and what is learnt of each worker; arrays changed in place."""

    body: Floats
    """(B, W, J, 6) mean position [m] and velocity [m/s] in the world."""
    cov: Floats
    """(B, W, J, 6, 6) marginal covariances."""
    slope: Floats
    """(B, W, J, 6, 6) slopes on the parent, as in `tree`."""
    age_s: Floats
    """(B, W, J)."""
    tracked: Bools
    """(B, W)."""
    conflict: Ints
    """(B, W, J), as in `tracks.Tracks`."""
    offset: Floats
    """(B, W, J, 3) mean place of a joint on the body [m]: forward, left, up of the torso."""
    offset_count: Floats
    """(B, W, J) updates that went into it."""
    bone_length: Floats
    """(B, W, J) from each joint to its parent [m]."""
    bone_variance: Floats
    """(B, W, J) [m^2]."""
    swap_chance: Floats
    """(B, W, C) probability that the camera exchanges left and right."""
    blind: Ints
    """(B, W, C) updates since the camera saw the worker."""
    believed: Ints
    """(B, W, C) updates for which it is still not asked about swaps."""
    noise_factor: Floats
    """(B, W, J, C) learnt factors on the variance that the detector reports, as in `noise`."""
    noise_sums: Floats
    """(B, W, J, C, 5) what they are learnt from."""
    noise_last: Floats
    """(B, W, J, C, 2) last residuals in reported standard deviations, fading; 0: none."""


def make_trees(batch: int, n_bodies: int, n_cameras: int, config: ParticleConfig) -> Trees:
    """Bodies whom nobody has seen."""
    shape = (batch, n_bodies)
    state = Trees(
        body=np.zeros((*shape, N_JOINTS, 6)),
        cov=np.zeros((*shape, N_JOINTS, 6, 6)),
        slope=np.zeros((*shape, N_JOINTS, 6, 6)),
        age_s=np.zeros((*shape, N_JOINTS)),
        tracked=np.zeros(shape, bool),
        conflict=np.zeros((*shape, N_JOINTS), np.int64),
        offset=np.zeros((*shape, N_JOINTS, 3)),
        offset_count=np.zeros((*shape, N_JOINTS)),
        bone_length=np.zeros((*shape, N_JOINTS)),
        bone_variance=np.zeros((*shape, N_JOINTS)),
        swap_chance=np.zeros((*shape, n_cameras)),
        blind=np.zeros((*shape, n_cameras), np.int64),
        believed=np.zeros((*shape, n_cameras), np.int64),
        noise_factor=np.ones((*shape, N_JOINTS, n_cameras)),
        noise_sums=np.zeros((*shape, N_JOINTS, n_cameras, N_SUMS)),
        noise_last=np.zeros((*shape, N_JOINTS, n_cameras, 2)),
    )
    forget_trees(state, np.arange(batch), config)
    return state


def forget_trees(state: Trees, ids: Ints, config: ParticleConfig) -> None:
    """Put environments `ids` back to the prior."""
    length, variance = population_edges()
    state.cov[ids], state.slope[ids] = np.eye(6), 0.0
    state.offset[ids], state.offset_count[ids] = STANDING_M, STANDING_COUNT
    state.bone_length[ids], state.bone_variance[ids] = length, variance
    state.swap_chance[ids] = config.swap_begins
    state.blind[ids], state.believed[ids] = 0, 0
    state.noise_factor[ids] = first_factor(config)
    state.noise_sums[ids], state.noise_last[ids] = 0.0, 0.0
    forget(gaussian_tracks(state), ids, config)


@functools.lru_cache(maxsize=16)
def motion(dt_s: float, damping: float, acceleration: float) -> tuple[Floats, ...]:
    """F, travel, Q (J, 2, 2) and shared noise (2, 2), as `tree.predict.predict_tree` takes them."""
    F, Q = damped_joints(dt_s, damping, acceleration)
    travel = np.array([[1.0, dt_s], [0.0, 1.0]]) - F
    return F, travel, Q, whole_body_noise(dt_s, acceleration)
