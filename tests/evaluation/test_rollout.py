"""The one loop in which agents act, alone and side by side."""

import gymnasium
import numpy as np
import pytest

import hrc_env  # noqa: F401
from hrc_env.evaluation.rollout import rollout
from hrc_env.vector.env import HRCVectorEnv

STEPS = 12


class Still:
    """Does not move, and keeps the observations that it was given."""

    def __init__(self, *shape: int) -> None:
        self.shape, self.seen = shape, []

    def act(self, observation):
        self.seen.append(observation)
        return np.zeros(self.shape, np.float32)


@pytest.fixture
def alone():
    with gymnasium.make("HRCReach-v0", perception="truth", max_episode_steps=STEPS) as env:
        yield env


def test_an_episode_is_played_to_its_end_from_the_observation_of_its_reset(alone):
    agent, first = Still(*alone.action_space.shape), alone.reset(seed=3)[0]
    steps = list(rollout(alone, agent, first))
    assert [bool(step.ends) for step in steps] == [False] * (STEPS - 1) + [True]
    assert steps[-1].truncated
    shown = [first, *(step.observation for step in steps[:-1])]
    np.testing.assert_array_equal(agent.seen, shown)


def test_a_number_of_steps_ends_it_sooner(alone):
    agent = Still(*alone.action_space.shape)
    assert len(list(rollout(alone, agent, alone.reset(seed=3)[0], 5))) == 5
    assert list(rollout(alone, agent, alone.reset(seed=3)[0], 0)) == []


def test_side_by_side_the_first_episode_of_each_counts(alone):
    """One of them is a few steps ahead: its next episode is not played for the others' sake."""
    many = HRCVectorEnv(3, perception="truth", max_episode_steps=STEPS, num_threads=1)
    ahead = {"elapsed_steps": np.array([0, 5, 0])}
    begun = many.reset(seed=3, options=ahead)[0]
    steps = list(rollout(many, Still(*many.action_space.shape), begun))
    playing = np.array([step.is_playing for step in steps])
    assert playing.sum(0).tolist() == [STEPS, STEPS - 5, STEPS]
    assert np.array([step.ends for step in steps]).sum(0).tolist() == [1, 1, 1]
    single = rollout(alone, Still(*alone.action_space.shape), alone.reset(seed=3)[0])
    np.testing.assert_array_equal(
        [step.reward[0] for step in steps], [one.reward for one in single]
    )
    many.close()
