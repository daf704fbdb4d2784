"""Soft actor-critic (SAC) by Stable-Baselines3, with hindsight replay for separate goals.

Haarnoja et al. 2018, arXiv:1801.01290; Andrychowicz et al. 2017, arXiv:1707.01495.
"""

from pathlib import Path
from typing import Any

from hrc_env.core.errors import learner
from hrc_env.sb3 import HRCVecEnv
from hrc_env.tasks.task import require_goal

from .learner_settings import SACSettings as SACSettings

with learner():
    from stable_baselines3 import SAC, HerReplayBuffer


def make_learner(
    env: HRCVecEnv,
    settings: SACSettings,
    seed: int,
    tensorboard: Path | None = None,
    her: bool | None = None,
) -> SAC:
    """Return a new SAC learner for `env`.

    Learning begins when every environment has finished an episode. If a transition is relabelled
    with another goal, only the goal term of its reward changes.

    Args:
        env: environments of the training.
        settings: settings of SAC.
        seed: seed of the learner.
        tensorboard: folder of TensorBoard logs.
        her: whether to use hindsight replay (default: True if the task has separate goals).

    Raises:
        NoGoalError: hindsight is requested, and the task has no separate goals.
    """
    task = env.simulation.task
    hindsight = task.goal is not None if her is None else her
    buffer = {}
    if hindsight:
        require_goal(task)
        kept = {"n_sampled_goal": settings.relabelled, "copy_info_dict": True}
        buffer = {"replay_buffer_class": HerReplayBuffer, "replay_buffer_kwargs": kept}
    return SAC(
        "MlpPolicy" if task.goal is None else "MultiInputPolicy", env, **settings.keywords(),
        **buffer, train_freq=1, learning_starts=count_first_steps(env), seed=seed,
        device="cpu", tensorboard_log=None if tensorboard is None else str(tensorboard),
    )  # fmt: skip


def count_first_steps(env: HRCVecEnv) -> int:
    """Return the number of random steps before learning: one episode of each environment."""
    return env.num_envs * (env.env.max_episode_steps + 1)


class ResumedSAC(SAC):
    """SAC for resumed runs, which fills the replay buffer with the policy's actions first."""

    def _sample_action(self, learning_starts: int, *args: Any, **kwargs: Any) -> Any:
        """Return actions that are sampled from the policy, also in the first steps."""
        return super()._sample_action(0, *args, **kwargs)
