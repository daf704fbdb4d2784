"""The cost beside the reward, for libraries that want six values."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import hrc_env  # noqa: F401  registers the ids
from hrc_env.core.errors import ConfigError
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.vector.six_tuple import CostEnv, CostVectorEnv


def test_one_environment_gives_its_cost_beside_the_reward():
    plain, costed = (gymnasium.make("HRCReach-v0", perception="truth") for _ in range(2))
    costed = CostEnv(costed)
    plain.reset(seed=1)
    costed.reset(seed=1)
    for _ in range(20):
        *expected, info = plain.step(np.ones(6, np.float32))
        observation, reward, cost, terminated, truncated, told = costed.step(np.ones(6, np.float32))
        np.testing.assert_array_equal(observation, expected[0])
        assert (reward, terminated, truncated) == tuple(expected[1:])
        assert (cost, type(cost)) == (info["cost"], float)
        assert told["cost"] == cost


@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP])
def test_several_give_the_cost_of_an_episodes_last_step(mode):
    cost = {"proximity_m": 50.0, "components": ("proximity",)}  # every step costs, no reset does
    config = {"cost": cost}
    env = CostVectorEnv(
        HRCVectorEnv(2, perception="none", autoreset_mode=mode, max_episode_steps=5, config=config)
    )
    env.reset(seed=1)
    costs = [env.step(np.zeros((2, 6), np.float32))[2] for _ in range(6)]
    assert np.array(costs[:5]).min() >= 1.0
    assert (np.array(costs[5]) >= 1.0).all() == (mode is AutoresetMode.SAME_STEP)


def test_an_environment_without_cost_is_refused_in_words():
    env = CostEnv(gymnasium.make("CartPole-v1"))
    env.reset()
    with pytest.raises(ConfigError, match=r"no info\[\"cost\"\]"):
        env.step(0)


def test_a_learner_that_weighs_cost_by_a_multiplier_trains_on_it():
    """Policy gradients with a Lagrange multiplier (Ray et al. 2019), 2,000 steps."""
    rng, multiplier, limit = np.random.default_rng(0), 0.0, 2.0
    env = CostVectorEnv(HRCVectorEnv(8, perception="truth", max_episode_steps=50))
    weights, multipliers = np.zeros((env.single_observation_space.shape[0], 6)), []
    for _ in range(5):
        observation, _ = env.reset(seed=3)
        scores, gained = np.zeros((8, *weights.shape)), np.zeros((2, 8))
        for _ in range(50):
            noise = rng.normal(0.0, 0.5, (8, 6))
            action = np.clip(observation @ weights + noise, -1, 1).astype(np.float32)
            scores += observation[:, :, None] * noise[:, None] / 0.25
            observation, reward, cost, *_ = env.step(action)
            gained += reward, cost
        worth = gained[0] - multiplier * gained[1]
        step = ((worth - worth.mean())[:, None, None] * scores).mean(0)
        weights += 0.02 * step / max(np.linalg.norm(step), 1e-9)
        multiplier = max(0.0, multiplier + 0.05 * (gained[1].mean() - limit))
        multipliers.append(multiplier)
    assert np.isfinite(weights).all()
    assert np.abs(weights).max() > 0
    assert gained.shape == (2, 8)
    assert max(multipliers) > 0
