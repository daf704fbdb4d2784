"""What the network means by a joint becomes the joint, whichever way the worker faces."""

from dataclasses import replace

import numpy as np
import pytest
from people import truth

from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import JOINT, N_JOINTS
from hrc_env.perception.calibration import HAND, KIND, KINDS, POSTURES, read_calibration
from hrc_env.perception.noise import FARTHEST_M, our_joints
from hrc_env.perception.outline import novelty_m, pose_of

KNOWN = read_calibration()
OFFSET_M = KNOWN.offset_m


def turned(joints, yaw_rad):
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    return joints @ np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]).T


def estimate_of(joints, speed_m_s=0.0):
    shape = joints.shape[:-1]
    velocity = np.zeros_like(joints)
    velocity[..., 0] = speed_m_s
    cov = np.broadcast_to(1e-4 * np.eye(3), (*shape, 3, 3)).copy()
    return PoseEstimate(joints, cov, velocity, np.zeros(shape), np.ones(shape[:-1], bool))


def meant(joints, yaw_rad, posture):
    """Where the network means joints (J, 3) of a body that faces +x, turned by yaw, to be."""
    ahead, side, up = OFFSET_M[posture, KIND].T
    return turned(joints + np.stack([ahead, HAND * side, up], -1), yaw_rad)


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, -2.5])
@pytest.mark.parametrize(("posture", "speed_m_s"), [(0, 0.0), (1, 1.2)])
def test_who_is_upright_is_put_right(yaw_rad, posture, speed_m_s):
    body = facing_x()
    said = meant(body, yaw_rad, posture)[None, None]
    told = our_joints(estimate_of(said, speed_m_s)).mean_world[0, 0]
    np.testing.assert_allclose(told, turned(body, yaw_rad), atol=0.002)
    assert np.abs(said[0, 0] - turned(body, yaw_rad)).max() > 0.01


@pytest.mark.parametrize("posture", ["folded", "kneeling"])
def test_who_is_folded_up_is_moved_by_what_was_found_of_such_bodies(posture):
    body = facing_x()
    upper = [j for j in range(N_JOINTS) if j < JOINT["left_knee"]]
    body[upper, 2] -= 1.4  # shoulders are no higher than the ankles any more
    if posture == "kneeling":
        body[JOINT["left_knee"], 2] = body[JOINT["left_ankle"], 2]
    told = our_joints(estimate_of(body[None, None])).mean_world[0, 0]
    moved = (body - told)[JOINT["left_hip"]]
    np.testing.assert_allclose(
        moved[[0, 2]],
        OFFSET_M[POSTURES.index(posture), KIND[JOINT["left_hip"]], [0, 2]],
        atol=1e-3,
    )


def test_nothing_else_changes():
    said = estimate_of(np.tile(facing_x(), (2, 1, 1, 1)))
    said.tracked[1] = False
    before = said.mean_world.copy()
    told = our_joints(said)
    np.testing.assert_array_equal(told.mean_world[1], before[1])
    np.testing.assert_array_equal(said.mean_world, before)
    np.testing.assert_array_equal(told.cov_world[1], said.cov_world[1])
    np.testing.assert_array_equal(told.velocity_world, said.velocity_world)


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, -2.5])
def test_what_is_not_known_of_the_offset_is_in_the_covariance(yaw_rad):
    said = estimate_of(turned(facing_x(), yaw_rad)[None, None])
    grown = (our_joints(said, without(KNOWN)).cov_world - said.cov_world)[0, 0]
    axes = turned(np.eye(3), yaw_rad)  # ahead, left, up
    unknown_m2 = (KNOWN.wander_m[0] ** 2 + KNOWN.between_m**2)[KIND]
    expected = np.einsum("ak,ja,al->jkl", axes, unknown_m2, axes)
    np.testing.assert_allclose(grown, expected, atol=1e-7)
    assert np.linalg.eigvalsh(grown).min() > 0


def test_of_a_pose_that_is_new_less_is_known_the_further_it_is_from_others():
    novel = np.linspace(2.0, 6.0, len(KINDS))
    known = replace(KNOWN, near_m=np.array(0.02), novel=novel)
    body, grown = facing_x(), []
    body = body[None] + 0.5 * np.random.default_rng(3).standard_normal((*body.shape,))
    for poses in (pose_of(body[0]), pose_of(facing_x())):
        here = replace(known, poses=np.ascontiguousarray(poses[..., None]))
        cov = [
            our_joints(estimate_of(body[None]), each).cov_world for each in (here, without(here))
        ]
        grown.append((cov[0] - cov[1])[0, 0])
    np.testing.assert_allclose(grown[0], 0.0, atol=1e-9)
    away_m = novelty_m(body[0], pose_of(facing_x())[..., None]) - 0.02
    expected = (novel[KIND] * min(away_m, FARTHEST_M) ** 2) ** 2
    np.testing.assert_allclose(grown[1], expected[:, None, None] * np.eye(3), atol=1e-9)


def without(known):
    """The calibration that says nothing of new poses."""
    return replace(known, novel=np.zeros(len(KINDS)))


def facing_x():
    """A body at rest (J, 3) that faces +x."""
    joints = truth(1).joints_world[0, 0]
    left = joints[JOINT["left_shoulder"]] - joints[JOINT["right_shoulder"]]
    return turned(joints, np.pi / 2 - np.arctan2(left[1], left[0]))
