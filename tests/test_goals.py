"""Goals that stand apart from the observation: rewards for any pair of them, HER, experts."""

import pickle
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

import hrc_env  # noqa: F401  registers the ids
from hrc_env.agents.registry import make_agent
from hrc_env.core.errors import ConfigError, NoGoalError
from hrc_env.env import HRCEnv
from hrc_env.evaluation.episodes import evaluate
from hrc_env.sb3 import HRCVecEnv
from hrc_env.tasks.reach_goal import ReachGoalConfig
from hrc_env.tasks.task import find_task
from hrc_env.vector.env import HRCVectorEnv
from tests.tasks.variants import vary
from tests.vector import identity

REACH, PICK = IDS = ("HRCReachGoal-v0", "HRCPickPlaceGoal-v0")
SIZES = {REACH: 3, PICK: 9}
OTHERS = ("effort", "smoothness", "proximity")


def goals(observation):
    return observation["achieved_goal"], observation["desired_goal"]


def episode(env, n_steps: int, seed: int = 0):
    """Observations, rewards and infos of random actions."""
    rng = np.random.default_rng(seed)
    env.reset(seed=seed)
    for _ in range(n_steps):
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, *_, info = env.step(action)
        yield observation, reward, info


@pytest.mark.parametrize("task", IDS)
@pytest.mark.parametrize("level", ["keypoints", "truth", "none"])
def test_both_checkers_have_nothing_to_say(task, level):
    env = gymnasium.make(task, perception=level).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env_for_sb3(env)  # of goals, too: `compute_reward` of one and of many
        check_env(env, skip_render_check=True)
    space = env.observation_space
    assert list(space) == ["achieved_goal", "desired_goal", "observation"]
    assert space["achieved_goal"] == space["desired_goal"]
    assert space["achieved_goal"].shape == (SIZES[task],)


@pytest.mark.parametrize("task", IDS)
def test_a_steps_reward_is_that_of_its_goals_and_info_bit_for_bit(task):
    """One by one, all at once, and as arrays of a vector environment."""
    env = HRCEnv(task, perception="truth", config={"reward": {"proximity_reach_m": 3.0}})
    seen = list(episode(env, 40))
    for observation, reward, info in seen:
        assert env.compute_reward(*goals(observation), info) == reward
        assert isinstance(env.compute_reward(*goals(observation), info), float)
    observations, rewards, infos = zip(*seen, strict=True)
    achieved, desired = (np.stack(each) for each in zip(*map(goals, observations), strict=True))
    together = env.compute_reward(achieved, desired, infos)
    assert together.tolist() == list(rewards)
    assert len({info["reward/proximity"] for info in infos}) > 1  # or nothing was added
    many = gymnasium.make_vec(task, 3, perception="truth", num_threads=1)
    for observation, reward, info in episode(many, 10):
        np.testing.assert_array_equal(
            many.unwrapped.compute_reward(*goals(observation), info), reward
        )


@pytest.mark.parametrize("task", IDS)
def test_without_infos_it_is_the_goals_term_alone(task):
    env = HRCEnv(task, perception="truth")
    *_, (observation, reward, info) = episode(env, 5)
    achieved, desired = goals(observation)
    pair = np.stack([achieved, achieved]), np.stack([desired, achieved])
    for nothing in ([{}, {}], np.array([{}, {}]), {}, None):
        assert env.compute_reward(*pair, nothing).tolist() == [-1.0, 0.0]
    assert info["reward/goal"] == -1.0 != reward


def test_a_goal_is_reached_within_its_radius():
    env = HRCEnv(REACH, perception="none", config={"task": {"radius_m": 0.1}})
    place = np.array([0.1, 0.2, 1.0])
    near, far = place + np.array([[0.0, 0.0999, 0.0], [0.1001, 0.0, 0.0]])
    assert env.compute_reward(np.stack([near, far]), np.stack([place] * 2), {}).tolist() == [0, -1]


def test_every_piece_counts_for_itself():
    env = HRCEnv(PICK, perception="none")
    desired = np.zeros((4, 9))
    achieved = desired + 0.0
    achieved[1, :3], achieved[2, 3:], achieved[3] = 0.1, 0.1, 0.1
    shares = [0, -1 / 3, -2 / 3, -1]
    np.testing.assert_allclose(env.compute_reward(achieved, desired, {}), shares)
    env = HRCEnv(PICK, perception="none", config={"task": {"reward": "all"}})
    assert env.compute_reward(achieved, desired, {}).tolist() == [0, -1, -1, -1]
    with pytest.raises(ConfigError, match='must be "each" or "all", got'):
        HRCEnv(PICK, perception="none", config={"task": {"reward": "sparse"}})


