"""The VecEnv beside SB3's own vector of single environments: attributes, methods, options."""

import copy
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import ClipAction, TimeLimit
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize

import hrc_env  # noqa: F401  registers the ids
from hrc_env.core.errors import ConfigError
from hrc_env.rewards import RewardConfig
from hrc_env.sb3 import HRCVecEnv


def actions(n_steps: int, n_envs: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1, 1, (n_steps, n_envs, 6)).astype(np.float32)


def pair(task: str, n_envs: int = 3, **kwargs):
    """The VecEnv, and SB3's own round single environments in its `Monitor`; both seeded with 5."""
    made = {"perception": "truth", "max_episode_steps": 12, **kwargs}
    ours = HRCVecEnv(n_envs, task=task, **made)
    theirs = DummyVecEnv([lambda: Monitor(gymnasium.make(task, **made))] * n_envs)
    for env in (ours, theirs):
        env.seed(5)
    return ours, theirs


def same(a, b) -> bool:
    """Whether observations, of which goals are dicts, are equal."""
    a, b = (each if isinstance(each, dict) else {"": each} for each in (a, b))
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


@pytest.mark.parametrize("task", ["HRCReach-v0", "HRCReachGoal-v0"])
def test_it_is_sb3s_own_vector_value_for_value(task):
    """With options of the first episodes, over their ends, and after one was begun alone."""
    ours, theirs = pair(task)
    for env in (ours, theirs):
        env.set_options([{"steps_left": 3}, {}, {"steps_left": 7}])
    assert same(ours.reset(), theirs.reset())
    ends = 0
    for step, action in enumerate(actions(20, 3)):
        mine, other = ours.step(action), theirs.step(action)
        assert same(mine[0], other[0])
        assert np.array_equal(mine[1:3], other[1:3])
        for b in np.flatnonzero(mine[2]):
            (info, whole), ends = (each[3][b] for each in (mine, other)), ends + 1
            assert info["TimeLimit.truncated"] == whole["TimeLimit.truncated"]
            assert info["episode"]["l"] == whole["episode"]["l"]
            assert info["episode"]["r"] == pytest.approx(whole["episode"]["r"], abs=2e-6)
        if step == 9:
            alone = [env.env_method("reset", seed=9, indices=[1])[0] for env in (ours, theirs)]
            assert same(alone[0][0], alone[1][0])
            assert alone[0][1] == alone[1][1] == ours.reset_infos[1]
    assert ends == 4
    for method in ("get_total_steps", "get_episode_lengths"):
        assert ours.env_method(method) == theirs.env_method(method)
    for mine, other in zip(
        *(e.env_method("get_episode_rewards") for e in (ours, theirs)), strict=True
    ):
        assert mine == pytest.approx(other, abs=2e-6)
    assert all(times == sorted(times) for times in ours.env_method("get_episode_times"))


@pytest.mark.parametrize("task", ["HRCReach-v0", "HRCReachGoal-v0"])
def test_attributes_are_those_of_one_environment(task):
    ours, theirs = pair(task, render_mode="rgb_array", width=64, height=48)
    ours.reset(), theirs.reset()
    for name in (
        "observation_space", "action_space", "np_random_seed", "render_mode", "metadata", "config",
        "closed",
    ):  # fmt: skip
        assert ours.get_attr(name) == theirs.get_attr(name)
        assert ours.get_attr(name, [-1]) == theirs.get_attr(name, 2)
    states = [
        [one.bit_generator.state for one in env.get_attr("np_random")] for env in (ours, theirs)
    ]
    assert states[0] == states[1]
    for name in ("compute_reward", "compute_terminated", "mosaic", "nobody_has_this"):
        assert ours.has_attr(name) == theirs.has_attr(name)
    seen = ours.env_method("split_observation", theirs.envs[0].reset(seed=3)[0], indices=0)[0]
    assert {"joint_angle_sin", "joint_velocity"} <= set(seen)
    pictures = [env.env_method("render", indices=[2]) for env in (ours, theirs)]
    np.testing.assert_array_equal(*pictures)
    ours.close(), theirs.close()


def test_the_spec_of_an_environment_makes_it_alone():
    env = HRCVecEnv(2, perception="truth", max_episode_steps=9, n_workers=2, seed=4)
    first, (_, spec) = env.reset(), env.get_attr("spec")
    assert (spec.id, spec.max_episode_steps, env.spec.id) == ("HRCReach-v0", 9, "HRCReach-v0")
    np.testing.assert_array_equal(gymnasium.make(spec).reset(seed=5)[0], first[1])
    assert HRCVecEnv(1, perception="none", max_episode_steps=-1).spec.max_episode_steps is None


