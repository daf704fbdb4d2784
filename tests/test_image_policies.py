"""Policies of Stable-Baselines3 and camera images: who sees them, who does not, who cannot."""

from contextlib import closing

import numpy as np
import pytest
from stable_baselines3 import PPO

from hrc_env.agents.checkpoints import TrainedAgent
from hrc_env.agents.export import extract_network
from hrc_env.agents.features import NearAndFar
from hrc_env.agents.network import flatten
from hrc_env.core.errors import CheckpointError, ConfigError
from hrc_env.sb3 import HRCVecEnv

ONE, TWO = ({"height": 36, "width": 36, "cameras": list(range(n))} for n in (1, 2))


def make(images=None) -> HRCVecEnv:
    return HRCVecEnv(2, perception="none", n_workers=0, observe_images=images)


def learner(env: HRCVecEnv) -> PPO:
    kind = "MlpPolicy" if env.observation_space.shape else "MultiInputPolicy"
    return PPO(kind, env, n_steps=8, batch_size=16, device="cpu", seed=0)


def test_the_vector_environment_gives_images_of_every_environment():
    with closing(make(TWO)) as env:
        observation = env.reset()
        assert observation["image_camera_2"].shape == (2, 36, 36, 3)
        env.step_async(np.zeros((2, 6), np.float32))
        assert env.observation_space.contains({k: v[1] for k, v in env.step_wait()[0].items()})


@pytest.mark.parametrize("trained_on", [None, ONE])
def test_a_policy_acts_where_there_are_more_images_than_it_has_learnt_from(trained_on):
    with closing(make(trained_on)) as own, closing(make(TWO)) as more:
        agent = TrainedAgent(learner(own))
        np.testing.assert_array_equal(agent.act(own.reset()), agent.act(more.reset()))


def test_a_policy_that_sees_images_is_not_exported():
    with closing(make(ONE)) as env, pytest.raises(CheckpointError, match="no convolutions"):
        extract_network(learner(env))


def test_features_at_two_scales_are_of_numbers():
    with closing(make(ONE)) as env, pytest.raises(ConfigError, match=r"'image_camera_1'.*PPO"):
        NearAndFar(env.observation_space)


def test_a_network_of_numbers_leaves_images_out():
    with closing(make(ONE)) as env:
        observation = env.reset()
        np.testing.assert_array_equal(flatten(observation), observation["observation"])
