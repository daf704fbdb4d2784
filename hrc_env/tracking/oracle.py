"""Beliefs that no camera made: the truth itself, and the prior.

This is the one place where truth becomes belief (perception level `truth`, for teaching and
for upper bounds). The prior is what is believed at the level `none`, and by every estimator
before it has seen anything.
"""

from dataclasses import replace

import numpy as np

from hrc_env.core.records import PoseEstimate, WorkerTruth
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.tracks import as_estimate, make_tracks

ORACLE_STD_M = 1e-3
"""Standard deviation that is reported with the truth [m]: small, and invertible."""


def estimate_from_truth(truth: WorkerTruth) -> PoseEstimate:
    """The truth as an estimate: (B, W, J, ...) arrays, age 0, tracked."""
    shape = truth.joints_world.shape[:-1]
    return PoseEstimate(
        mean_world=truth.joints_world.copy(),
        cov_world=np.full((*shape, 3, 3), ORACLE_STD_M**2 * np.eye(3)),
        velocity_world=truth.velocity_world.copy(),
        age_s=np.zeros(shape),
        tracked=np.ones(shape[:-1], bool),
    )


def nobody(batch: int, n_workers: int, config: TrackerConfig) -> PoseEstimate:
    """What is believed where it is known that nobody is: the prior, and nothing unknown."""
    known = np.zeros((batch, n_workers))
    return replace(prior(batch, n_workers, config), unknown=known > 0, blind_s=known)


def prior(batch: int, n_workers: int, config: TrackerConfig) -> PoseEstimate:
    """What is believed of workers that nobody has seen: at `prior_mean_world`, at rest, not
    tracked."""
    return as_estimate(make_tracks(batch, n_workers, config))
