"""Agents by name, from the policies that come with the package, or from a file."""

from pathlib import Path

from hrc_env.core.errors import ConfigError, unknown

from . import experts, policies, random
from .env_info import Agent, EnvInfo
from .scripted import Yielding

AGENTS = ("random", "scripted", "scripted_slowed")
"""Names of the agents that need no checkpoint."""


def make_agent(name: str, env_info: EnvInfo, seed: int = 0) -> Agent:
    """An agent by name ("random", "scripted", "scripted_slowed", "hrc://HRCReach-v0/NAME") or from
    a file: a policy (.safetensors) or a checkpoint (.zip).

    Raises:
        ConfigError: neither an agent nor a file.
        CheckpointError: a file that does not fit the environment.
        MissingExtraError: a checkpoint, where the learner that reads it is not installed.
    """
    if name == "random":
        return random.RandomAgent(env_info, seed)
    if name in AGENTS:
        return experts.expert(env_info, Yielding() if name != "scripted" else None)
    if name.startswith(policies.PREFIX) or Path(name).suffix == policies.SUFFIX:
        return policies.load(policies.path_of(name), env_info)
    if Path(name).suffix == ".zip" or Path(name).exists():
        from . import checkpoints  # here: torch takes seconds to import, and need not be there

        return checkpoints.load(Path(name), env_info)
    error = unknown("agent", name, AGENTS)
    raise ConfigError(
        f"{error} Or {policies.PREFIX}ID/NAME, or the path of what python -m hrc_env train wrote "
        "(.zip) or export (.safetensors)."
    )
