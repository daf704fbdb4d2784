"""A curriculum from outside: what resets fix, and what the reward's terms weigh, in stages."""

import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from hrc_env import HRCVecEnv, RewardConfig, RigDistribution

STAGES = [  # from which step on: options of all resets, factors on terms of the reward
    (0, {"n_workers": 0}, {"proximity": 0.0}),
    (256, {"n_workers": 1, "activity": "stand"}, {"proximity": 0.5, "goal": 2.0}),
    (512, {"cameras": RigDistribution(max_shift_m=0.2)}, {}),
]


class Curriculum(BaseCallback):
    """Goes on to the next stage when its step has come."""

    def __init__(self) -> None:
        super().__init__()
        self.left, self.workers = list(STAGES), []

    def _on_step(self) -> bool:
        if self.left and self.num_timesteps >= self.left[0][0]:
            _, options, factors = self.left.pop(0)
            self.training_env.env_method("set_options", options)
            self.training_env.env_method("set_reward", factors=factors)
        self.workers += [info["worker_0/activity"] >= 0 for info in self.locals["infos"]
                         if "episode" in info]  # fmt: skip
        return True


envs = HRCVecEnv(4, perception="keypoints", n_workers=(0, 1), max_episode_steps=40)
model = PPO("MlpPolicy", envs, n_steps=64, n_epochs=2, device="cpu", seed=0)
curriculum = Curriculum()
model.learn(1024, callback=curriculum)
assert not curriculum.left
print("was a worker there, episode by episode:", curriculum.workers)
assert envs.get_attr("options") == [STAGES[-1][1]] * 4
envs.close()

# The same for one environment, in any wrappers, and for a vector environment of Gymnasium.
env = gymnasium.make("HRCReach-v0", perception="keypoints", n_workers=(0, 1))
env.get_wrapper_attr("set_options")({"goal": (0.5, 0.3, 1.1)})
env.get_wrapper_attr("set_reward")(RewardConfig(proximity=4.0), factors={"goal": 3.0})
env.reset(seed=0)
vector = gymnasium.make_vec("HRCReach-v0", num_envs=2, perception="truth")
vector.call("set_options", {"goal": (0.5, 0.3, 1.1)})
vector.set_attr("options", [{"n_workers": 1}, {"n_workers": 0}])  # or one for each
_, infos = vector.reset(seed=0)
np.testing.assert_array_equal(infos["worker_0/activity"] >= 0, [True, False])
