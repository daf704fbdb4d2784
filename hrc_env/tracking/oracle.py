"""Estimates without cameras: the ground truth and the prior.

This is the only module that converts ground truth into an estimate (perception level `truth`, which
serves for teaching and for upper bounds on performance). The prior is the estimate at the level
`none`, and that of every estimator before the first detection.
"""

from dataclasses import replace

import numpy as np

from hrc_env.core.records import PoseEstimate, WorkerTruth
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.tracks import copy_estimate, make_tracks

ORACLE_STD_M = 1e-3
"""Standard deviation reported with the truth [m]. It is small, but the covariances remain
invertible."""


def estimate_from_truth(truth: WorkerTruth) -> PoseEstimate:
    """Return the truth as an estimate (B, W, J, ...) with all workers tracked and all ages 0."""
    shape = truth.joints_world.shape[:-1]
    return PoseEstimate(
        mean_world=truth.joints_world.copy(),
        cov_world=np.full((*shape, 3, 3), ORACLE_STD_M**2 * np.eye(3)),
        velocity_world=truth.velocity_world.copy(),
        age_s=np.zeros(shape),
        tracked=np.ones(shape[:-1], bool),
        misfit=np.zeros(shape),
        calibrated=np.ones(shape[:-1], bool),
    )


def estimate_absence(batch: int, n_workers: int, config: TrackerConfig) -> PoseEstimate:
    """Return the estimate for environments that are known to contain no people.

    Args:
        batch: number of environments B.
        n_workers: number of workers W in each environment.
        config: settings that contain the prior, which fills the arrays (B, W, J, ...).
    """
    known = np.zeros((batch, n_workers))
    return replace(estimate_prior(batch, n_workers, config), unknown=known > 0, unobserved_s=known)


def estimate_prior(batch: int, n_workers: int, config: TrackerConfig) -> PoseEstimate:
    """Return the estimate of workers that have never been detected: at rest and not tracked.

    Args:
        batch: number of environments B.
        n_workers: number of workers W in each environment.
        config: settings that contain the prior, which fills the arrays (B, W, J, ...).
    """
    return copy_estimate(make_tracks(batch, n_workers, config))
