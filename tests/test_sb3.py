"""The VecEnv: the same environments, many at once, ended and begun as SB3 expects."""

import gymnasium
import numpy as np
import pytest
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import (
    VecCheckNan,
    VecFrameStack,
    VecNormalize,
)

import hrc_env  # noqa: F401  registers the ids
from hrc_env.core.errors import ConfigError
from hrc_env.sb3 import HRCVecEnv


def actions(n_steps: int, n_envs: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1, 1, (n_steps, n_envs, 6)).astype(np.float32)


def test_each_environment_is_the_single_one_bit_for_bit():
    """Over the end of an episode: the single one, in SB3's Monitor, resets by hand."""
    acts = actions(40, 3)
    many = HRCVecEnv(3, perception="keypoints", stagger=False, max_episode_steps=25, seed=7)
    batch = [many.reset(), *(many.step(action) for action in acts)]
    for k in range(3):
        made = gymnasium.make("HRCReach-v0", perception="keypoints", max_episode_steps=25)
        one = Monitor(made)
        observation, _ = one.reset(seed=7 + k)
        np.testing.assert_array_equal(observation, batch[0][k])
        for step, action in enumerate(acts[:, k], start=1):
            observation, reward, terminated, truncated, info = one.step(action)
            seen, rewarded, done, infos = (each[k] for each in batch[step])
            assert np.float32(reward) == rewarded
            assert (terminated or truncated) == done
            if done:
                compare_ends(info, observation, infos)
                observation, _ = one.reset()
            np.testing.assert_array_equal(observation, seen)


def compare_ends(info, observation, ended):
    """What the VecEnv says of an episode's end against Monitor's info and the last observation."""
    np.testing.assert_array_equal(ended["terminal_observation"], observation)
    assert ended["TimeLimit.truncated"]
    monitored = info.pop("episode")
    assert {name: ended[name] for name in info} == info
    assert {type(ended[name]) for name in info} == {np.float64, np.int64}
    assert ended["episode"]["l"] == monitored["l"]
    assert np.isclose(ended["episode"]["r"], monitored["r"], atol=1e-5)


def test_the_cost_of_every_step_is_in_its_infos_and_in_an_array():
    """Also of the step that ends an episode, whose successor has cost nothing yet."""
    near = {"cost": {"proximity_m": 2.0}}
    env = HRCVecEnv(2, perception="truth", max_episode_steps=3, config=near)
    env.reset()
    assert (env.costs == 0.0).all()
    costs = []
    for action in actions(6, 2):
        infos = env.step(action)[3]
        assert [info["cost"] for info in infos] == env.costs.tolist()
        assert [set(info) == {"cost"} for info in infos] == [len(costs) % 3 < 2] * 2
        costs.append(env.costs)
    assert np.ravel(costs).any()
    assert [info["episode_cost"] for info in infos] == np.sum(costs[3:], axis=0).tolist()


def test_the_infos_of_resets_are_at_hand():
    env = HRCVecEnv(2, perception="truth", stagger=False, max_episode_steps=2, seed=4)
    env.reset()
    first = env.reset_infos
    for action in actions(2, 2):
        env.step(action)
    assert first[0]["tracking/mpjpe_m"] == env.reset_infos[1]["tracking/mpjpe_m"] == 0.0
    assert env.reset_infos[0]["cost"] == env.reset_infos[0]["cost_contact"] == 0.0


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


def test_an_episode_that_fails_at_its_time_limit_has_failed(monkeypatch):
    env = HRCVecEnv(2, perception="none", stagger=False, max_episode_steps=1)
    env.reset()
    step = env.env.step

    def failing(action):
        observation, reward, _, truncated, infos = step(action)
        return observation, reward, np.array([True, False]), truncated, infos

    monkeypatch.setattr(env.env, "step", failing)
    infos = env.step(actions(1, 2)[0])[3]
    assert [info["TimeLimit.truncated"] for info in infos] == [False, True]


def test_staggered_starts_end_the_first_episodes_at_different_times():
    env = HRCVecEnv(8, perception="none", stagger=True, max_episode_steps=50, seed=1)
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


@pytest.mark.filterwarnings("ignore:num_threads=3")
def test_threads_change_nothing():
    runs = []
    for n_threads in (1, 2, 3):
        env = HRCVecEnv(5, perception="keypoints", num_threads=n_threads)
        env.reset()
        runs.append(np.stack([env.step(action)[0] for action in actions(15, 5)]))
    np.testing.assert_array_equal(runs[0], runs[1])
    np.testing.assert_array_equal(runs[0], runs[2])


def test_only_the_reset_after_a_seed_is_staggered_and_the_same_seed_gives_the_same_phases():
    env = HRCVecEnv(6, perception="none", stagger=True, max_episode_steps=30, seed=5)
    ends = []
    for again in (None, None, 5):
        if again is not None:
            env.seed(again)
        env.reset()
        ends.append(np.stack([env.step(action)[2] for action in actions(30, 6)]))
    np.testing.assert_array_equal(ends[0], ends[2])
    assert ends[0][:-1].any()
    assert not ends[1][:-1].any()
    assert ends[1][-1].all()


@pytest.mark.slow  # a learner is trained
def test_sb3s_evaluation_sees_whole_episodes_only():
    """In the callback every time, not the first time only."""
    env = HRCVecEnv(2, perception="none", n_workers=0, seed=3)
    nobody = HRCVecEnv(2, perception="none", n_workers=0)
    learner = PPO("MlpPolicy", nobody, n_steps=8, batch_size=16)
    _, lengths = evaluate_policy(learner, env, 4, return_episode_rewards=True, warn=False)
    assert lengths == [250] * 4
    seen = []
    callback = EvalCallback(env, n_eval_episodes=3, eval_freq=8, verbose=0, warn=False)
    log = callback._log_success_callback
    callback._log_success_callback = lambda said, scope: (
        seen.extend([said["info"]["episode"]["l"]] if said["done"] else []),
        log(said, scope),
    )
    learner.learn(24, callback=callback)
    assert callback.n_calls >= 16
    assert len(seen) >= 6
    assert set(seen) == {250}


def test_sb3_finds_what_it_asks_a_vec_env_for():
    env = HRCVecEnv(3, perception="truth", seed=2)
    assert env.seed(5) == [5, 6, 7]
    assert env.render_mode is None
    assert env.get_attr("max_episode_steps", indices=[0, 2]) == [250, 250]
    assert not env.has_attr("nobody_has_this")
    assert env.env_is_wrapped(Monitor) == [True] * 3
    env.set_options({})


def test_pictures_of_all_environments_are_tiled():
    env = HRCVecEnv(2, perception="none", render_mode="rgb_array")
    env.reset()
    tiles = env.get_images()
    assert len(tiles) == 2
    assert env.render().size == sum(tile.size for tile in tiles)
    env.close()


@pytest.mark.slow  # a learner is trained
def test_sb3s_own_wrappers_and_learners_take_it():
    """On policy and off; VecCheckNan raises at the first NaN."""
    made = HRCVecEnv(4, perception="truth", max_episode_steps=20)
    stacked = VecFrameStack(VecCheckNan(made), 2)
    PPO("MlpPolicy", VecNormalize(stacked), n_steps=32, batch_size=64).learn(256)
    learner = SAC("MlpPolicy", made, learning_starts=20, buffer_size=500)
    learner.learn(120)
    assert learner.replay_buffer.timeouts.any()
    assert len(learner.ep_info_buffer) >= 4