def test_wrappers_whose_work_is_done_are_known():
    env = HRCVecEnv(2, perception="none")
    for wrapper in (Monitor, TimeLimit, gymnasium.Wrapper):
        assert env.env_is_wrapped(wrapper, [1]) == [True]
    assert env.env_is_wrapped(ClipAction) == [False] * 2
    endless = HRCVecEnv(1, perception="none", max_episode_steps=-1)
    assert endless.env_is_wrapped(TimeLimit) == [False]


def test_attributes_of_your_own_are_kept_for_each_environment():
    env = HRCVecEnv(3, perception="none")
    env.set_attr("tag", 5, indices=[0, 2])
    assert env.get_attr("tag", [0, 2]) == [5, 5]
    assert not env.has_attr("tag")
    env.set_attr("np_random", np.random.default_rng(1), indices=1)
    assert env.get_attr("np_random_seed", 1) == [-1]
    other = HRCVecEnv(3, perception="none")
    env.seed(2), other.seed(2)
    np.testing.assert_array_equal(env.reset(), other.reset())
    assert copy.deepcopy(env).get_attr("tag", [0]) == [5]


def test_methods_for_all_environments_together_are_not_for_some():
    env = HRCVecEnv(2, perception="none")
    env.env_method("set_reward", RewardConfig(effort=-5.0))
    assert env.simulation.reward_weights.effort == -5.0
    with pytest.raises(ConfigError, match="to all environments together"):
        env.env_method("close", indices=[0])
    env.env_method("close")
    assert env.get_attr("closed") == [True, True]


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda env: env.set_options({"steps": 1}), r"Did you mean 'steps_left'\?"),
        (lambda env: env.set_options({"steps_left": 0}), "from 1 to"),
        (lambda env: env.set_options({"reset_mask": np.ones(2, bool)}), "of one environment"),
        (lambda env: env.set_options([{}]), "one mapping per environment"),
        (lambda env: env.set_attr("render_mode", "rgb_array"), "settings are fixed at creation"),
        (lambda env: env.set_attr("people", "hurried"), "settings are fixed at creation"),
        (lambda env: env.set_attr("np_random", 3), "must be a numpy.random.Generator"),
        (lambda env: env.env_method("step", np.zeros(6)), "steps with the others"),
        (lambda env: env.env_method("mosiac"), "Did you mean 'mosaic'"),
        (lambda env: env.get_attr("simulation"), "Unknown attribute of a single environment"),
        (lambda env: env.get_attr("spec", [2]), "indices must be a whole number from -2 to 1"),
        (lambda env: env.env_method("reset", options={"elapsed": 1}), "'elapsed_steps'"),
    ],
)
def test_what_one_environment_cannot_do_is_refused_in_words(ask, said):
    env = HRCVecEnv(2, perception="none")
    env.reset()
    with pytest.raises(ConfigError, match=said):
        ask(env)


def test_options_are_for_the_next_reset_only():
    env = HRCVecEnv(2, perception="none", max_episode_steps=9)
    env.set_options([{"elapsed_steps": 7}, None])
    ends = []
    for _ in range(2):
        env.reset()
        ends.append([env.step(action)[2].tolist() for action in actions(2, 2)][1])
    assert ends == [[True, False], [False, False]]


def test_evaluation_under_normalised_rewards_reports_the_tasks_return():
    """And nobody warns that a `Monitor` is missing."""
    model = PPO("MlpPolicy", HRCVecEnv(2, perception="none", n_workers=0), n_steps=8, batch_size=16)
    scores = []
    for wrap in (lambda env: env, lambda env: VecNormalize(env, norm_obs=False, gamma=0.5)):
        env = wrap(HRCVecEnv(2, perception="none", n_workers=0, max_episode_steps=20))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            scores.append(evaluate_policy(model, env, 4, return_episode_rewards=True))
    assert scores[0] == scores[1]


def test_a_monitor_round_it_warns_that_it_replaces_the_statistics(tmp_path):
    env = HRCVecEnv(2, perception="none", n_workers=0, max_episode_steps=4)
    with pytest.warns(UserWarning, match="already wrapped with a `Monitor`"):
        env = VecMonitor(env, str(tmp_path / "log"), info_keywords=("episode_cost", "is_success"))
    env.reset()
    for action in actions(4, 2):
        env.step(action)
    env.close()
    header, names, *rows = (tmp_path / "log.monitor.csv").read_text().splitlines()
    assert '"env_id": "HRCReach-v0"' in header
    assert names == "r,l,t,episode_cost,is_success"
    assert len(rows) == 2


def test_pictures_that_are_not_there_are_none_with_a_warning():
    env = HRCVecEnv(2, perception="none")
    env.reset()
    with pytest.warns(UserWarning, match="rgb_array"):
        assert env.get_images() == [None, None]
    assert env.env_method("render") == [None, None]
    env.close()
    with pytest.raises(ConfigError, match="closed"):
        env.env_method("render")