def test_goals_are_what_they_are_called():
    env = HRCEnv(PICK, perception="none", config={"objects": {"noise_m": 0.0}})
    observation, _ = env.reset(seed=1)
    terms = env.split_observation(observation)
    pieces = terms["object_from_tool"].reshape(3, 3) + terms["tool_position"]
    np.testing.assert_allclose(pieces.ravel(), terms["achieved_goal"], atol=1e-6)
    np.testing.assert_allclose(
        terms["desired_goal"].reshape(3, 3), env.simulation.markers(0), atol=1e-6
    )
    reach = HRCEnv(REACH, perception="none")
    observation, _ = reach.reset(seed=1)
    terms = reach.split_observation(observation)
    np.testing.assert_array_equal(terms["achieved_goal"], terms["tool_position"])
    np.testing.assert_allclose(terms["desired_goal"], reach.simulation.markers(0)[0], atol=1e-6)


@pytest.mark.parametrize("task", IDS)
def test_the_observation_does_not_tell_the_goal(task):
    """Or what is judged by another goal would tell the old one."""
    terms = HRCEnv(task, perception="none").simulation.task.observations
    assert [term.name for term in terms] == []


@pytest.mark.parametrize("task", IDS)
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_the_vector_is_the_single_ones_bit_for_bit(task, mode):
    envs = identity.vectors(3, (1, 2), mode, task, perception="keypoints", max_episode_steps=12)
    assert identity.compare(envs, 30, seed=3) == [0, 0]


@pytest.mark.parametrize("task", IDS)
def test_a_pickle_goes_on_the_same(task):
    env = HRCEnv(task, perception="truth")
    list(episode(env, 5))
    again = pickle.loads(pickle.dumps(env))
    action = np.full(env.action_space.shape, 0.3, np.float32)
    np.testing.assert_equal(env.step(action), again.step(action))


def test_success_is_to_be_there_at_the_end():
    env = gymnasium.make(REACH, perception="none", n_workers=0)
    agent = make_agent("scripted", told(env))
    observation, info = env.reset(seed=4)
    there, over = [info["is_success"]], False
    while not over:
        observation, _, terminated, over, info = env.step(agent.act(observation))
        assert not terminated
        assert info["is_success"] == (info["reward/goal"] == 0.0)
        there.append(info["is_success"])
    assert len(there) == 101
    assert not there[0]
    assert there[-1]


def told(env):
    from hrc_env.agents.env_info import env_info

    return env_info(env.unwrapped.simulation)


@pytest.mark.parametrize(("task", "n_episodes", "least"), [(REACH, 32, 1.0), (PICK, 4, 1.0)])
def test_the_expert_solves_it(task, n_episodes, least):
    score = evaluate(
        lambda at: make_agent("scripted", at), n_episodes, task=task,
        perception="none", n_workers=0,
    )  # fmt: skip
    assert score.success_rate >= least


@pytest.mark.slow  # a learner is trained
def test_sb3_learns_from_hindsight():
    """HER asks the vector environment for rewards; infos may be kept for the terms beside."""
    for copied in (False, True):
        env = HRCVecEnv(4, task=REACH, perception="truth", max_episode_steps=20)
        learner = SAC(
            "MultiInputPolicy", env, learning_starts=100, buffer_size=2000, seed=0,
            replay_buffer_class=HerReplayBuffer,
            replay_buffer_kwargs={"copy_info_dict": copied}, policy_kwargs={"net_arch": [16]},
        )  # fmt: skip
        learner.learn(160)
        kept = learner.replay_buffer
        index = np.array([3]), np.array([1])
        virtual = kept._get_virtual_samples(*index)
        real = kept._get_real_samples(*index)
        beside = sum(kept.infos[3, 1].get(f"reward/{name}", 0.0) for name in OTHERS)
        assert (beside != 0.0) == copied
        goal_term = env.env.compute_reward(
            virtual.next_observations["achieved_goal"].numpy(),
            virtual.next_observations["desired_goal"].numpy(), {},
        )  # fmt: skip
        assert virtual.rewards.numpy().ravel() == pytest.approx(goal_term + beside)
        if copied:
            assert real.rewards.item() == np.float32(reward_of(real, kept.infos[3, 1], env))
        env.close()


