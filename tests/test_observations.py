"""What the robot sees of the future, if it is asked for."""

import numpy as np
import pytest
from alone import check_observations_alone

import hrc_env  # noqa: F401  registers the ids
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.env import HRCEnv
from hrc_env.observations import Sizes, make_layout
from hrc_env.tasks.reach import Reach

TERMS = Reach().observation_terms

ASKED = {"forecast_s": (0.2, 0.6)}
ADDED = ("worker_joints_forecast", "worker_joints_forecast_std")


def rolled(env, n_steps=15):
    observation, _ = env.reset(seed=4)
    seen, rng = [observation], np.random.default_rng(1)
    for _ in range(n_steps):
        seen.append(env.step(rng.uniform(-1, 1, 6).astype(np.float32))[0])
    return seen


def test_horizons_add_their_terms_and_no_others():
    plain, more = make_layout(TERMS, Sizes(6, 6, 2)), make_layout(TERMS, Sizes(6, 6, 2, horizons=2))
    assert len(more.low) - len(plain.low) == 2 * 2 * N_JOINTS * (3 + 1)
    for name, part in plain.slices.items():
        assert part.start == part.stop or more.slices[name] == part
    assert more.slices[ADDED[1]].stop == len(more.low)


def test_who_gives_no_more_sizes_asks_for_no_more_terms():
    plain, made = make_layout(TERMS, Sizes(6, 6, 1)), HRCEnv(perception="none").simulation.layout
    assert (plain.slices, plain.terms) == (made.slices, made.terms)
    np.testing.assert_array_equal(plain.low, made.low)


@pytest.mark.parametrize("level", ["keypoints", "truth", "none"])
def test_asking_changes_nothing_else(level):
    plain, more = HRCEnv(perception=level), HRCEnv(perception=level, config=ASKED)
    for before, after in zip(rolled(plain), rolled(more), strict=True):
        np.testing.assert_array_equal(after[: len(before)], before)


@pytest.mark.parametrize("level", ["keypoints", "truth"])
def test_a_worker_is_expected_near_and_less_surely_the_later(level):
    env = HRCEnv(perception=level, config=ASKED)
    terms = env.split_observation(rolled(env)[-1])
    now = terms["worker_joints_from_tool"].reshape(1, N_JOINTS, 3)
    later = terms["worker_joints_forecast"].reshape(2, N_JOINTS, 3)
    std = terms["worker_joints_forecast_std"].reshape(2, N_JOINTS)
    moved = np.linalg.norm(later - now, axis=-1).mean(1)
    assert (moved < (0.5, 1.2)).all()
    assert terms["worker_joints_std"].mean() < std[0].mean() < std[1].mean()
    expected = env.simulation.belief.forecast[1].mean_world[0, 0]
    tool = env.simulation.belief.robot.tool_world
    np.testing.assert_allclose(later[1], expected - tool, atol=1e-5)


def test_of_nobody_the_prior_is_expected():
    env = HRCEnv(perception="none", config=ASKED)
    terms = env.split_observation(rolled(env, 3)[-1])
    now = terms["worker_joints_from_tool"].reshape(1, N_JOINTS, 3)
    np.testing.assert_allclose(terms["worker_joints_forecast"].reshape(2, N_JOINTS, 3) - now, 0.0)


def test_many_environments_expect_what_each_alone_expects():
    check_observations_alone(config=ASKED)


def test_two_workers_have_their_own_futures():
    env = HRCEnv(perception="truth", n_workers=2, config=ASKED)
    later = env.split_observation(rolled(env, 3)[-1])["worker_joints_forecast"]
    first, second = later.reshape(2, 2, N_JOINTS, 3)
    assert np.linalg.norm(first.mean(1) - second.mean(1), axis=-1).min() > 0.3
