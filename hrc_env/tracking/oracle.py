"""Estimates that no camera made: the truth itself, and the prior.

This is the one place where truth becomes belief (perception level `truth`, for teaching and for
upper bounds). The prior is the estimate of the level `none`, and of every estimator before it has
seen anything.
"""

from dataclasses import replace

import numpy as np

from hrc_env.core.records import PoseEstimate, WorkerTruth
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.tracks import copy_estimate, make_tracks

ORACLE_STD_M = 1e-3
"""Standard deviation that is reported with the truth [m]: small, and invertible."""


def estimate_from_truth(truth: WorkerTruth) -> PoseEstimate:
    """Return the truth as an estimate with arrays (B, W, J, ...): tracked, and of age 0."""
    shape = truth.joints_world.shape[:-1]
    return PoseEstimate(
        mean_world=truth.joints_world.copy(),
        cov_world=np.full((*shape, 3, 3), ORACLE_STD_M**2 * np.eye(3)),
        velocity_world=truth.velocity_world.copy(),
        age_s=np.zeros(shape),
        tracked=np.ones(shape[:-1], bool),
    )


def estimate_absence(batch: int, n_workers: int, config: TrackerConfig) -> PoseEstimate:
    """Return the estimate where it is known that no person is present.

    Args:
        batch: number of environments B.
        n_workers: number of workers W in each.
        config: the prior, which the arrays (B, W, J, ...) hold.
    """
    known = np.zeros((batch, n_workers))
    return replace(estimate_prior(batch, n_workers, config), unknown=known > 0, unobserved_s=known)


def estimate_prior(batch: int, n_workers: int, config: TrackerConfig) -> PoseEstimate:
    """Return the estimate of workers that have never been detected: at rest and not tracked.

    Args:
        batch: number of environments B.
        n_workers: number of workers W in each.
        config: the prior, which the arrays (B, W, J, ...) hold.
    """
    return copy_estimate(make_tracks(batch, n_workers, config))
