"""Checkpoints: a learner of Stable-Baselines3, and what it was made for."""

import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hrc_env import __version__
from hrc_env.core.errors import CheckpointError, learner
from hrc_env.observations import FLAT, IMAGE
from hrc_env.sb3 import HRCVecEnv
from hrc_env.tasks.goal import ACHIEVED, DESIRED

from .env_info import EnvInfo, Observation
from .ppo_lagrangian import PPOLagrangian
from .sac import first_steps

with learner():
    from stable_baselines3 import PPO, SAC
    from stable_baselines3.common.vec_env import VecNormalize

TRAIN = "python -m hrc_env train"
KINDS = {"ppo": PPO, "ppo_lagrangian": PPOLagrangian, "sac": SAC}
"""By algorithm."""
NO_BUFFER = {"buffer_size": 1, "replay_buffer_class": None, "replay_buffer_kwargs": {}}
"""What acts needs none, and hindsight wants an environment."""
Learner = PPO | SAC
Size = int | dict[str, int]
"""Entries of an observation, by name where goals stand apart."""


def save(learner: Learner, path: Path, facts: dict[str, Any]) -> None:
    """Write a checkpoint: the learner, the reward's scale, and what it was made for.

    The file appears whole or not at all (temporary file, then rename).
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.zip")
    learner.save(draft)
    scale = learner.get_vec_normalize_env()
    meta = {
        "hrc_env": __version__,
        "algorithm": next(name for name, kind in KINDS.items() if type(learner) is kind),
        "observation_size": _size(learner.observation_space),
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
    """Return the description that a checkpoint holds.

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


def resume(path: Path, env: HRCVecEnv, tensorboard: Path | None = None) -> Learner:
    """Go on from a checkpoint: PPO with its scale of rewards; SAC fills its buffer anew first.

    Raises:
        CheckpointError: it was made for another version or another environment.
    """
    meta = describe(path)
    _check_fits(path, meta, _size(env.observation_space), _size(env.action_space))
    log = None if tensorboard is None else str(tensorboard)
    kind = KINDS[meta.get("algorithm", "ppo")]
    if kind is SAC:
        learner = SAC.load(path, env=env, device="cpu", tensorboard_log=log)
        learner.learning_starts = learner.num_timesteps + first_steps(env)
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
    """A trained policy for acting.

    Raises:
        CheckpointError: it was made for another version or another environment.
    """
    meta, size = describe(path), len(env_info.layout.low)
    goals = dict.fromkeys((ACHIEVED, DESIRED), env_info.goal_size) if env_info.goal_size else {}
    images = {name: int(np.prod(shape)) for name, shape in env_info.images.items()}
    seen = meta["observation_size"]
    looks = isinstance(seen, dict) and any(name.startswith(IMAGE) for name in seen)
    beside = {**goals, **(images if looks else {})}  # a policy need not look
    parts: Size = {**beside, FLAT: size} if beside else size
    _check_fits(path, meta, parts, env_info.n_actions)
    kind = KINDS[meta.get("algorithm", "ppo")]
    return TrainedAgent(kind.load(path, device="cpu", custom_objects=NO_BUFFER))


class TrainedAgent:
    """The mean action of a trained policy."""

    def __init__(self, learner: Learner) -> None:
        self.learner = learner

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Deterministic actions (..., A); it is given what it learnt from."""
        space = self.learner.observation_space
        if isinstance(observation, Mapping):
            known = space.spaces if isinstance(space, spaces.Dict) else None
            observation = (
                {name: observation[name] for name in known} if known else observation[FLAT]
            )
        return self.learner.predict(observation, deterministic=True)[0]  # type: ignore[arg-type]


def _size(space: spaces.Space[Any]) -> Size:
    if isinstance(space, spaces.Dict):
        return {name: int(np.prod(part.shape or ())) for name, part in space.items()}
    return int(np.prod(space.shape or ()))


def _check_fits(path: Path, meta: dict[str, Any], observation: Size, action: Size) -> None:
    made_with = meta["hrc_env"]
    if made_with.split(".")[:2] != __version__.split(".")[:2]:
        raise CheckpointError(
            f"{path} was made with hrc_env {made_with}, this is {__version__}; checkpoints fit the "
            f"same minor version. Install hrc_env {made_with} or train anew: {TRAIN}"
        )
    sizes = meta["observation_size"], meta["action_size"]
    if sizes != (observation, action):
        raise CheckpointError(
            f"{path} expects observations {sizes[0]} and actions {sizes[1]}, this environment has "
            f"{observation} and {action}: make it with the same task, n_workers and control "
            f"({meta.get('environment')})."
        )
