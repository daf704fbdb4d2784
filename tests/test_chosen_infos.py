"""Infos that are chosen for every step of the `VecEnv` of Stable-Baselines3."""

import numpy as np
import pytest

import hrc_env
from hrc_env.env import HRCEnv
from hrc_env.sb3 import HRCVecEnv


def test_every_step_has_what_the_single_environment_says():
    chosen = ("safety/*", "worker_0/activity", "reward/proximity")
    many, one = HRCVecEnv(2, perception="keypoints", infos=chosen), HRCEnv(perception="keypoints")
    many.seed(4)
    many.reset()
    one.reset(seed=5)
    for _ in range(20):
        action = np.stack([many.action_space.sample()] * 2)
        info, alone = many.step(action)[3][1], one.step(action[1])[4]
        named = {name for name in alone if name.startswith("safety/")} | {*chosen[1:], "cost"}
        assert set(info) == named
        assert info == {name: alone[name] for name in info}


def test_choosing_infos_changes_nothing_else():
    envs = [HRCVecEnv(2, perception="keypoints", infos=each) for each in ((), "*")]
    seen = [env.reset() for env in envs]
    np.testing.assert_array_equal(*seen)
    for _ in range(5):
        action = np.zeros((2, 6), np.float32)
        (one, reward, *_), (other, rewards, *_) = (env.step(action) for env in envs)
        np.testing.assert_array_equal(one, other)
        np.testing.assert_array_equal(reward, rewards)


def test_names_of_an_own_task_can_be_chosen():
    term = hrc_env.RewardTerm("one", "One.", lambda belief, *_: np.ones(len(belief.action)))
    task = hrc_env.with_rewards("HRCReach-v0", term, id="One-v0")
    env = HRCVecEnv(1, task=task, perception="none", infos="reward/one")
    env.reset()
    assert env.step(np.zeros((1, 6), np.float32))[3] == [{"cost": 0.0, "reward/one": 1.0}]


@pytest.mark.parametrize(
    ("infos", "said"),
    [
        ("safty/*", r"Unknown info 'safty/\*'. Did you mean 'safety/\*'"),
        (("cost", "tracking/mpjpe"), "Did you mean 'tracking/mpjpe_m'"),
        (("shield/*",), "Unknown info"),
        (3, "infos must be names or patterns"),
        ((3,), "infos must be names or patterns"),
        (("safety/min_separation",), "Did you mean 'safety/min_separation_m'"),
    ],
)
def test_infos_that_there_are_not_are_refused_when_it_is_made(infos, said):
    with pytest.raises(hrc_env.ConfigError, match=said):
        HRCVecEnv(2, perception="none", infos=infos)


@pytest.mark.parametrize("keyword", ["stager", "num_env", "perceptoin", "max_episode_step", "info"])
def test_a_wrong_keyword_is_answered_with_the_nearest(keyword):
    with pytest.raises(hrc_env.ConfigError, match=f"'{keyword}'. Did you mean '"):
        HRCVecEnv(2, **{keyword: 1})
