"""Proximal policy optimization (PPO) by Stable-Baselines3, with settings for the built-in tasks.

Schulman et al. 2017, arXiv:1707.06347. The most important choices are a progress term in the
reward, many short rollouts at random phases of an episode, and no running normalization of
observations, which would inflate nearly constant entries such as ages of estimates.
"""

from collections.abc import Callable
from pathlib import Path

from gymnasium.spaces import Dict

from hrc_env.core.errors import learner

from .learner_settings import IMITATOR as IMITATOR
from .learner_settings import PPOSettings as PPOSettings

with learner():
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecEnv, VecNormalize


def make_learner(
    env: VecEnv,
    settings: PPOSettings,
    seed: int,
    tensorboard: Path | None = None,
    kind: Callable[..., PPO] = PPO,
) -> PPO:
    """Return a new PPO learner for `env`.

    Rewards are normalized by running statistics; observations are not changed.
    """
    normalised = VecNormalize(env, norm_obs=False, norm_reward=True, gamma=settings.gamma)
    log = None if tensorboard is None else str(tensorboard)
    network = "MultiInputPolicy" if isinstance(env.observation_space, Dict) else "MlpPolicy"
    return kind(
        network, normalised, **settings.keywords(), tensorboard_log=log, seed=seed, device="cpu",
    )  # fmt: skip
