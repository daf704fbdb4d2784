"""Folded postures are bent, squatting and kneeling ones, wherever and however large the body is."""

import numpy as np
import pytest
from people import STANDING

from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.rotations import about_axis
from hrc_env.perception.calibration import POSTURES
from hrc_env.perception.outline import is_folded, novelty_m, pose_of, posture_of

ONLY = np.eye(len(POSTURES))
UPPER = [JOINT["nose"]] + [
    JOINT[f"{side}_{name}"] for side in ("left", "right") for name in ("shoulder", "elbow", "wrist")
]


def bent(degrees):
    """The upper body turned forward about the hips."""
    body = STANDING.copy()
    hips = body[[JOINT["left_hip"], JOINT["right_hip"]]].mean(0)
    body[UPPER] = (body[UPPER] - hips) @ about_axis("y", np.radians(degrees)).T + hips
    return body


def squatting(drop_m):
    """The whole body but the feet lower, the knees ahead."""
    body = STANDING.copy()
    low = [*UPPER, JOINT["left_hip"], JOINT["right_hip"]]
    body[low] -= [0.1, 0.0, drop_m]
    knees = [JOINT["left_knee"], JOINT["right_knee"]]
    body[knees] += [0.35, 0.0, -0.1]
    return body


@pytest.mark.parametrize("degrees", [0, 15, 25])
def test_who_stands_and_leans_a_little_is_not_folded(degrees):
    assert not is_folded(bent(degrees))


@pytest.mark.parametrize("degrees", [40, 80, 120])
def test_who_bends_is_folded(degrees):
    assert is_folded(bent(degrees))


def test_who_squats_is_folded():
    assert is_folded(squatting(0.45))


def test_who_lifts_one_foot_is_not_folded():
    striding = STANDING.copy()
    striding[[JOINT["left_knee"], JOINT["left_ankle"]]] += [[0.25, 0, 0.1], [-0.1, 0, 0.35]]
    assert not is_folded(striding)


def test_place_turn_and_size_do_not_matter():
    for body in (bent(60), squatting(0.45), STANDING):
        moved = 0.8 * body @ about_axis("z", 2.0).T + [3.0, -1.0, 0.0]
        assert is_folded(moved) == is_folded(body)


def test_an_unknown_body_is_not_folded():
    assert not is_folded(np.full_like(STANDING, np.nan))


@pytest.mark.parametrize(("speed_m_s", "posture"), [(0.0, 0), (1.2, 1)])
def test_who_has_nothing_in_their_hands_stands_or_walks(speed_m_s, posture):
    np.testing.assert_allclose(posture_of(hanging(), moving(speed_m_s)), ONLY[posture])


@pytest.mark.parametrize("speed_m_s", [0.0, 1.2])
def test_a_raised_hand_has_something_to_do(speed_m_s):
    body = hanging()
    body[JOINT["right_wrist"], 2] = body[JOINT["right_shoulder"], 2] - 0.2
    np.testing.assert_allclose(posture_of(body, moving(speed_m_s)), ONLY[2])


def test_who_is_folded_up_is_that_whatever_the_hands_do():
    body = hanging()
    body[UPPER, 2] -= 0.9
    body[JOINT["right_wrist"], 2] += 0.6
    np.testing.assert_allclose(posture_of(body, moving(1.0)), ONLY[3])


@pytest.mark.parametrize("sides", [("left",), ("right",), ("left", "right")])
def test_who_is_folded_with_a_knee_on_the_ground_kneels(sides):
    body = squatting(0.75)
    for side in sides:
        knee, ankle = JOINT[f"{side}_knee"], JOINT[f"{side}_ankle"]
        body[knee, 2] = body[ankle, 2]
    np.testing.assert_allclose(posture_of(body, moving(0.0)), ONLY[4])


def test_who_bends_to_the_floor_with_straight_legs_does_not_kneel():
    np.testing.assert_allclose(posture_of(bent(120), moving(0.0)), ONLY[3])


def test_who_stands_with_a_foot_raised_behind_does_not_kneel():
    body = hanging()
    body[JOINT["left_ankle"], 2] = body[JOINT["left_knee"], 2]
    assert posture_of(body, moving(0.0))[4] < 0.1


def hanging():
    """`STANDING` with its arms down."""
    body = STANDING.copy()
    for side in ("left", "right"):
        body[JOINT[f"{side}_elbow"]] = body[JOINT[f"{side}_shoulder"]] - [0.0, 0.0, 0.3]
        body[JOINT[f"{side}_wrist"]] = body[JOINT[f"{side}_elbow"]] - [0.0, 0.0, 0.25]
    return body


def moving(speed_m_s):
    return np.tile([speed_m_s, 0.0, 0.0], (len(STANDING), 1))


def test_a_pose_is_the_same_wherever_and_however_large_the_body_is():
    turn = about_axis("z", 2.0)
    np.testing.assert_allclose(
        pose_of(1.2 * STANDING @ turn.T + [3.0, -2.0, 0.4]), pose_of(STANDING), atol=1e-9
    )


def test_novelty_is_the_distance_to_the_nearest_pose():
    poses = np.stack([pose_of(squatting(0.45)), pose_of(STANDING)], -1)
    assert novelty_m(STANDING, poses) == pytest.approx(0.0, abs=1e-9)
    moved = STANDING.copy()
    moved[JOINT["left_wrist"]] += [0.0, 0.0, 0.3]
    assert novelty_m(moved, poses) == pytest.approx(0.3 / np.sqrt(len(STANDING)))
    assert novelty_m(1.2 * moved, poses) == pytest.approx(1.2 * novelty_m(moved, poses))
