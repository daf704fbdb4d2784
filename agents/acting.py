"""Loading of checkpoints for acting, without executing code from their files."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env import __version__
from hrc_env.core.errors import CheckpointError
from hrc_env.observations import FLAT
from hrc_env.tasks.goal import ACHIEVED, DESIRED

from . import sb3_files
from .env_info import EnvInfo
from .interface import read_interface

TRAIN = "python -m hrc_env train"
Size = int | dict[str, int]
"""Number of entries of an observation, or numbers by name if goals or images are separate."""


def load(path: Path, env_info: EnvInfo, trust: bool = False) -> sb3_files.SB3Agent:
    """Load the policy in a checkpoint of this package or of Stable-Baselines3.

    The weights are read without unpickling. Pickles in the file are loaded only if they are needed
    and `trust` is set.

    Raises:
        CheckpointError: the checkpoint is of another version or for another environment, or
            `sb3_files.load` rejects it.
    """
    if meta := read_meta(path):
        check_made_for(path, meta, env_info)
    return sb3_files.load(path, env_info, trust)


def describe(path: Path) -> dict[str, Any]:
    """Return the metadata in a checkpoint.

    Raises:
        CheckpointError: the file does not exist, or is not a checkpoint of this package.
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


def read_meta(path: Path) -> dict[str, Any]:
    """Return the metadata in a checkpoint, or an empty dict for a file of Stable-Baselines3.

    Raises:
        CheckpointError: the file does not exist, or is neither a checkpoint of this package nor a
            file of Stable-Baselines3.
    """
    try:
        return describe(path)
    except CheckpointError:
        sb3_files.check_is_one(path)
        return {}


def check_made_for(path: Path, meta: dict[str, Any], env_info: EnvInfo) -> None:
    """Raise `CheckpointError` if a checkpoint of this package is for another environment."""
    size, saved = len(env_info.layout.low), meta["observation_size"]
    beside = dict.fromkeys((ACHIEVED, DESIRED), env_info.goal_size) if env_info.goal_size else {}
    if isinstance(saved, dict):  # a policy need not use all images
        images = {name: shape for name, shape in env_info.images.items() if name in saved}
        beside |= {name: int(np.prod(shape)) for name, shape in images.items()}
    parts: Size = {**beside, FLAT: size} if beside else size
    check_fits(path, meta, parts, env_info.n_actions)
    needed = read_interface(meta.get("environment") or {})
    sb3_files.check_control(path, needed.control or "joint", env_info)
    if needed.forecast_s != env_info.forecast_s:
        raise CheckpointError(
            f"{path} observes forecasts at {needed.forecast_s} s, but this environment has "
            f"forecast_s={env_info.forecast_s}: create it with the former "
            f"(--config 'forecast_s={list(needed.forecast_s)}')."
        )


def check_fits(path: Path, meta: dict[str, Any], observation: Size, action: Size) -> None:
    """Raise `CheckpointError` if a checkpoint's version, or a size of its spaces, differs."""
    made_with = meta["hrc_env"]
    if made_with.split(".")[:2] != __version__.split(".")[:2]:
        raise CheckpointError(
            f"{path} was made with hrc_env {made_with}, but this is {__version__}; checkpoints "
            f"require the same minor version. Install hrc_env {made_with} or train again: {TRAIN}"
        )
    sizes = meta["observation_size"], meta["action_size"]
    if sizes != (observation, action):
        raise CheckpointError(
            f"{path} expects observations {sizes[0]} and actions {sizes[1]}, but this environment "
            f"has {observation} and {action}: create it with the same task, robot, n_workers, "
            f"control, observe_images and config ({meta.get('environment')})."
        )
