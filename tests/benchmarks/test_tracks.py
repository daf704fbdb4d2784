"""What predictions are tried on, and that the shipped one means what it says there."""

import numpy as np

from benchmarks.tracking.rigs import DT_S
from benchmarks.tracking.tracks import follow_env, follow_walkers

CHI2_95_3D = 7.815
WARM_UP, FRAMES_AHEAD = 25, 10


def predicted(estimator, state):
    return estimator.forecast(state, FRAMES_AHEAD * DT_S)


def misses(tracks):
    """Errors (T, S, J, 3) of predictions and of standing still, and covariances."""
    use = range(WARM_UP, len(tracks.truth) - FRAMES_AHEAD)
    then = np.stack([tracks.truth[t + FRAMES_AHEAD] for t in use])
    go = np.stack([tracks.looks[t].mean_world[:, 0] for t in use])
    stay = np.stack([tracks.estimates[t].mean_world[:, 0] for t in use])
    return go - then, stay - then, np.stack([tracks.looks[t].cov_world[:, 0] for t in use])


def rmse(errors):
    return np.sqrt((errors**2).sum(-1).mean())


def test_on_the_environments_own_worker_it_is_accurate_and_means_what_it_says():
    """Seeds that the network was not trained on."""
    go, stay, cov = misses(follow_env(list(range(2000, 2012)), 150, look=predicted))
    assert rmse(go) < 0.8 * rmse(stay)  # it learnt from walks and reaches only
    nees = np.einsum("...i,...ij,...j", go, np.linalg.inv(cov), go)
    assert 0.90 < (nees < CHI2_95_3D).mean() < 0.985
    assert 0.7 < np.sqrt(np.trace(cov, axis1=-2, axis2=-1).mean()) / rmse(go) < 1.5


def test_walkers_of_whom_it_never_heard_are_predicted_too():
    go, stay, _ = misses(follow_walkers([1, 2, 3, 4], 120, "clean", look=predicted))
    assert rmse(go) < 0.6 * rmse(stay)


def test_a_sequence_depends_on_its_own_seed_only():
    several = follow_env([5, 6], 40, failing=True)
    alone = follow_env([6], 40, failing=True)
    np.testing.assert_array_equal(several.truth[:, 1:], alone.truth)
    np.testing.assert_array_equal(
        several.estimates[-1].mean_world[1:], alone.estimates[-1].mean_world
    )


def test_failing_cameras_cost_certainty():
    spread = [
        np.mean([np.trace(each.cov_world, axis1=-2, axis2=-1).mean() for each in tracks.estimates])
        for tracks in (follow_env([5, 6], 100, failing=failing) for failing in (False, True))
    ]
    assert spread[1] > spread[0]
