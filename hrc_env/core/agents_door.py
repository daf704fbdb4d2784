"""Where the agents are: `agents/` of a checkout, `hrc_env/agents/` of an installed wheel."""

import importlib
import importlib.util
from types import ModuleType


def agents(module: str) -> ModuleType:
    """The module of that name among the agents."""
    installed = importlib.util.find_spec("hrc_env.agents") is not None
    package = "hrc_env.agents" if installed else "agents"
    return importlib.import_module(f"{package}.{module}")
