"""Where the agents are: `agents/` of a checkout, `hrc_env/agents/` of an installed wheel."""

import importlib
import importlib.util
import sys
from types import ModuleType


def agents(module: str) -> ModuleType:
    """The module of that name among the agents."""
    if importlib.util.find_spec("hrc_env.agents") is not None:
        # The wheel carries them inside the package; their own imports say `agents`.
        sys.modules.setdefault("agents", importlib.import_module("hrc_env.agents"))
    return importlib.import_module(f"agents.{module}")
