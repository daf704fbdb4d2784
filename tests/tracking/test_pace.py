"""Who moves vigorously before one camera is reported with wider deviations; who works is not."""

import numpy as np
import pytest

from benchmarks.tracking.rigs import DT_S, make_rig
from benchmarks.tracking.sequences import make_sequences
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.tree.report import MOST_MOVING, find_pace_factor, forget_pace, update_pace
from hrc_env.tracking.tree.state import PACE

STANDS = np.zeros((15, 6))
STANDS[[1, 3, 5, 7, 9, 11, 13], 1], STANDS[[2, 4, 6, 8, 10, 12, 14], 1] = 0.2, -0.2
STANDS[:, 2] = [1.6, *[1.4] * 2, *[1.1] * 2, *[0.9] * 2, *[0.95] * 2, *[0.5] * 2, *[0.1] * 4]


def moved(turn_rad_s=0.0, tip_rad_s=0.0, speed_m_s=0.0, n=60):
    """The factor after a while of such a movement, between two updates 0.04 s apart."""
    known = np.zeros(1, PACE)[0]
    for k in range(n):
        body = STANDS.copy()
        turn, tip = 0.04 * k * turn_rad_s, 0.04 * k * tip_rad_s
        about_z = [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
        about_y = [[np.cos(tip), 0, np.sin(tip)], [0, 1, 0], [-np.sin(tip), 0, np.cos(tip)]]
        body[:, :3] = body[:, :3] @ np.transpose(about_y) @ np.transpose(about_z)
        body[:, 3] = speed_m_s
        update_pace(known, body, 0.04 if k else 0.0)
    return find_pace_factor(known)


def test_people_who_stand_and_walk_and_turn_as_workers_do_are_reported_as_the_model_says():
    assert moved() == 1.0
    assert moved(turn_rad_s=1.5, speed_m_s=1.4) == moved(tip_rad_s=0.3) == 1.0


@pytest.mark.parametrize(
    ("movement", "usual"),
    [("turn_rad_s", 2.3), ("tip_rad_s", 0.52), ("speed_m_s", 1.63)],
)
def test_the_factor_grows_with_each_movement_up_to_a_bound(movement, usual):
    factors = [moved(**{movement: usual * k}) for k in (0.9, 1.3, 2.0, 10.0)]
    assert factors[0] == 1.0
    assert 1.0 < factors[1] < factors[2] <= factors[3] <= MOST_MOVING


@pytest.mark.parametrize("condition", ["spins_one_camera", "small_circles_one_camera"])
def test_who_turns_fast_before_one_camera_is_reported_honestly(condition):
    """Seeds 700 to 707; the law was fitted on 1000 to 1023."""
    rig, seeds = make_rig("lab"), list(range(700, 708))
    given = make_sequences(rig, condition, seeds)
    estimator = make_estimator("particle", rig.P, DT_S, given.config)
    state = estimator.init(len(seeds), 1)
    estimator.reset(state, np.arange(len(seeds)), [])
    squared, variance = [], []
    for t in range(150):
        estimator.predict(state, DT_S, [])
        estimator.update(state, given.keypoints(t), [])
        estimate = estimator.estimate(state)
        squared.append(((estimate.mean_world - given.joints[t]) ** 2).sum(-1))
        variance.append(np.trace(estimate.cov_world, axis1=-2, axis2=-1))
    ratio = np.sqrt(np.mean(variance[40:]) / np.mean(squared[40:]))
    assert 0.6 < ratio < 1.6


def test_how_fast_a_body_moves_is_known_from_its_second_moment_on():
    known = np.zeros(1, PACE)[0]
    for dt_s in (0.04, 0.0):  # first seen, then seen again at the same time
        update_pace(known, STANDS, dt_s)
        assert [known[name] for name in ("turn_rad_s", "tip_rad_s", "speed_m_s")] == [0.0] * 3


def test_a_lost_track_begins_with_no_pace():
    known = np.zeros(1, PACE)[0]
    update_pace(known, STANDS, 0.0)
    known["turn_rad_s"] = 9.0
    forget_pace(known)
    assert find_pace_factor(known) == 1.0
