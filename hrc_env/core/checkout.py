"""What lies beside the package: agents, and the parts that only a clone of the repository has."""

import importlib
import importlib.util
from types import ModuleType

from hrc_env.core.errors import HRCError

CLONE_ONLY = ("benchmarks", "assets")
"""Folders that a wheel does not hold as code."""


def agents(module: str) -> ModuleType:
    """The module of that name among the agents: `agents/`, in a wheel `hrc_env/agents/`."""
    installed = importlib.util.find_spec("hrc_env.agents") is not None
    package = "hrc_env.agents" if installed else "agents"
    return importlib.import_module(f"{package}.{module}")


def module_of(name: str) -> ModuleType:
    """A module by its dotted name: of this package, or of the clone around it."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        itself = f"{name}.".startswith(f"{error.name}.")
        if not (itself and name.startswith(CLONE_ONLY)):
            raise
        raise HRCError(
            f"{name} is a part of the repository, not of the installed package. Clone the "
            "repository, run `pip install -e .` in it, and call this again."
        ) from error
