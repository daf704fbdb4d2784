"""A reward term of one's own in a task that there is, learnt for a few rollouts by PPO."""

import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

import hrc_env


def calm(belief, step, previous_action, config):
    """(B,) half of the tool's speed [m/s], taken off."""
    return -0.5 * np.linalg.norm(belief.robot.tool_velocity_world, axis=1)


term = hrc_env.RewardTerm("calm", "Minus half of the tool's speed [m/s].", calm)
hrc_env.register_task(hrc_env.with_rewards("HRCReach-v0", term, id="CalmReach-v0"))

# It is the task of before, with a term more, single and in batches.
one, other = (
    gymnasium.make(each, perception="keypoints") for each in ("HRCReach-v0", "CalmReach-v0")
)
seen, _ = one.reset(seed=3)
np.testing.assert_array_equal(seen, other.reset(seed=3)[0])
for _ in range(50):
    action = one.action_space.sample()
    _, reward, *_, info = one.step(action)
    _, more, *_, told = other.step(action)
    assert np.isclose(more, reward + told["reward/calm"])
assert told["reward/calm"] < 0
assert "reward/calm" not in info

# The settings that learn the built-in tasks can be imported.
settings = hrc_env.PPOSettings()
envs = hrc_env.HRCVecEnv(16, stagger=True, task="CalmReach-v0", perception="keypoints")
envs.set_reward(hrc_env.RewardConfig(proximity=0.0))  # first the task, then care
scaled = VecNormalize(envs, norm_obs=False, gamma=settings.gamma)
model = PPO("MlpPolicy", scaled, **settings.keywords(), seed=0, device="cpu")
model.learn(2 * 16 * settings.n_steps)
envs.close()
assert hrc_env.RECIPES["HRCPickPlace-v0"]["demonstrations"] == 512

# What cannot be is said in words.
for terms, words in (
    ((), "at least one"),
    ((calm,), "must be a RewardTerm"),
    ((term, term), "already"),
):
    try:
        hrc_env.with_rewards("HRCReach-v0", *terms, id="Mine-v0")
    except hrc_env.ConfigError as error:
        if words not in str(error):
            raise
    else:
        raise AssertionError(terms)
