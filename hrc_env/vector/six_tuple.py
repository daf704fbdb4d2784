"""For safe-RL libraries whose `step` gives the cost beside the reward, as Safety-Gymnasium's does.

    env = CostEnv(gymnasium.make("HRCReach-v0", perception="keypoints"))
    observation, reward, cost, terminated, truncated, info = env.step(action)

Libraries that read `info["cost"]` need neither.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError


class CostEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """One environment, whose `step` gives six values; `ConfigError` where there is no cost."""

    def step(self, action: Any) -> Any:
        """Observation, reward, cost, whether the episode ends or is cut off, and info."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, float(_known(info)), terminated, truncated, info


class CostVectorEnv(VectorWrapper):
    """The same of several, with arrays (B,); of an episode that ends the cost of its last step,
    also where the next one begins in the same step."""

    def __init__(self, env: VectorEnv) -> None:
        super().__init__(env)

    def step(self, actions: Any) -> Any:
        """Observations, rewards, costs, whether episodes end or are cut off, and infos."""
        observation, reward, terminated, truncated, infos = self.env.step(actions)
        cost: NDArray[np.float64] = np.array(_known(infos), float)
        if "final_info" in infos:
            cost = np.where(infos["_final_info"], infos["final_info"]["cost"], cost)
        return observation, reward, cost, terminated, truncated, infos


def _known(info: dict[str, Any]) -> Any:
    if "cost" not in info:
        raise ConfigError('The environment gives no info["cost"]; those of hrc_env do.')
    return info["cost"]