def reward_of(sample, info, env):
    pair = (sample.next_observations[k].numpy()[0] for k in ("achieved_goal", "desired_goal"))
    return env.env.compute_reward(*pair, info)


def test_a_task_without_goals_says_which_have_some():
    env = HRCEnv(perception="none")
    assert not hasattr(env, "compute_reward")  # or libraries would take it for one with goals
    many = HRCVecEnv(2, perception="none")
    for ask in (
        lambda: env.compute_reward,
        lambda: many.env.compute_reward,
        lambda: many.env_method("compute_reward", np.zeros(3), np.zeros(3), {}),
    ):
        with pytest.raises(NoGoalError, match=r"HRCReach-v0 has no goals") as error:
            ask()
        assert all(task in str(error.value) for task in IDS)
        assert "which have such goals" in str(error.value)
    for name in ("compute_reward", "compute_terminated", "compute_truncated"):
        assert not many.has_attr(name)
        assert not hasattr(env, name)


@pytest.mark.parametrize("ends", [True, False])
def test_what_ended_an_episode_follows_from_goals_and_info(ends):
    """As Gymnasium-Robotics asks of goal environments; a contact ends it here."""
    cost = {"cost": {"contact_terminates": ends}}
    people = {"n_workers": 2, "people": "unaware", "control": "tool"}
    env = HRCEnv(REACH, perception="none", config=cost, **people)
    over = touched = 0
    for seed in (55, 4):  # in which the tool meets somebody
        env.reset(seed=seed)
        for _ in range(15):
            seen, _, terminated, truncated, info = env.step(np.ones(3))
            judged = *goals(seen), info
            assert env.compute_terminated(*judged) is terminated
            assert env.compute_truncated(*judged) is truncated is False
            over, touched = over + terminated, touched + (info["cost_contact"] > 0)
            if terminated:
                break
    assert touched >= 2
    assert over == (2 if ends else 0)


def test_many_are_judged_at_once():
    cost = {"cost": {"contact_terminates": True}}
    env = HRCVectorEnv(2, task=REACH, perception="none", config=cost)
    pairs = np.zeros((2, 3)), np.zeros((2, 3))
    infos = [{"cost_contact": 0.0}, {"cost_contact": 1.0}]
    assert env.compute_terminated(*pairs, infos).tolist() == [False, True]
    assert env.compute_truncated(*pairs, infos).tolist() == [False, False]
    with pytest.raises(ConfigError, match="must both have shape"):
        env.compute_truncated(np.zeros(3), np.zeros(2), {})


def test_a_task_that_ends_by_itself_does_not_pretend_to_follow_from_goals():
    task = vary(find_task(REACH), is_terminal=lambda self, step: False)
    env = HRCEnv(task, perception="none")
    assert not hasattr(env, "compute_terminated")
    with pytest.raises(ConfigError, match=r"Task\.is_terminal"):
        env.compute_terminated  # noqa: B018


@pytest.mark.parametrize(
    ("achieved", "desired", "info", "says"),
    [
        (np.zeros(3), np.zeros((1, 3)), {}, r"must both have shape \(3,\) or \(B, 3\)"),
        (np.zeros(9), np.zeros(9), {}, r"must have shape \(3,\).*got \(9,\)"),
        (np.array([0, 0, np.nan]), np.zeros(3), {}, "achieved_goal must be finite"),
        (
            np.zeros((2, 3)),
            np.zeros((2, 3)),
            [{"reward/effort": 1.0}],
            "one value per pair of goals",
        ),
    ],
)
def test_goals_that_cannot_be_are_refused_in_words(achieved, desired, info, says):
    env = HRCEnv(REACH, perception="none")
    with pytest.raises(ConfigError, match=says):
        env.compute_reward(achieved, desired, info)


def test_settings_that_cannot_be_are_refused_under_their_own_name():
    with pytest.raises(ConfigError, match=r"ReachGoalConfig\.height_m"):
        ReachGoalConfig(height_m=(1.0, 1.0))
    with pytest.raises(ConfigError, match="goal_m must be positive"):
        HRCEnv(PICK, perception="none", config={"task": {"goal_m": 0.0}})
