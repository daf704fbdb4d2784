"""Cost of given separations, and errors of given bodies; that these are true: test_truth.py."""

import numpy as np
import pytest

from hrc_env.core.records import PoseEstimate, WorkerTruth
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.safety import incidents
from hrc_env.safety.cost import Cost, CostConfig, measure_cost
from hrc_env.tracking.metrics import make_identities, measure_errors


def costs(distance_m: list[float], n_workers: int = 1) -> Cost:
    """Of a worker who is an upright capsule at x = distance, one a substep, beside such a robot."""
    robot = np.zeros((1, len(distance_m), 1, 2, 3))
    robot[..., 1, 2] = 1.0
    workers = np.repeat(robot[:, :, None], n_workers, axis=2)
    workers[..., 0] = np.array(distance_m)[:, None, None, None]
    radius_m = np.full((1, n_workers, 1), 0.1)
    paths = incidents.measure_paths(robot, np.array([0.05]), workers, radius_m)
    return measure_cost(paths.gaps_m, CostConfig())


@pytest.mark.parametrize(
    ("distance_m", "proximity", "contact"),
    [(0.50, 0, 0), (0.31, 0, 0), (0.29, 1, 0), (0.16, 1, 0), (0.14, 1, 1)],
)
def test_cost_by_the_gap_between_surfaces(distance_m, proximity, contact):
    """Radii 0.05 and 0.10: the gap is the distance less 0.15 m; the limit is 0.15 m."""
    result = costs([distance_m])
    assert (result.proximity[0], result.contact[0]) == (proximity, contact)
    assert result.min_separation_m[0] == pytest.approx(distance_m - 0.15)


def test_a_hand_that_passes_through_between_two_steps_is_a_contact():
    """Before and after the arm, touching it at one substep only."""
    assert costs([0.6, 0.3, 0.1, -0.3, -0.6]).contact[0] == 1


def test_without_workers_nothing_costs():
    result = costs([0.0, 0.0], n_workers=0)
    assert (result.proximity[0], result.contact[0]) == (0, 0)
    assert np.isinf(result.min_separation_m[0])


LEFT, RIGHT, NEARER, AWAY = 0.0, 2.0, 0.3, 9.0
"""Places along x [m]: two people apart, one nearer to the left one, somebody far from all."""


def bodies_at(x_m) -> np.ndarray:
    """(1, W, J, 3) bodies whose joints are all in one place."""
    joints = np.zeros((1, len(x_m), N_JOINTS, 3))
    joints[..., 0] = np.array(x_m)[None, :, None]
    return joints


def estimate(x_m, tracked) -> PoseEstimate:
    mean = bodies_at(x_m)
    shape = mean.shape[:3]
    return PoseEstimate(
        mean, np.tile(np.eye(3), (*shape, 1, 1)), np.zeros_like(mean), np.zeros(shape),
        np.array([tracked]),
    )  # fmt: skip


def errors(steps, present=None):
    """What each step is told, of (people [m], tracks [m], which slots have one) in turn."""
    n_workers = len(steps[0][0])
    there = np.array([[True] * n_workers if present is None else present])
    identities, found = make_identities(1, n_workers), []
    for people, tracks, tracked in steps:
        joints = bodies_at(people)
        truth = WorkerTruth(joints, joints, np.zeros((1, n_workers, 1, 2, 3)), np.ones(1))
        found.append(
            measure_errors(estimate(tracks, tracked), truth.joints_world, there, identities)[0]
        )
    return found


BOTH, FIRST, SECOND, NOBODY = [True, True], [True, False], [False, True], [False, False]
TWO = (LEFT, RIGHT)
RIGHT_TRACKS, EXCHANGED = (TWO, TWO, BOTH), (TWO, TWO[::-1], BOTH)


def test_the_tracking_error_is_the_mean_distance_of_joints():
    (found,) = errors([([0.0], [0.03], [True])])
    assert found["mpjpe_m"] == found["mpjpe_by_identity_m"] == pytest.approx(0.03)
    assert found["lost"] == found["id_switches"] == 0
    assert found["idf1"] == 1


