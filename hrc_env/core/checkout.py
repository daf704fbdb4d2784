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


def from_clone(module: str) -> ModuleType:
    """A module of the benchmarks or of the assets' makers; an error if only a wheel is here."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        missing = error.name or ""
        if not (module == missing or module.startswith(f"{missing}.")):
            raise
        raise HRCError(
            f"{module} is a part of the repository, not of the installed package. Clone the "
            "repository, run `pip install -e .` in it, and call this again."
        ) from error


def module_of(name: str) -> ModuleType:
    """A module by its dotted name: of this package, or of the clone around it."""
    return from_clone(name) if name.startswith(CLONE_ONLY) else importlib.import_module(name)
