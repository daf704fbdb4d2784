"""The task first, then care: the weight of the safety term grows while a policy learns.

With the whole weight from the start a learner first learns to stay away, and reaches its goals
four to seven times later; without it a policy that reaches well touches often.
"""

from dataclasses import dataclass, replace

from stable_baselines3.common.callbacks import BaseCallback

from hrc_env.errors import ConfigError
from hrc_env.sb3 import HRCVecEnv


@dataclass(frozen=True, slots=True)
class Ramp:
    """A share that grows evenly from 0 at `start_step` to 1 at `end_step`."""

    start_step: int
    end_step: int

    def __post_init__(self) -> None:
        if not 0 <= self.start_step <= self.end_step:
            raise ConfigError(
                "A ramp needs two numbers of environment steps, 0 <= start <= end, "
                f"got {self.start_step} and {self.end_step}."
            )

    def at(self, n_steps: int) -> float:
        """The share in [0, 1] after so many environment steps."""
        if n_steps >= self.end_step:
            return 1.0
        return max(n_steps - self.start_step, 0) / (self.end_step - self.start_step)


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
