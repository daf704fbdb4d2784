"""Checkpoints with a learner of Stable-Baselines3 and a description of its environment."""

import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hrc_env import __version__
from hrc_env.core.errors import learner
from hrc_env.observations import FLAT
from hrc_env.sb3 import HRCVecEnv

from .acting import Size, check_fits, check_made_for, describe
from .env_info import EnvInfo, Observation
from .ppo_lagrangian import PPOLagrangian
from .sac import ResumedSAC, count_first_steps

with learner():
    from stable_baselines3 import PPO, SAC
    from stable_baselines3.common.vec_env import VecNormalize

KINDS = {"ppo": PPO, "ppo_lagrangian": PPOLagrangian, "sac": SAC}
"""Learner classes of Stable-Baselines3, by the name of the algorithm."""
NO_BUFFER = {"buffer_size": 1, "replay_buffer_class": None, "replay_buffer_kwargs": {}}
"""Arguments for loading a learner without its replay buffer, for acting only."""
Learner: TypeAlias = "PPO | SAC"


def save(learner: Learner, path: Path, facts: dict[str, Any]) -> None:
    """Write a checkpoint of a learner, with a description of its environment.

    The checkpoint includes the reward-normalization statistics. It is written to a temporary file,
    which is then renamed; an interrupted write leaves no partial checkpoint.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.zip")
    learner.save(draft)
    scale = learner.get_vec_normalize_env()
    meta = {
        "hrc_env": __version__,
        "algorithm": get_algorithm(learner),
        "observation_size": _get_size(learner.observation_space),
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


def get_algorithm(learner: Learner) -> str:
    """Return the name of a learner's algorithm; raise `StopIteration` if it is not in `KINDS`."""
    kinds = {kind: name for name, kind in KINDS.items()}
    return next(kinds[kind] for kind in type(learner).__mro__ if kind in kinds)


def resume(path: Path, env: HRCVecEnv, tensorboard: Path | None = None) -> Learner:
    """Load the learner of a checkpoint to continue its training in `env`.

    PPO keeps its reward-normalization statistics. SAC first refills its replay buffer by acting
    with its policy, and continues to learn when the buffer holds one episode of each environment.

    Raises:
        CheckpointError: the checkpoint is of another version or for another environment.
    """
    meta = describe(path)
    check_fits(path, meta, _get_size(env.observation_space), _get_size(env.action_space))
    log = None if tensorboard is None else str(tensorboard)
    kind = KINDS[meta.get("algorithm", "ppo")]
    if kind is SAC:
        learner = ResumedSAC.load(path, env=env, device="cpu", tensorboard_log=log)
        learner.learning_starts = learner.num_timesteps + count_first_steps(env)
        return learner
    normalised = VecNormalize(env, norm_obs=False, norm_reward=True)
    if meta["return_variance"] is not None:
        normalised.ret_rms.mean = np.array(meta["return_mean"])
        normalised.ret_rms.var = np.array(meta["return_variance"])
        normalised.ret_rms.count = meta["return_count"]
    learner = kind.load(path, env=normalised, device="cpu", tensorboard_log=log)
    normalised.gamma = learner.gamma
    return learner


def load(path: Path, env_info: EnvInfo) -> "TrainedAgent":
    """Load a trained policy for acting, together with its learner.

    The learner is unpickled, which can execute code from the file: load only checkpoints that you
    trust.

    Raises:
        CheckpointError: the checkpoint is of another version or for another environment.
    """
    meta = describe(path)
    check_made_for(path, meta, env_info)
    kind = KINDS[meta.get("algorithm", "ppo")]
    return TrainedAgent(kind.load(path, device="cpu", custom_objects=NO_BUFFER))


class TrainedAgent:
    """An agent that takes the mean action of a trained policy."""

    def __init__(self, learner: Learner) -> None:
        self.learner = learner

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return deterministic actions (..., A).

        Parts of an observation that were not used in training are ignored.
        """
        space = self.learner.observation_space
        if isinstance(observation, Mapping):
            parts = space.spaces if isinstance(space, spaces.Dict) else None
            observation = (
                {name: observation[name] for name in parts} if parts else observation[FLAT]
            )
        return self.learner.predict(observation, deterministic=True)[0]  # type: ignore[arg-type]


def _get_size(space: spaces.Space[Any]) -> Size:
    if isinstance(space, spaces.Dict):
        return {name: int(np.prod(part.shape or ())) for name, part in space.items()}
    return int(np.prod(space.shape or ()))
