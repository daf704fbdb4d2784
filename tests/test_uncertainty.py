"""What the observation says of a joint's covariance beside its root mean, if it is asked for."""

import numpy as np
import pytest
from alone import check_observations_alone

import hrc_env  # noqa: F401  registers the ids
from assets.rotations import matrix_from_quaternion
from hrc_env.belief import covariance_factor_m, deviation_towards_robot_m, standard_deviation_m
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import PoseEstimate, RobotState
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.env import HRCEnv
from hrc_env.observations import UNCERTAINTY
from hrc_env.scene.rigs import RIGS

ASKED = {"uncertainty": UNCERTAINTY}
STD, TOWARDS, FACTOR = (
    "worker_joints_std",
    "worker_joints_std_towards_robot",
    "worker_joints_factor",
)
UNTURNED = np.eye(3)
TURN = matrix_from_quaternion(np.array([0.5, 0.1, -0.7, 0.5]))


def rolled(env, n_steps=10):
    seen, rng = [env.reset(seed=4)[0]], np.random.default_rng(1)
    for _ in range(n_steps):
        seen.append(env.step(rng.uniform(-1, 1, 6).astype(np.float32))[0])
    return seen


def robot(turn=UNTURNED) -> RobotState:
    """Two upright links of 1 m: at the origin, and a thicker one at (1, 1.05)."""
    links = np.zeros((1, 2, 2, 3))
    links[..., 1, 2], links[0, 1, :, :2] = 1.0, (1.0, 1.05)
    still = np.zeros((1, 6)), np.zeros((1, 6)), np.zeros((1, 3)), np.zeros((1, 3))
    return RobotState(*still, np.eye(3)[None], links @ turn.T, np.array([0.05, 0.2]))


def estimate(place, cov, turn=UNTURNED) -> PoseEstimate:
    """A body whose joints are all in one place, as surely."""
    shape = (1, 1, N_JOINTS)
    return PoseEstimate(
        np.tile(turn @ place, (*shape, 1)), np.tile(turn @ cov @ turn.T, (*shape, 1, 1)),
        np.zeros((*shape, 3)), np.zeros(shape), np.ones((1, 1), bool),
    )  # fmt: skip


DEVIATIONS_M = 0.3, 0.02, 0.05
CASES = {
    "along x": ((-0.7, 0.0, 0.5), 0.3),
    "along y, as the other link's surface is nearer": ((1.0, 0.0, 0.5), 0.02),
    "above the link": ((0.0, 0.0, 1.4), 0.05),
    "aslant": ((0.3, 0.4, 0.5), np.hypot(0.6 * 0.3, 0.8 * 0.02)),
}


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["as it stands", "all turned"])
@pytest.mark.parametrize(("place", "expected_m"), CASES.values(), ids=CASES)
def test_the_deviation_is_that_along_the_line_to_the_robot(place, expected_m, turn):
    """Of a covariance with known axes; turned together, robot and worker have the same one."""
    said = estimate(np.array(place), np.diag(np.square(DEVIATIONS_M)), turn)
    found = deviation_towards_robot_m(robot(turn), said)
    np.testing.assert_allclose(found, np.full((1, 1, N_JOINTS), expected_m), rtol=1e-9)


def test_inside_a_link_there_is_no_direction_and_the_mean_is_given():
    said = estimate(np.array([0.0, 0.0, 0.5]), np.diag(np.square(DEVIATIONS_M)))
    found = deviation_towards_robot_m(robot(), said)
    np.testing.assert_array_equal(found, standard_deviation_m(said))


def test_the_factor_holds_the_whole_covariance():
    said = estimate(np.zeros(3), np.diag(np.square(DEVIATIONS_M)), TURN)
    factor = np.zeros((1, 1, N_JOINTS, 3, 3))
    factor[..., *np.tril_indices(3)] = covariance_factor_m(said)
    np.testing.assert_allclose(factor @ np.swapaxes(factor, -1, -2), said.cov_world, atol=1e-15)
    straight = covariance_factor_m(estimate(np.zeros(3), np.diag(np.square(DEVIATIONS_M))))
    np.testing.assert_allclose(straight[0, 0, 0], [0.3, 0, 0.02, 0, 0, 0.05])


def test_what_one_camera_does_not_know_lies_along_its_ray():
    """After the other cameras are gone; the root mean says nothing about the direction."""
    lost = [{"kind": "lost", "cameras": ["camera_2", "camera_3", "camera_4"], "start_s": 0.2}]
    env = HRCEnv(perception="keypoints", faults=lost, config=ASKED)
    terms = env.split_observation(rolled(env, 40)[-1])
    factor = np.zeros((N_JOINTS, 3, 3))
    factor[:, *np.tril_indices(3)] = terms[FACTOR].reshape(N_JOINTS, 6)
    ray = env.simulation.estimate.mean_world[0, 0] - np.array(RIGS["lab"][0].eye_world)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    along = np.linalg.norm(np.einsum("ji,jik->jk", ray, factor), axis=-1)
    across = np.sqrt((3 * terms[STD] ** 2 - along**2) / 2)
    assert np.median(along / across) > 2


@pytest.mark.parametrize("level", ["keypoints", "truth", "none", "pixels"])
def test_asking_adds_its_entries_at_the_end_and_changes_no_others(level, request):
    if level == "pixels":
        request.getfixturevalue("pixels")
    n_steps = 2 if level == "pixels" else 10
    plain, more = HRCEnv(perception=level), HRCEnv(perception=level, config=ASKED)
    for before, after in zip(rolled(plain, n_steps), rolled(more, n_steps), strict=True):
        np.testing.assert_array_equal(after[: len(before)], before)
        assert len(after) == len(before) + 7 * N_JOINTS
        assert more.observation_space.contains(after)
    terms = more.split_observation(after)
    least, most = (1e-3, 1e-3) if level == "truth" else (1e-4, 1.0)
    assert (terms[TOWARDS] > 0.999 * least).all()
    assert (terms[TOWARDS] < 1.001 * most).all()
    whole = np.sqrt((terms[FACTOR].reshape(N_JOINTS, 6) ** 2).sum(-1) / 3)
    np.testing.assert_allclose(whole, terms[STD], rtol=1e-5)


def test_each_can_be_asked_for_alone_and_others_are_refused():
    env = HRCEnv(perception="none", n_workers=2, config={"uncertainty": ("towards_robot",)})
    terms = env.split_observation(env.reset(seed=0)[0])
    assert (len(terms[TOWARDS]), len(terms[FACTOR])) == (2 * N_JOINTS, 0)
    with pytest.raises(ConfigError, match=r"uncertainty 'axes'.*towards_robot"):
        HRCEnv(perception="none", config={"uncertainty": ("axes",)})


def test_many_environments_say_what_each_alone_says():
    check_observations_alone(config=ASKED, n_workers=2)
