"""Proximal policy optimisation by Stable-Baselines3, with settings that suit this task.

Schulman et al. 2017, arXiv:1707.06347. What mattered most: no running normalisation of observations
(it inflates nearly constant ones such as ages), a progress term, many short rollouts at random
phases of an episode.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from gymnasium.spaces import Dict

from hrc_env.core.errors import learner

from .features import NearAndFar

with learner():
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecEnv, VecNormalize


@dataclass(frozen=True, slots=True)
class PPOSettings:
    """Settings of the learner."""

    n_steps: int = 64
    """Steps of each environment between updates."""
    batch_size: int = 1024
    """Samples in a gradient step."""
    n_epochs: int = 5
    """Passes over a rollout."""
    learning_rate: float = 5e-4
    """Adam's step size."""
    gamma: float = 0.98
    """Discount per step; 0.98 looks about 2 s ahead."""
    gae_lambda: float = 0.95
    """Bias against variance of the advantage."""
    clip_range: float = 0.2
    """How far a policy may move in an update."""
    hidden: tuple[int, ...] = (128, 128)
    """Hidden layers of policy and value network (tanh)."""
    log_std_init: float = -0.5
    """Initial log standard deviation of actions."""
    near_and_far: bool = False
    """Whether it sees every entry at two scales (`agents.features`), through layers of ReLU."""


IMITATOR = PPOSettings(hidden=(256, 256), near_and_far=True, learning_rate=5e-5, gamma=0.99)
"""Of who begins with what an expert does, and keeps most of it."""


def make_learner(
    env: VecEnv,
    settings: PPOSettings,
    seed: int,
    tensorboard: Path | None = None,
    kind: Callable[..., PPO] = PPO,
) -> PPO:
    """A fresh PPO on `env`; a running estimate scales rewards, observations stay as they are."""
    normalised = VecNormalize(env, norm_obs=False, norm_reward=True, gamma=settings.gamma)
    values = asdict(settings)
    near = values.pop("near_and_far")
    policy = {
        "net_arch": list(values.pop("hidden")),
        "activation_fn": torch.nn.ReLU if near else torch.nn.Tanh,
        "log_std_init": values.pop("log_std_init"),
        **({"features_extractor_class": NearAndFar} if near else {}),
    }
    log = None if tensorboard is None else str(tensorboard)
    network = "MultiInputPolicy" if isinstance(env.observation_space, Dict) else "MlpPolicy"
    return kind(
        network, normalised, **values, policy_kwargs=policy, tensorboard_log=log, seed=seed,
        device="cpu",
    )  # fmt: skip
