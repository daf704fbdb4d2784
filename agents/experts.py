"""Scripted agents by task."""

from collections.abc import Callable

from hrc_env.core.errors import ConfigError

from .drywall import BoardHolder
from .env_info import Agent, EnvInfo
from .pick_place import PickPlacer
from .scripted import Reacher, Yielding

EXPERTS: dict[str, Callable[[EnvInfo, Yielding | None], Agent]] = {
    "HRCReach-v0": Reacher,
    "HRCPickPlace-v0": PickPlacer,
    "HRCDrywall-v0": BoardHolder,
}
"""By task: what solves it without learning."""


def expert(env_info: EnvInfo, yielding: Yielding | None = None) -> Agent:
    """The scripted agent for a task, with or without yielding.

    Raises:
        ConfigError: nobody has written one.
    """
    if env_info.task not in EXPERTS:
        raise ConfigError(
            f"There is no scripted agent for {env_info.task}; there is for {', '.join(EXPERTS)}. "
            "The agent 'random' and checkpoints work with every task."
        )
    return EXPERTS[env_info.task](env_info, yielding)
