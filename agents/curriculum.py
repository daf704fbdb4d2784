"""The task first, then care: the weight of the safety term grows while a policy learns.

With the whole weight from the start a learner first learns to stay away, and finds its goals
about nine times later; it is then the more careful one (docs/learning.md has both).
"""

from dataclasses import dataclass, replace

from stable_baselines3.common.callbacks import BaseCallback

from hrc_env.core.errors import ConfigError
from hrc_env.sb3 import HRCVecEnv


@dataclass(frozen=True, slots=True)
class Ramp:
    """A share that grows evenly from 0 to 1."""

    n_steps: int
    """Environment steps that it takes; 0: all of it from the start."""

    def __post_init__(self) -> None:
        if self.n_steps < 0:
            raise ConfigError(f"A ramp takes 0 or more environment steps, got {self.n_steps}.")

    def at(self, n_steps: int) -> float:
        """The share in [0, 1] after so many environment steps."""
        return 1.0 if n_steps >= self.n_steps else n_steps / self.n_steps


class ProximityCurriculum(BaseCallback):
    """Sets the proximity term's weight before every rollout; a resumed run goes on in it."""

    def __init__(self, ramp: Ramp, env: HRCVecEnv) -> None:
        super().__init__()
        self.ramp, self.env = ramp, env
        self.whole = env.env.config.reward

    def _on_rollout_start(self) -> None:
        share = self.ramp.at(self.num_timesteps)
        self.env.set_reward(replace(self.whole, proximity=share * self.whole.proximity))

    def _on_step(self) -> bool:
        return True
