"""Soft actor-critic by Stable-Baselines3, with hindsight where a task has goals apart.

Haarnoja et al. 2018, arXiv:1801.01290; Andrychowicz et al. 2017, arXiv:1707.01495.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

from hrc_env.core.errors import learner
from hrc_env.sb3 import HRCVecEnv
from hrc_env.tasks.task import goal_of

from .features import NearAndFar

with learner():
    from stable_baselines3 import SAC, HerReplayBuffer


@dataclass(frozen=True, slots=True)
class SACSettings:
    """Settings of the learner."""

    buffer_size: int = 200_000
    """Transitions that are kept, of all environments together."""
    batch_size: int = 256
    """Samples in a gradient step."""
    gradient_steps: int = 16
    """After each step of all environments."""
    learning_rate: float = 1e-3
    """Adam's step size."""
    gamma: float = 0.95
    """Discount per step; 0.95 looks about 1 s ahead."""
    tau: float = 0.05
    """Share by which the target networks follow in a gradient step."""
    ent_coef: str = "auto_0.05"
    """Weight of the entropy: found as it goes, from this on."""
    hidden: tuple[int, ...] = (128, 128)
    """Hidden layers of actor and critics (ReLU)."""
    near_and_far: bool = True
    """Whether it sees every entry at two scales, and the way to its goal (`agents.features`):
    without that, hindsight found no goal of reaching in 5,000 gradient steps; with it, in 800."""
    relabelled: int = 4
    """With hindsight, how many transitions are judged by goals that were achieved later in their
    episode, for each that is judged by its own."""


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
    task, values = env.simulation.task, asdict(settings)
    hindsight = task.goal is not None if her is None else her
    buffer = {}
    if hindsight:
        goal_of(task)
        kept = {"n_sampled_goal": settings.relabelled, "copy_info_dict": True}
        buffer = {"replay_buffer_class": HerReplayBuffer, "replay_buffer_kwargs": kept}
    del values["relabelled"]
    seen = {"features_extractor_class": NearAndFar} if values.pop("near_and_far") else {}
    policy = {"net_arch": list(values.pop("hidden")), **seen}
    return SAC(
        "MlpPolicy" if task.goal is None else "MultiInputPolicy", env, **values, **buffer,
        policy_kwargs=policy, train_freq=1, learning_starts=first_steps(env), seed=seed,
        device="cpu", tensorboard_log=None if tensorboard is None else str(tensorboard),
    )  # fmt: skip


def first_steps(env: HRCVecEnv) -> int:
    """In which a new buffer fills with random actions: an episode of every environment."""
    return env.num_envs * (env.env.max_episode_steps + 1)
