"""Cost and errors are counted on the truth, at every substep."""

import numpy as np
import pytest

from hrc_env.core.records import PoseEstimate, WorkerTruth
from hrc_env.metrics import CostConfig, cost, tracking_error

ROBOT_RADIUS, WORKER_RADIUS = np.array([0.05]), np.array([0.1])


def worker_at(distance_m: np.ndarray) -> np.ndarray:
    """A worker who is one upright capsule at x = distance, one a substep: (1, T, 1, 1, 2, 3)."""
    capsules = np.zeros((1, len(distance_m), 1, 1, 2, 3))
    capsules[0, :, 0, 0, :, 0] = distance_m[:, None]
    capsules[0, :, 0, 0, 1, 2] = 1.0
    return capsules


def robot(steps: int) -> np.ndarray:
    bodies = np.zeros((1, steps, 1, 2, 3))
    bodies[..., 1, 2] = 1.0
    return bodies


@pytest.mark.parametrize(
    ("distance_m", "proximity", "contact"),
    [(0.50, 0, 0), (0.31, 0, 0), (0.29, 1, 0), (0.16, 1, 0), (0.14, 1, 1)],
)
def test_cost_by_the_gap_between_surfaces(distance_m, proximity, contact):
    """Radii 0.05 and 0.10: the gap is the distance less 0.15 m; the limit is 0.15 m."""
    worker = worker_at(np.array([distance_m]))
    result = cost(robot(1), ROBOT_RADIUS, worker, WORKER_RADIUS, CostConfig())
    assert (result.proximity[0], result.contact[0]) == (proximity, contact)
    assert result.total[0] == proximity + contact
    assert result.min_separation_m[0] == pytest.approx(distance_m - 0.15)


def test_a_hand_that_passes_through_between_two_steps_is_a_contact():
    """Before and after the arm, touching it at one substep only."""
    passing = worker_at(np.array([0.6, 0.3, 0.1, -0.3, -0.6]))
    assert cost(robot(5), ROBOT_RADIUS, passing, WORKER_RADIUS, CostConfig()).contact[0] == 1


def test_without_workers_nothing_costs():
    nobody = np.zeros((1, 2, 0, 1, 2, 3))
    result = cost(robot(2), ROBOT_RADIUS, nobody, WORKER_RADIUS, CostConfig())
    assert result.total[0] == 0
    assert np.isinf(result.min_separation_m[0])


def estimate(offset_m: float, tracked: bool) -> PoseEstimate:
    shape = (1, 1, 15)
    return PoseEstimate(
        np.full((*shape, 3), [offset_m, 0.0, 0.0]), np.tile(np.eye(3), (*shape, 1, 1)),
        np.zeros((*shape, 3)), np.zeros(shape), np.full((1, 1), tracked),
    )  # fmt: skip


def test_the_tracking_error_is_the_mean_distance_of_joints():
    joints = np.zeros((1, 1, 15, 3))
    truth = WorkerTruth(joints, joints, np.zeros((1, 1, 1, 2, 3)), np.array([0.1]))
    error_m, lost = tracking_error(estimate(0.03, True), truth, np.ones((1, 1), bool))
    assert error_m[0] == pytest.approx(0.03)
    assert not lost[0]


def test_a_worker_without_a_track_has_no_error_and_is_lost():
    joints = np.zeros((1, 1, 15, 3))
    truth = WorkerTruth(joints, joints, np.zeros((1, 1, 1, 2, 3)), np.array([0.1]))
    error_m, lost = tracking_error(estimate(0.03, False), truth, np.ones((1, 1), bool))
    assert np.isnan(error_m[0])
    assert lost[0]
