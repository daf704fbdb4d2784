"""Proximal policy optimisation by Stable-Baselines3, with settings that suit this task.

Schulman et al. 2017, arXiv:1707.06347. What mattered most: no running normalisation of observations
(it inflates nearly constant ones such as ages), a progress term, many short rollouts at random
phases of an episode.
"""

import json
import os
import zipfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env import __version__
from hrc_env.core.errors import CheckpointError, learner

from .env_info import EnvInfo

with learner():
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecEnv, VecNormalize

TRAIN = "python -m hrc_env train"


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


def make_learner(
    env: VecEnv, settings: PPOSettings, seed: int, tensorboard: Path | None = None
) -> PPO:
    """A fresh PPO on `env`; a running estimate scales rewards, observations stay as they are."""
    normalised = VecNormalize(env, norm_obs=False, norm_reward=True, gamma=settings.gamma)
    values = asdict(settings)
    policy = {
        "net_arch": list(values.pop("hidden")),
        "activation_fn": torch.nn.Tanh,
        "log_std_init": values.pop("log_std_init"),
    }
    log = None if tensorboard is None else str(tensorboard)
    return PPO(
        "MlpPolicy", normalised, **values, policy_kwargs=policy, tensorboard_log=log, seed=seed,
        device="cpu",
    )  # fmt: skip


def save(learner: PPO, path: Path, facts: dict[str, Any]) -> None:
    """Write a checkpoint: the learner, the reward's scale, and what it was made for.

    The file appears whole or not at all (temporary file, then rename).
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.zip")
    learner.save(draft)
    scale = learner.get_vec_normalize_env()
    meta = {
        "hrc_env": __version__,
        "observation_size": int(np.prod(learner.observation_space.shape or ())),
        "action_size": int(np.prod(learner.action_space.shape or ())),
        "num_timesteps": learner.num_timesteps,
        "return_mean": None if scale is None else float(scale.ret_rms.mean),
        "return_variance": None if scale is None else float(scale.ret_rms.var),
        "return_count": None if scale is None else float(scale.ret_rms.count),
        **facts,
    }
    with zipfile.ZipFile(draft, "a") as archive:
        archive.writestr("hrc_env.json", json.dumps(meta, indent=1))
    os.replace(draft, path)


def describe(path: Path) -> dict[str, Any]:
    """What a checkpoint says of itself.

    Raises:
        CheckpointError: no file, or not one of ours.
    """
    if not path.exists():
        raise CheckpointError(f"No checkpoint at {path}. Train one with: {TRAIN}")
    try:
        with zipfile.ZipFile(path) as archive:
            return json.loads(archive.read("hrc_env.json"))
    except (zipfile.BadZipFile, KeyError) as error:
        raise CheckpointError(
            f"{path} is not a checkpoint of hrc_env ({error}). Train one with: {TRAIN}"
        ) from error


def resume(path: Path, env: VecEnv, tensorboard: Path | None = None) -> PPO:
    """Go on from a checkpoint, the reward's scale included.

    Raises:
        CheckpointError: it was made for another version or another environment.
    """
    meta = describe(path)
    _check_fits(path, meta, env.observation_space.shape or (), env.action_space.shape or ())
    normalised = VecNormalize(env, norm_obs=False, norm_reward=True)
    if meta["return_variance"] is not None:
        normalised.ret_rms.mean = np.array(meta["return_mean"])
        normalised.ret_rms.var = np.array(meta["return_variance"])
        normalised.ret_rms.count = meta["return_count"]
    log = None if tensorboard is None else str(tensorboard)
    learner = PPO.load(path, env=normalised, device="cpu", tensorboard_log=log)
    normalised.gamma = learner.gamma
    return learner


def load(path: Path, env_info: EnvInfo) -> "TrainedAgent":
    """A trained policy for acting.

    Raises:
        CheckpointError: it was made for another version or another environment.
    """
    _check_fits(path, describe(path), env_info.layout.low.shape, (env_info.n_actions,))
    return TrainedAgent(PPO.load(path, device="cpu"))


class TrainedAgent:
    """The mean action of a trained policy."""

    def __init__(self, learner: PPO) -> None:
        self.learner = learner

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Deterministic actions (..., A)."""
        return self.learner.predict(observation, deterministic=True)[0]


def _check_fits(
    path: Path, meta: dict[str, Any], observation: tuple[int, ...], action: tuple[int, ...]
) -> None:
    made_with = meta["hrc_env"]
    if made_with.split(".")[:2] != __version__.split(".")[:2]:
        raise CheckpointError(
            f"{path} was made with hrc_env {made_with}, this is {__version__}; checkpoints fit the "
            f"same minor version. Install hrc_env {made_with} or train anew: {TRAIN}"
        )
    sizes = (meta["observation_size"],), (meta["action_size"],)
    if sizes != (tuple(observation), tuple(action)):
        raise CheckpointError(
            f"{path} expects observations {sizes[0]} and actions {sizes[1]}, this environment has "
            f"{tuple(observation)} and {tuple(action)}: make it with the same n_workers and "
            f"control ({meta.get('environment')})."
        )
