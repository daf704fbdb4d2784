"""Terms that are added to the reward of a task that there is."""

import cloudpickle
import gymnasium
import numpy as np
import pytest

import hrc_env
from hrc_env.tasks.check import check_task
from hrc_env.tasks.task import TASKS
from hrc_env.vector.env import HRCVectorEnv


def calm(belief, step, previous, config):
    return -0.5 * np.linalg.norm(belief.robot.tool_velocity_world, axis=1)


CALM = hrc_env.RewardTerm("calm", "Minus half of the tool's speed [m/s].", calm)


@pytest.mark.parametrize("task_id", ["HRCReach-v0", "HRCReachGoal-v0", "HRCDelivery-v0"])
def test_a_task_with_a_term_more_is_else_the_same(task_id):
    more = hrc_env.with_rewards(task_id, CALM, id="Calm-v0")
    check_task(more)
    assert more().observation_terms == hrc_env.find_task(task_id)().observation_terms
    envs = [HRCVectorEnv(2, task=each, perception="keypoints") for each in (task_id, more)]
    for env in envs:
        env.reset(seed=3)
    for _ in range(5):
        action = envs[0].action_space.sample()
        (one, reward, *_, info), (other, with_term, *_, infos) = (env.step(action) for env in envs)
        np.testing.assert_equal(one, other)
        np.testing.assert_allclose(with_term, reward + infos["reward/calm"])
        assert (infos["reward/calm"] < 0).all()
        assert "reward/calm" not in info


def test_a_task_with_a_term_more_goes_to_other_processes():
    more = cloudpickle.loads(
        cloudpickle.dumps(hrc_env.with_rewards("HRCReach-v0", CALM, id="C-v0"))
    )
    env = gymnasium.make("HRCReach-v0", task=more, perception="none")
    env.reset(seed=0)
    assert "reward/calm" in env.step(env.action_space.sample())[4]


@pytest.mark.parametrize(
    ("task", "terms", "said"),
    [
        ("HRCReech-v0", (CALM,), "Did you mean 'HRCReach-v0'"),
        ("HRCReach-v0", (), "at least one RewardTerm"),
        ("HRCReach-v0", (calm,), "must be a RewardTerm, got function"),
        ("HRCReach-v0", (CALM, CALM), "already has a term 'calm'"),
        ("HRCReach-v0", (hrc_env.RewardTerm("goal", "", calm),), "already has a term 'goal'"),
        ("HRCReach-v0", (hrc_env.RewardTerm("effort", "", calm),), "already has a term 'effort'"),
    ],
)
def test_what_cannot_be_added_is_refused_in_words(task, terms, said):
    with pytest.raises(hrc_env.ConfigError, match=said):
        hrc_env.with_rewards(task, *terms, id="Mine-v0")


@pytest.mark.parametrize("task_id", ["HRCReach-v0", "HRCReachGoal-v0"])
def test_agents_of_a_task_act_in_the_one_with_a_term_more(task_id, monkeypatch):
    more = hrc_env.with_rewards(task_id, CALM, id="Calm-v0")
    monkeypatch.setitem(TASKS, "Calm-v0", more)
    actions = []
    for task in (task_id, "Calm-v0"):
        env = hrc_env.HRCEnv(task, perception="truth")
        observation, _ = env.reset(seed=2)
        actions.append(hrc_env.make_agent("scripted", hrc_env.env_info(env)).act(observation))
    np.testing.assert_array_equal(*actions)


def test_agents_do_not_act_in_a_task_that_shows_something_else(monkeypatch):
    base = hrc_env.find_task("HRCReach-v0")
    blind = type("Blind", (base,), {"id": "Blind-v0", "observations": base.observations[:1]})
    monkeypatch.setitem(TASKS, "Blind-v0", blind)
    env = hrc_env.HRCEnv("Blind-v0", perception="truth")
    with pytest.raises(hrc_env.ConfigError, match="no scripted agent for Blind-v0"):
        hrc_env.make_agent("scripted", hrc_env.env_info(env))


def test_a_term_of_other_arguments_is_refused_when_it_is_made():
    with pytest.raises(hrc_env.ConfigError, match=r"of \(belief, step, previous_action"):
        hrc_env.RewardTerm("odd", "", lambda belief: belief.action[:, 0])


def test_an_agent_reads_terms_in_their_units():
    env = hrc_env.HRCEnv(perception="truth")
    observation, _ = env.reset(seed=2)
    told = hrc_env.env_info(env).split(observation)
    for name, term in env.split_observation(observation).items():
        np.testing.assert_array_equal(told[name], term)
