"""A body's segments from its joints."""

import numpy as np

from hrc_env.core.skeleton import HAND_SEGMENTS, JOINT, SEGMENT_ENDS, SEGMENT_RADIUS_M
from hrc_env.geometry.distances import segments

JOINTS_WORLD = np.random.default_rng(0).normal(size=(4, 2, 15, 3))


def test_every_segment_runs_between_the_means_of_its_joints():
    ends = segments(JOINTS_WORLD)
    assert ends.shape == (4, 2, len(SEGMENT_RADIUS_M), 2, 3)
    for k, (first, second, _) in enumerate(SEGMENT_ENDS):
        np.testing.assert_allclose(ends[..., k, 0, :], JOINTS_WORLD[..., first, :].mean(-2))
        np.testing.assert_allclose(ends[..., k, 1, :], JOINTS_WORLD[..., second, :].mean(-2))


def test_hands_go_on_from_the_wrists_along_the_forearms():
    ends = segments(JOINTS_WORLD)
    for h, (elbow, wrist, reach_m, _) in enumerate(HAND_SEGMENTS, start=len(SEGMENT_ENDS)):
        hand = ends[..., h, 1, :] - ends[..., h, 0, :]
        forearm = JOINTS_WORLD[..., wrist, :] - JOINTS_WORLD[..., elbow, :]
        np.testing.assert_allclose(np.linalg.norm(hand, axis=-1), reach_m)
        np.testing.assert_allclose(np.cross(hand, forearm), 0, atol=1e-12)


def test_an_elbow_on_its_wrist_is_a_point_and_not_a_division_by_zero():
    folded = JOINTS_WORLD.copy()
    folded[..., JOINT["left_elbow"], :] = folded[..., JOINT["left_wrist"], :]
    assert np.isfinite(segments(folded)).all()


def test_nobody_has_no_segments():
    assert segments(np.zeros((3, 0, 15, 3))).shape == (3, 0, len(SEGMENT_RADIUS_M), 2, 3)
