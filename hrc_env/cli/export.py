"""Export a run's policy as safetensors with a model card; `agents/export.py` does the work."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hrc_env.agents.requests import ExportRequest
from hrc_env.cli.checks import check_at_least, check_writable_folder
from hrc_env.core.errors import ConfigError


@dataclass(frozen=True)
class Export(ExportRequest):
    """Export a run's policy and a model card with its scores; loading the file executes no code."""

    run_folder: Annotated[Path, tyro.conf.Positional]

    def run(self) -> int:
        """Evaluate the policy and write both files; return the exit status."""
        check_at_least("--episodes", self.episodes, 1)
        if not re.fullmatch(r"[a-z][a-z0-9_]*", self.name):
            raise ConfigError(
                "--name must consist of lowercase letters, digits and _, such as fast_shielded; "
                f"got {self.name!r}."
            )
        check_writable_folder(self.out)
        from hrc_env.agents import export  # here: it imports the learner

        return export.run(self)
