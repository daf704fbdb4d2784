"""Where the bench keeps the parts that are done, so that it can be stopped and goes on."""

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import hrc_env
from hrc_env.experiments.tracking.cells import Tick

Say = Callable[[float, str], None]
"""Told by how much the share that is done grew, and what is being done."""
_CODE = (
    *(f"{room}/**/*.py" for room in ("geometry", "tracking", "experiments/tracking")),
    *(f"{room}/**/*.py" for room in ("scene", "motion", "perception")),
    *(f"{name}.py" for name in ("body", "config", "skeleton", "simulation", "control")),
)


@dataclass(frozen=True, slots=True)
class Shelf:
    """Parts of one bench, each a JSON file; those of other code or settings do not count."""

    folder: Path
    fingerprint: str
    n_parts: int
    say: Say

    def part(self, label: str, make: Callable[[Tick], dict[str, Any]]) -> dict[str, Any]:
        """The part called `label`: the one that is there, or a new one."""
        part = self._load(label)
        if part is not None:
            self.say(1 / self.n_parts, label)
            return part
        self.say(0.0, label)
        part = make(lambda share: self.say(share / self.n_parts, label))
        self._store(label, part)
        return part

    def has(self, label: str) -> bool:
        """Whether a part is there."""
        return self._load(label) is not None

    def _load(self, label: str) -> dict[str, Any] | None:
        """A part that is there, whole, and made by the same code and settings."""
        path = self.folder / f"{label}.json"
        if not path.exists():
            return None
        content: Mapping[str, Any] = json.loads(path.read_text())
        return content["part"] if content["fingerprint"] == self.fingerprint else None

    def _store(self, label: str, part: Mapping[str, Any]) -> None:
        """Write a part, whole or not at all."""
        self.folder.mkdir(parents=True, exist_ok=True)
        draft = self.folder / f"{label}.draft"
        draft.write_text(json.dumps({"fingerprint": self.fingerprint, "part": part}))
        os.replace(draft, self.folder / f"{label}.json")


def fingerprint_of(settings: Mapping[str, Any]) -> str:
    """What a part depends on: the settings and the code that it comes from."""
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    root = Path(hrc_env.__file__).parent
    for pattern in _CODE:
        for path in sorted(root.glob(pattern)):
            digest.update(path.read_bytes())
    digest.update(np.__version__.encode())
    return digest.hexdigest()[:16]