def test_a_worker_without_a_track_has_no_error_and_is_lost():
    """The estimate is then the prior, or where the worker was last, and nobody is matched."""
    (found,) = errors([([0.0], [0.0], [False])])
    assert np.isnan(found["mpjpe_m"])
    assert np.isnan(found["mpjpe_by_identity_m"])
    assert found["lost"] == 1
    assert found["idf1"] == 0


def test_where_nobody_is_there_and_nobody_tracked_there_is_nothing_to_compare():
    (found,) = errors([(TWO, TWO, NOBODY)], present=NOBODY)
    assert np.isnan([found["mpjpe_m"], found["mpjpe_by_identity_m"], found["idf1"]]).all()
    assert found["lost"] == 0


def test_two_who_are_exchanged_are_two_switches_that_mpjpe_does_not_see():
    found = errors([RIGHT_TRACKS] * 3 + [EXCHANGED] * 3)
    assert [each["id_switches"] for each in found] == [0, 0, 0, 2, 2, 2]
    assert all(each["mpjpe_m"] == 0 for each in found)
    assert [each["idf1"] for each in found] == pytest.approx([1, 1, 1, 3 / 4, 3 / 5, 1 / 2])


def test_a_match_lasts_while_it_is_within_the_gate_though_another_would_fit_better():
    near = (LEFT, NEARER)
    found = errors([(near, near, BOTH)] + [(near, near[::-1], BOTH)] * 4)
    assert found[-1]["id_switches"] == 0
    assert found[-1]["mpjpe_m"] == 0
    assert found[-1]["mpjpe_by_identity_m"] == pytest.approx(NEARER)
    assert found[-1]["idf1"] == 1


def test_who_returns_to_the_same_slot_has_not_switched_and_to_another_one_has():
    left = [(TWO, TWO, BOTH)] + [(TWO, TWO, SECOND)] * 2
    again = errors([*left, RIGHT_TRACKS])
    assert again[-1]["id_switches"] == 0
    assert again[-1]["idf1"] == pytest.approx(2 * 6 / (8 + 6))
    three = ((LEFT, RIGHT, AWAY), (AWAY, RIGHT, LEFT))
    start = ((LEFT, RIGHT, AWAY), (LEFT, RIGHT, 5.0), [True, True, False])
    elsewhere = errors([start, (*three, [False, True, True])], present=[True, True, False])
    assert elsewhere[-1]["id_switches"] == 1
    assert elsewhere[-1]["idf1"] == pytest.approx(2 * 3 / (4 + 4))


def test_a_track_beyond_the_gate_is_nobodys_and_its_worker_keeps_its_error():
    found = errors([RIGHT_TRACKS, (TWO, (LEFT, RIGHT + 0.7), BOTH)])
    assert found[-1]["id_switches"] == 0
    assert found[-1]["mpjpe_by_identity_m"] == found[-1]["mpjpe_m"] == pytest.approx(0.35)
    assert found[-1]["idf1"] == pytest.approx(2 * 3 / 8)


def test_as_many_as_possible_are_matched_before_distances_are_compared():
    """The first track is nearer to the second worker, whom alone the second track could follow."""
    people, tracks = (0.0, 0.4), (0.35, 0.8)
    (found,) = errors([(people, tracks, BOTH)])
    assert found["mpjpe_by_identity_m"] == pytest.approx((0.35 + 0.4) / 2)


def test_who_is_absent_is_not_matched_and_a_track_of_nobody_counts_against_idf1():
    found = errors([((LEFT, RIGHT), (LEFT, RIGHT), BOTH)] * 2, present=FIRST)
    assert found[-1]["idf1"] == pytest.approx(2 * 2 / (2 + 4))
    assert found[-1]["mpjpe_by_identity_m"] == 0
    assert found[-1]["lost"] == 0
