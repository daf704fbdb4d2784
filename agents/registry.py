"""Agents by name, from the policies that come with the package, or from a file."""

from importlib import import_module
from pathlib import Path

from hrc_env.core.errors import ConfigError, unknown

from . import experts, policies, random
from .env_info import Agent, EnvInfo
from .scripted import Yielding

AGENTS = ("random", "scripted", "scripted_slowed")
"""Names of the agents that need no checkpoint."""


def make_agent(name: str, env_info: EnvInfo, seed: int = 0) -> Agent:
    """Return an agent by name, from a file, or as a function makes it.

    Args:
        name: "random", "scripted", "scripted_slowed"; a policy that comes with the package,
            "hrc://HRCReach-v0/NAME"; the path of a policy (.safetensors) or checkpoint (.zip); or
            "module:function", which is given the `EnvInfo`.
        env_info: of the environment that it acts in, as of `hrc_env.env_info`.
        seed: of an agent that draws.

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
    if ":" in name:
        return _made_by(name, env_info)
    error = unknown("agent", name, AGENTS)
    raise ConfigError(
        f"{error} Or {policies.PREFIX}ID/NAME, the path of what python -m hrc_env train wrote "
        "(.zip) or export (.safetensors), or MODULE:FUNCTION."
    )


def control_of(name: str) -> str | None:
    """Return the `control` that a trained policy was made for; None if it names none."""
    if name.startswith(policies.PREFIX) or Path(name).suffix == policies.SUFFIX:
        return policies.read(policies.path_of(name))[0].control
    if Path(name).suffix != ".zip":
        return None
    from . import checkpoints

    return checkpoints.describe(Path(name)).get("environment", {}).get("control")


def _made_by(name: str, env_info: EnvInfo) -> Agent:
    """What a function makes, by its module's dotted name and its own."""
    module, _, function = name.partition(":")
    try:
        make = getattr(import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise ConfigError(
            f"There is no agent {name!r} ({error}). It must be MODULE:FUNCTION: a module that "
            "can be imported from here, a function that is given an EnvInfo and returns an agent."
        ) from error
    agent = make(env_info)
    if not callable(getattr(agent, "act", None)):
        raise ConfigError(
            f"{name} made {type(agent).__name__}, which has no act(observation) -> actions."
        )
    return agent
