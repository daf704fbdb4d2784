"""Gymnasium's wrappers on an environment: they come back from a spec's text and from a pickle."""

import pickle

import cloudpickle
import gymnasium
import pytest
from gymnasium import wrappers
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import data_equivalence

import hrc_env  # noqa: F401  (registers the ids)

CASES = {
    "Autoreset": {},
    "ClipAction": {},
    "ClipReward": {"min_reward": -0.01, "max_reward": 0.01},
    "DelayObservation": {"delay": 2},
    "FilterObservation": {"filter_keys": ["observation", "desired_goal"]},
    "FlattenObservation": {},
    "FrameStackObservation": {"stack_size": 3},
    "NormalizeReward": {},
    "RecordEpisodeStatistics": {},
    "StickyAction": {"repeat_action_probability": 0.4},
    "TimeAwareObservation": {"flatten": False},
}
"""Wrappers of an environment with goals apart from its observation, and their arguments."""


def play(env, actions):
    """What an environment returns for some actions, but for times that its clock took."""
    steps = []
    for action in actions:
        *step, info = env.step(action)
        steps.append((*step, {name: each for name, each in info.items() if name != "episode"}))
    return tuple(steps)


@pytest.mark.parametrize("name", CASES)
def test_a_wrapped_environment_comes_back_from_its_spec_and_from_a_pickle(name):
    plain = gymnasium.make("HRCReachGoal-v0", perception="keypoints", max_episode_steps=5)
    env = getattr(wrappers, name)(plain, **CASES[name])
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(4)]
    first, _ = env.reset(seed=3)
    assert first in env.observation_space
    assert data_equivalence(first, again.reset(seed=3)[0])
    assert data_equivalence(play(env, actions[:2]), play(again, actions[:2]))
    copy = pickle.loads(cloudpickle.dumps(env))
    assert data_equivalence(play(env, actions[2:]), play(copy, actions[2:]))
