"""Training of the policies that studies evaluate, by `python -m hrc_env train`.

The policies are stored in the folder of the study.
"""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True, slots=True)
class Training:
    """A run of `python -m hrc_env train`."""

    folder: Path
    """Folder of this run, with a name that contains the options."""
    options: Mapping[str, Any]
    """Options of the command by name, without `--`."""

    @property
    def policy(self) -> Path:
        """Path of the checkpoint, which may not exist yet."""
        return self.folder / "policy.zip"

    @property
    def is_finished(self) -> bool:
        """Whether the policy was trained and evaluated."""
        return (self.folder / "score.json").exists()

    @property
    def score(self) -> dict[str, Any]:
        """Score that `train` wrote at the end of the run."""
        return json.loads((self.folder / "score.json").read_text())

    def run(self) -> None:
        """Train the policy or continue its training; do nothing if the run is finished."""
        if self.is_finished:
            return
        place = {"resume" if self.policy.exists() else "out": self.folder}
        given = {**place, "episodes": 1, **self.options}
        if self.policy.exists():  # the checkpoint contains its task
            given.pop("task", None)
        words = [word for name, value in given.items() for word in (f"--{name}", str(value))]
        print(f"Training: {self.folder}", flush=True)
        path = os.pathsep.join(filter(None, sys.path))
        subprocess.run(
            [sys.executable, "-m", "hrc_env", "train", "--no-film", *words],
            env={**os.environ, "PYTHONPATH": path}, check=True,
        )  # fmt: skip
