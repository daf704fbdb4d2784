"""Wrappers for safe-RL libraries in which `step` returns the cost, as in Safety-Gymnasium.

    env = hrc_env.CostEnv(gymnasium.make("HRCReach-v0", perception="keypoints"))
    observation, reward, cost, terminated, truncated, info = env.step(action)

Libraries that read `info["cost"]` need no wrapper.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError


class CostEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A single environment in which `step` returns six values, the cost as the third.

    `step` raises `ConfigError` if the info has no cost.
    """

    def step(self, action: Any) -> Any:
        """Advance the environment by one control step.

        Returns:
            Observation, reward, cost, whether the episode is terminated, whether it is truncated,
            and info.
        """
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, float(_read_cost(info)), terminated, truncated, info


class CostVectorEnv(VectorWrapper):
    """A vector environment in which `step` returns six values, the cost (B,) as the third.

    At the end of an episode, the returned cost is that of the last step, even if the next episode
    begins in the same step.
    """

    def __init__(self, env: VectorEnv) -> None:
        super().__init__(env)

    def step(self, actions: Any) -> Any:
        """Advance every environment by one control step.

        Returns:
            Observations, rewards, costs, whether episodes are terminated, whether they are
            truncated, and infos.
        """
        observation, reward, terminated, truncated, infos = self.env.step(actions)
        cost: NDArray[np.float64] = np.array(_read_cost(infos), float)
        if "final_info" in infos:
            cost = np.where(infos["_final_info"], infos["final_info"]["cost"], cost)
        return observation, reward, cost, terminated, truncated, infos


def _read_cost(info: dict[str, Any]) -> Any:
    """Return the cost from infos, or raise `ConfigError` if there is none."""
    if "cost" not in info:
        raise ConfigError('The environment has no info["cost"], which those of hrc_env provide.')
    return info["cost"]
