"""python -m hrc_env export: a run's policy as safetensors with a card, by `agents/export.py`."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hrc_env.agents.requests import ExportRequest
from hrc_env.cli.checks import at_least, writable_folder
from hrc_env.core.errors import ConfigError


@dataclass(frozen=True)
class Export(ExportRequest):
    """Make of a run's policy a file that executes nothing, and a card of what it is worth."""

    run_folder: Annotated[Path, tyro.conf.Positional]

    def run(self) -> int:
        """Judge and write."""
        at_least("--episodes", self.episodes, 1)
        if not re.fullmatch(r"[a-z][a-z0-9_]*", self.name):
            raise ConfigError(
                f"--name is of small letters, digits and _, as fast_shielded; got {self.name!r}."
            )
        writable_folder(self.out)
        from hrc_env.agents import export  # here: it imports the learner

        return export.run(self)
