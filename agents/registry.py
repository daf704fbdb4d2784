"""Creation of agents by name, from an included policy, from a file, or by a function."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from hrc_env.core.brought import check_arguments, function_called
from hrc_env.core.errors import ConfigError, make_unknown_name_error

from . import experts, policies, random
from .env_info import Agent, EnvInfo
from .interface import Interface, read_interface
from .scripted import Yielding

AGENTS = ("random", "scripted", "scripted_slowed")
"""Names of the built-in agents, which need no checkpoint."""
OTHERS = (
    f"{policies.PREFIX}ID/NAME, the path of a file of python -m hrc_env train or "
    "Stable-Baselines3 (.zip) or of python -m hrc_env export (.safetensors), or MODULE:FUNCTION, "
    "which takes an EnvInfo and returns an object with act(observation)"
)
"""Other valid forms of an agent's name, for error messages."""


def make_agent(name: str, env_info: EnvInfo, seed: int = 0, trust: bool = False) -> Agent:
    """Return an agent by name, from a file, or from a function.

    Args:
        name: "random", "scripted" or "scripted_slowed"; a policy that comes with the package,
            "hrc://HRCReach-v0/NAME"; the path of a policy (.safetensors), or of a checkpoint of
            `train` or of Stable-Baselines3 (.zip); or "module:function", a function that takes an
            `EnvInfo` and returns an agent.
        env_info: information about the environment in which the agent acts, as `hrc_env.env_info`
            returns it.
        seed: seed of a random agent.
        trust: whether pickles in a checkpoint may be loaded, which can run arbitrary code. Only
            checkpoints with a custom policy or network class, or with statistics of `VecNormalize`,
            need it.

    Raises:
        ConfigError: the name is neither an agent nor a file.
        CheckpointError: the file does not fit the environment, or needs `trust`.
        MissingExtraError: the file is a checkpoint, and the learner that reads it is not installed.
    """
    check_agent(name)
    if name == "random":
        return random.RandomAgent(env_info, seed)
    if name in AGENTS:
        return experts.make_expert(env_info, Yielding() if name != "scripted" else None)
    if is_policy(name):
        return policies.load(policies.find_path(name), env_info)
    if is_checkpoint(name):
        from . import acting  # here: torch is optional and slow to import

        return acting.load(Path(name), env_info, trust)
    return _call_function(name, env_info)


def check_agent(name: str) -> None:
    """Raise `ConfigError` if an agent's name is invalid; this needs no environment.

    Files must exist, and functions are imported. `make_agent` checks whether the agent fits the
    environment.
    """
    if not isinstance(name, str):
        raise ConfigError(f"An agent must be a name, got {type(name).__name__}. {_list_valid()}")
    if name in AGENTS:
        return
    if is_policy(name):
        policies.find_path(name)
        return
    if name and Path(name).is_dir():
        inside = Path(name) / "policy.zip"
        hint = f" Did you mean {str(inside)!r}?" if inside.is_file() else ""
        raise ConfigError(f"The agent {name!r} is a folder.{hint} {_list_valid()}")
    if is_checkpoint(name):
        return
    if ":" in name:
        find_function(name)
        return
    raise ConfigError(f"{make_unknown_name_error('agent', name, AGENTS)} Or {OTHERS}.")


def is_policy(name: str) -> bool:
    """Return whether an agent's name denotes an exported policy (hrc://... or .safetensors)."""
    return name.startswith(policies.PREFIX) or Path(name).suffix == policies.SUFFIX


def find_interface(name: str) -> Interface:
    """Return the settings of an environment that an agent's file states to be necessary."""
    check_agent(name)
    if is_policy(name):
        return policies.read(policies.find_path(name)).card.interface
    if not is_checkpoint(name):
        return Interface()
    from . import acting

    if meta := acting.read_meta(Path(name)):
        return read_interface(meta.get("environment") or {})
    return Interface(control=acting.sb3_files.read_control(Path(name)))


def find_control(name: str) -> str | None:
    """Return the `control` with which a policy was trained, or None if it is unspecified."""
    return find_interface(name).control


def find_function(name: str) -> Callable[..., Any]:
    """Import and return a function by its name "module:function".

    Raises:
        ConfigError: the function does not exist.
    """
    meaning = "a function that takes an EnvInfo and returns an agent"
    function = function_called("agent", name, meaning)
    if not callable(function):
        found = type(function).__name__
        raise ConfigError(f"{name} must be a function of an EnvInfo, got {found}.")
    check_arguments(name, function, "env_info")
    return function


def _list_valid() -> str:
    return f"Valid: {', '.join(map(repr, AGENTS))}. Or {OTHERS}."


def is_checkpoint(name: str) -> bool:
    """Return whether an agent's name is the path of a checkpoint (.zip) or of another file."""
    return bool(name) and (Path(name).suffix == ".zip" or Path(name).is_file())


def _call_function(name: str, env_info: EnvInfo) -> Agent:
    """Create an agent by the function with the given name."""
    agent = find_function(name)(env_info)
    if not callable(getattr(agent, "act", None)):
        raise ConfigError(
            f"{name} made {type(agent).__name__}, which has no act(observation) -> actions."
        )
    check_arguments(f"{name}: act", agent.act, "observation")
    return agent
