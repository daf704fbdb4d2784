"""Agents by name, from the policies that come with the package, from a file, or by a function."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from hrc_env.core.brought import check_arguments, function_called
from hrc_env.core.errors import ConfigError, unknown

from . import experts, policies, random
from .env_info import Agent, EnvInfo
from .scripted import Yielding

AGENTS = ("random", "scripted", "scripted_slowed")
"""Names of the agents that need no checkpoint."""
OTHERS = (
    f"{policies.PREFIX}ID/NAME, the path of what python -m hrc_env train or Stable-Baselines3 "
    "wrote (.zip) or python -m hrc_env export (.safetensors), or MODULE:FUNCTION, which is given "
    "an EnvInfo and returns what has act(observation)"
)
"""Other forms of an agent, for errors."""


def make_agent(name: str, env_info: EnvInfo, seed: int = 0, trust: bool = False) -> Agent:
    """Return an agent by name, from a file, or as a function makes it.

    Args:
        name: "random", "scripted", "scripted_slowed"; a policy that comes with the package,
            "hrc://HRCReach-v0/NAME"; the path of a policy (.safetensors), or of a checkpoint of
            `train` or of Stable-Baselines3 (.zip); or "module:function", which is given the
            `EnvInfo`.
        env_info: of the environment that it acts in, as of `hrc_env.env_info`.
        seed: of an agent that draws.
        trust: whether pickles in a checkpoint may be read, which run code of whoever made it.
            Only checkpoints with a policy or network class of somebody's own need that, and
            statistics of `VecNormalize`.

    Raises:
        ConfigError: neither an agent nor a file.
        CheckpointError: a file that does not fit the environment, or that needs `trust`.
        MissingExtraError: a checkpoint, where the learner that reads it is not installed.
    """
    check_agent(name)
    if name == "random":
        return random.RandomAgent(env_info, seed)
    if name in AGENTS:
        return experts.expert(env_info, Yielding() if name != "scripted" else None)
    if is_policy(name):
        return policies.load(policies.path_of(name), env_info)
    if _is_checkpoint(name):
        from . import acting  # here: torch takes seconds to import, and need not be there

        return acting.load(Path(name), env_info, trust)
    return _made_by(name, env_info)


def check_agent(name: str) -> None:
    """Raise `ConfigError` for a name that is no agent, before an environment is made.

    Files are looked for, and functions are imported; whether they fit is found when they are
    given an `EnvInfo`.
    """
    if not isinstance(name, str):
        raise ConfigError(f"An agent must be a name, got {type(name).__name__}. {_valid()}")
    if name in AGENTS:
        return
    if is_policy(name):
        policies.path_of(name)
        return
    if name and Path(name).is_dir():
        inside = Path(name) / "policy.zip"
        hint = f" Did you mean {str(inside)!r}?" if inside.is_file() else ""
        raise ConfigError(f"The agent {name!r} is a folder.{hint} {_valid()}")
    if _is_checkpoint(name):
        return
    if ":" in name:
        function_of(name)
        return
    raise ConfigError(f"{unknown('agent', name, AGENTS)} Or {OTHERS}.")


def is_policy(name: str) -> bool:
    """Return whether a name is that of a policy that executes nothing: hrc://, .safetensors."""
    return name.startswith(policies.PREFIX) or Path(name).suffix == policies.SUFFIX


def control_of(name: str) -> str | None:
    """Return the `control` that a trained policy was made for; None if it names none."""
    check_agent(name)
    if is_policy(name):
        return policies.read(policies.path_of(name))[0].control
    if not _is_checkpoint(name):
        return None
    from . import acting

    if meta := acting.meta_of(Path(name)):
        return meta.get("environment", {}).get("control")
    return acting.sb3_files.control_of(Path(name))


def function_of(name: str) -> Callable[..., Any]:
    """Return the function that "module:function" names.

    Raises:
        ConfigError: there is none.
    """
    meaning = "a function that is given an EnvInfo and returns an agent"
    made = function_called("agent", name, meaning)
    if not callable(made):
        raise ConfigError(f"{name} must be a function of an EnvInfo, got {type(made).__name__}.")
    check_arguments(name, made, "env_info")
    return made


def _valid() -> str:
    return f"Valid: {', '.join(map(repr, AGENTS))}. Or {OTHERS}."


def _is_checkpoint(name: str) -> bool:
    return bool(name) and (Path(name).suffix == ".zip" or Path(name).is_file())


def _made_by(name: str, env_info: EnvInfo) -> Agent:
    """What a function makes, by its module's dotted name and its own."""
    agent = function_of(name)(env_info)
    if not callable(getattr(agent, "act", None)):
        raise ConfigError(
            f"{name} made {type(agent).__name__}, which has no act(observation) -> actions."
        )
    check_arguments(f"{name}: act", agent.act, "observation")
    return agent
