"""Many environments observe what each of them observes alone."""

import gymnasium
import numpy as np

import hrc_env  # noqa: F401  registers the ids
from hrc_env.sb3 import HRCVecEnv


def check_observations_alone(**asked):
    """Three environments made with `asked`, bit for bit, and over a reset of some of them."""
    actions = np.random.default_rng(0).uniform(-1, 1, (14, 3, 6)).astype(np.float32)
    asked |= {"perception": "keypoints", "max_episode_steps": 9}
    many = HRCVecEnv(3, **asked, stagger=False, seed=7)
    batch = [many.reset(), *(many.step(action)[0] for action in actions)]
    for k in range(3):
        one = gymnasium.make("HRCReach-v0", **asked)
        observation, _ = one.reset(seed=7 + k)
        np.testing.assert_array_equal(observation, batch[0][k])
        for step, action in enumerate(actions[:, k], start=1):
            observation, _, terminated, truncated, _ = one.step(action)
            if terminated or truncated:
                observation, _ = one.reset()
            np.testing.assert_array_equal(observation, batch[step][k])
