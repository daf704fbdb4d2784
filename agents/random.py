"""An agent with uniformly random actions."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hrc_env.observations import FLAT

from .env_info import EnvInfo, Observation


class RandomAgent:
    """An agent that samples uniformly random actions with its own random generator."""

    def __init__(self, env_info: EnvInfo, seed: int = 0) -> None:
        self.n_actions = env_info.n_actions
        self.rng = np.random.default_rng(seed)

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., A) that are sampled uniformly from [-1, 1]."""
        flat = observation[FLAT] if isinstance(observation, Mapping) else observation
        shape = (*flat.shape[:-1], self.n_actions)
        return self.rng.uniform(-1, 1, shape).astype(np.float32)
