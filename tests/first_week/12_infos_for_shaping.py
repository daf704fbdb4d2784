"""Infos of every step in Stable-Baselines3's form, and a wrapper that shapes the reward by them."""

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnvWrapper

import hrc_env


class LessCloseness(VecEnvWrapper):
    """Closeness to the believed worker counts twice; the true separation is only watched."""

    def __init__(self, venv):
        super().__init__(venv)
        self.nearest_m = np.inf

    def reset(self):
        return self.venv.reset()

    def step_wait(self):
        observation, reward, done, infos = self.venv.step_wait()
        reward = reward + np.array([info["reward/proximity"] for info in infos], np.float32)
        self.nearest_m = min(self.nearest_m, *(i["safety/min_separation_m"] for i in infos))
        return observation, reward, done, infos


chosen = ("reward/proximity", "safety/*")
envs = hrc_env.HRCVecEnv(16, perception="keypoints", infos=chosen, max_episode_steps=60)
assert "safety/min_separation_m" in envs.info_names

plain = hrc_env.HRCVecEnv(16, perception="keypoints", max_episode_steps=60)
shaped = LessCloseness(envs)
np.testing.assert_array_equal(plain.reset(), shaped.reset())
for _ in range(70):
    action = np.random.default_rng(0).uniform(-1, 1, (16, 6)).astype(np.float32)
    (_, reward, _, infos), (_, more, done, told) = plain.step(action), shaped.step(action)
    assert (more <= reward).all()
    assert all(set(chosen[:1]) <= set(info) for info in told)
    assert done.any() or set(infos[0]) == {"cost"}
assert shaped.nearest_m < 1.0

PPO("MlpPolicy", shaped, n_steps=16, batch_size=64, device="cpu").learn(512)

for wrong, right in (("safty/*", "safety/*"), ("tracking/mpjpe", "tracking/mpjpe_m")):
    try:
        hrc_env.HRCVecEnv(2, perception="keypoints", infos=(wrong,))
    except hrc_env.ConfigError as error:
        if f"Did you mean {right!r}" not in str(error):
            raise
    else:
        raise AssertionError(wrong)
envs.close()
