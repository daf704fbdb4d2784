"""Bad input to the vector environment is answered with what would work."""

import gymnasium
import numpy as np
import pytest

import hrc_env  # noqa: F401  registers the ids
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.vector import make, options
from hrc_env.vector.env import HRCVectorEnv


@pytest.mark.parametrize(
    ("kwargs", "said"),
    [
        ({"num_envs": 0}, "num_envs must be a whole number from 1"),
        ({"num_envs": -3}, "num_envs must be a whole number from 1"),
        ({"num_envs": 10**9}, "num_envs must be a whole number from 1"),
        ({"num_envs": 2.5}, "num_envs must be a whole number"),
        ({"num_envs": True}, "num_envs must be a whole number"),
        ({"num_threads": 0}, "num_threads must be a whole number from 1"),
        ({"num_threads": "2"}, "num_threads must be a whole number from 1"),
        ({"max_episode_steps": 0}, "max_episode_steps must be a whole number from 1"),
        ({"autoreset_mode": "NextStepp"}, "Did you mean 'NextStep'"),
        ({"render_mode": "human"}, "'rgb_array'"),
        ({"perception": "pixels"}, 'perception="keypoints"'),
        ({"perception": "keypoint"}, "Did you mean 'keypoints'"),
        ({"config": {"rewards": {}}}, "Did you mean 'reward'"),
    ],
)
def test_bad_arguments(kwargs, said):
    with pytest.raises(ConfigError, match=said):
        HRCVectorEnv(**{"num_envs": 2, "perception": "none", **kwargs})


def test_more_threads_than_cores_or_environments_warn_and_work(monkeypatch):
    monkeypatch.setattr(options, "n_cores", lambda: 2)
    with pytest.warns(UserWarning, match="num_threads=5 on 2 cores"):
        env = HRCVectorEnv(3, perception="none", num_threads=5)
    assert len(env.shards.parts) == 3
    env.reset(seed=0)
    env.step(np.zeros((3, 6)))
    assert len(HRCVectorEnv(3, perception="none").shards.parts) == 2


@pytest.fixture(scope="module")
def env() -> HRCVectorEnv:
    env = HRCVectorEnv(2, perception="none", num_threads=2)
    env.reset(seed=0)
    return env


@pytest.mark.parametrize(
    ("actions", "said"),
    [
        (np.zeros(6), r"shape \(2, 6\)"),
        (np.zeros((3, 6)), r"shape \(2, 6\)"),
        (np.full((2, 6), np.nan), "finite"),
        ([["a"] * 6] * 2, "must be numbers"),
        (None, "shape"),
    ],
)
def test_bad_actions(env, actions, said):
    with pytest.raises(ConfigError, match=said):
        env.step(actions)


@pytest.mark.parametrize(
    ("seed", "said"),
    [
        ([1], "list of 2"),
        (-1, ">= 0"),
        ([0, -1], ">= 0"),
        ("ab", "whole number"),
        (1.5, "whole number"),
    ],
)
def test_bad_seeds(env, seed, said):
    with pytest.raises(ConfigError, match=said):
        env.reset(seed=seed)


@pytest.mark.parametrize(
    ("mask", "said"),
    [
        (np.ones(3, bool), r"shape \(2,\)"),
        (np.ones(2), "array of bool"),
        ([True, False], "array of bool"),
        (np.zeros(2, bool), "True for at least one"),
    ],
)
def test_bad_reset_masks(env, mask, said):
    with pytest.raises(ConfigError, match=said):
        env.reset(options={"reset_mask": mask})


def test_unknown_options_are_named_with_the_known_one(env):
    with pytest.raises(ConfigError, match="Did you mean 'reset_mask'"):
        env.reset(options={"reset_masks": np.ones(2, bool)})


def test_the_order_of_calls():
    env = HRCVectorEnv(2, perception="none", max_episode_steps=1, autoreset_mode="Disabled")
    with pytest.raises(ConfigError, match="reset"):
        env.step(np.zeros((2, 6)))
    with pytest.raises(ConfigError, match="first reset"):
        env.reset(options={"reset_mask": np.array([True, False])})
    env.reset(seed=0)
    env.step(np.zeros((2, 6)))
    with pytest.raises(ConfigError, match=r"environments \[0, 1\] have ended.*reset_mask"):
        env.step(np.zeros((2, 6)))
    env.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(ConfigError, match=r"environments \[1\] have ended"):
        env.step(np.zeros((2, 6)))
    env.close()
    for call in (env.reset, env.render, lambda: env.step(np.zeros((2, 6)))):
        with pytest.raises(ConfigError, match="closed"):
            call()


def test_too_many_processes_name_the_fast_level(monkeypatch):
    monkeypatch.setattr(make, "n_cores", lambda: 2)
    with pytest.raises(ConfigError, match=r'perception="keypoints".*force=True'):
        gymnasium.make_vec("HRCReach-v0", num_envs=5)
    with pytest.raises(ConfigError, match="num_threads"):
        gymnasium.make_vec("HRCReach-v0", num_envs=2, num_threads=2)


def test_force_is_taken_at_its_word(monkeypatch):
    made = []
    monkeypatch.setattr(make, "n_cores", lambda: 2)
    monkeypatch.setattr(make, "PixelVectorEnv", lambda makers, **kwargs: made.extend(makers))
    make.make_vector(5, perception="pixels", force=True)
    assert len(made) == 5


def test_a_failure_in_a_thread_is_raised_when_nobody_works_any_more(monkeypatch):
    env = HRCVectorEnv(2, perception="none", num_threads=2)
    env.reset(seed=0)
    finished = []
    first, second = env.shards.parts
    monkeypatch.setattr(first, "step", lambda action: 1 / 0)
    monkeypatch.setattr(second, "step", lambda action: finished.append(True))
    with pytest.raises(ZeroDivisionError):
        env.step(np.zeros((2, 6)))
    assert finished == [True]


def test_a_failure_says_how_its_environments_are_counted(monkeypatch):
    def breaks_down(action):
        raise HRCError("The physics of environment 0 broke down.")

    env = HRCVectorEnv(4, perception="none", num_threads=2)
    env.reset(seed=0)
    monkeypatch.setattr(env.shards.parts[1], "step", breaks_down)
    with pytest.raises(HRCError, match="environment 0") as failure:
        env.step(np.zeros((4, 6)))
    assert failure.value.__notes__ == [
        "Here, environments are counted from number 2 of the vector."
    ]
