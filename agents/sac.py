"""Soft actor-critic by Stable-Baselines3, with hindsight where a task has goals apart.

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
    """A fresh SAC on `env`; with hindsight if `her`, or if nobody says and the task has goals.

    It begins to learn when every environment has an episode behind it. The reward's terms beside
    the goal's stay as they were when a transition is judged by another goal.

    Raises:
        NoGoalError: hindsight is asked for where there are no goals apart from the observation.
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
        **buffer, train_freq=1, learning_starts=first_steps(env), seed=seed,
        device="cpu", tensorboard_log=None if tensorboard is None else str(tensorboard),
    )  # fmt: skip


def first_steps(env: HRCVecEnv) -> int:
    """In which a new buffer fills with random actions: an episode of every environment."""
    return env.num_envs * (env.env.max_episode_steps + 1)


class ResumedSAC(SAC):
    """SAC that goes on: its empty buffer fills with its policy's actions."""

    def _sample_action(self, learning_starts: int, *args: Any, **kwargs: Any) -> Any:
        """Return noisy actions of the policy, from the first step on."""
        return super()._sample_action(0, *args, **kwargs)
