"""A policy that Stable-Baselines3 saved acts wherever an agent is asked for.

Only its weights are read. A network class of one's own can only be had from the file's pickle,
which runs code: that wants `trust`.
"""

import subprocess
import sys

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

import hrc_env

KEYWORDS = {"perception": "truth", "control": "tool"}


class Halved(BaseFeaturesExtractor):
    """A network of one's own."""

    def __init__(self, observation_space):
        super().__init__(observation_space, observation_space.shape[0])

    def forward(self, observations):
        return observations / 2


env = hrc_env.HRCVecEnv(4, **KEYWORDS)
policy = {"net_arch": [32, 32], "activation_fn": torch.nn.ReLU}
model = PPO("MlpPolicy", env, n_steps=64, batch_size=256, policy_kwargs=policy, device="cpu")
model.learn(512)
model.save("mine.zip")
seen = env.reset()

single = gymnasium.make("HRCReach-v0", **KEYWORDS)
agent = hrc_env.make_agent("mine.zip", hrc_env.env_info(single))
assert np.array_equal(agent.act(seen), model.predict(seen, deterministic=True)[0])
print(hrc_env.evaluate("mine.zip", 4, **KEYWORDS))

command = [sys.executable, "-m", "hrc_env", "play", "--agent", "mine.zip", "--control", "tool"]
subprocess.run([*command, "--perception", "truth"], check=True)

other = gymnasium.make("HRCReach-v0", perception="truth")  # joint velocities: six actions
own = PPO("MlpPolicy", env, policy_kwargs={"features_extractor_class": Halved}, device="cpu")
own.save("own.zip")
for file, where in (("mine.zip", other), ("own.zip", single)):
    try:
        hrc_env.make_agent(file, hrc_env.env_info(where))
        raise AssertionError(f"{file} is to be refused")
    except hrc_env.HRCError as error:
        print(error)
trusted = hrc_env.make_agent("own.zip", hrc_env.env_info(single), trust=True)
assert np.array_equal(trusted.act(seen), own.predict(seen, deterministic=True)[0])
