"""The VecEnv: the same environments, many at once, ended and begun as SB3 expects."""

import gymnasium
import numpy as np
import pytest

import hrc_env  # noqa: F401  registers the ids
from hrc_env.errors import ConfigError
from hrc_env.sb3 import HRCVecEnv


def actions(n_steps: int, n_envs: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1, 1, (n_steps, n_envs, 6)).astype(np.float32)


def test_each_environment_is_the_single_one_bit_for_bit():
    """Over the end of an episode: the single one resets by hand."""
    acts = actions(40, 3)
    many = HRCVecEnv(3, perception="keypoints", stagger=False, max_episode_steps=25, seed=7)
    batch = [many.reset()]
    for action in acts:
        observation, reward, done, _ = many.step(action)
        batch.append((observation, reward, done))
    for k in range(3):
        one = gymnasium.make("HRCReach-v0", perception="keypoints", max_episode_steps=25)
        observation, _ = one.reset(seed=7 + k)
        np.testing.assert_array_equal(observation, batch[0][k])
        for step, action in enumerate(acts[:, k], start=1):
            observation, reward, terminated, truncated, _ = one.step(action)
            if terminated or truncated:
                observation, _ = one.reset()
            np.testing.assert_array_equal(observation, batch[step][0][k])
            assert np.float32(reward) == batch[step][1][k]
            assert (terminated or truncated) == batch[step][2][k]


def test_a_second_reset_goes_on_and_a_seed_begins_again():
    env = HRCVecEnv(2, perception="truth", seed=3)
    first, second = env.reset(), env.reset()
    assert not np.array_equal(first, second)
    env.seed(3)
    np.testing.assert_array_equal(env.reset(), first)


def test_bad_actions_are_refused_in_words():
    env = HRCVecEnv(2, perception="truth")
    env.reset()
    for bad, said in ((np.zeros((2, 5)), r"shape \(2, 6\)"), (np.full((2, 6), np.nan), "finite")):
        with pytest.raises(ConfigError, match=said):
            env.step(bad)


def test_a_time_limit_is_told_from_a_failure():
    env = HRCVecEnv(2, perception="truth", stagger=False, max_episode_steps=5)
    env.reset()
    for action in actions(5, 2):
        observation, _, done, infos = env.step(action)
    assert done.all()
    for b, info in enumerate(infos):
        assert info["TimeLimit.truncated"]
        assert info["terminal_observation"].shape == observation[b].shape
        assert not np.array_equal(info["terminal_observation"], observation[b])
        assert info["episode"]["l"] == 5


def test_staggered_starts_end_the_first_episodes_at_different_times():
    env = HRCVecEnv(8, perception="none", max_episode_steps=50, seed=1)
    env.reset()
    ends = [[] for _ in range(8)]
    for step, action in enumerate(actions(100, 8)):
        for b in np.flatnonzero(env.step(action)[2]):
            ends[b].append(step)
    assert len({each[0] for each in ends}) > 4
    assert all(second - first == 50 for first, second, *_ in ends)


def test_episode_statistics_add_up():
    env = HRCVecEnv(1, perception="truth", stagger=False, max_episode_steps=60, seed=3)
    env.reset()
    rewards = []
    for action in actions(60, 1):
        _, reward, _, infos = env.step(action)
        rewards.append(reward[0])
    episode = infos[0]["episode"]
    assert np.isclose(episode["r"], np.sum(rewards), atol=1e-4)
    assert episode["cost"] == infos[0]["episode_cost"]


def test_threads_change_nothing():
    runs = []
    for n_threads in (1, 2, 3):
        env = HRCVecEnv(5, perception="keypoints", n_threads=n_threads)
        env.reset()
        runs.append(np.stack([env.step(action)[0] for action in actions(15, 5)]))
    np.testing.assert_array_equal(runs[0], runs[1])
    np.testing.assert_array_equal(runs[0], runs[2])
