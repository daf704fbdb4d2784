"""Beliefs that no camera made."""

import numpy as np

from hrc_env.core.records import WorkerTruth
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.oracle import estimate_from_truth, estimate_prior


def test_the_truth_becomes_a_sure_and_present_belief():
    rng = np.random.default_rng(0)
    truth = WorkerTruth(
        rng.random((2, 3, 15, 3)), rng.random((2, 3, 15, 3)), np.zeros((2, 3, 4, 2, 3)), np.ones(4)
    )
    belief = estimate_from_truth(truth)
    np.testing.assert_array_equal(belief.mean_world, truth.joints_world)
    np.testing.assert_array_equal(belief.velocity_world, truth.velocity_world)
    assert (np.linalg.eigvalsh(belief.cov_world) > 0).all()
    assert (np.linalg.eigvalsh(belief.cov_world) < 0.01**2).all()
    assert belief.tracked.all()
    assert (belief.age_s == 0).all()
    assert not np.shares_memory(belief.mean_world, truth.joints_world)


def test_the_prior_covers_the_working_area_and_claims_no_track():
    config = TrackerConfig(prior_mean_world=(1.0, 0.5, 0.9), prior_std_m=2.0, max_age_s=7.0)
    belief = estimate_prior(2, 1, config)
    assert belief.mean_world.shape == (2, 1, 15, 3)
    np.testing.assert_array_equal(belief.mean_world[1, 0, 14], [1.0, 0.5, 0.9])
    np.testing.assert_array_equal(belief.cov_world[1, 0, 14], 4.0 * np.eye(3))
    assert (belief.age_s == 7.0).all()
    assert not belief.tracked.any()
