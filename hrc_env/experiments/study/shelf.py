"""Where an experiment keeps the parts that are done, so that it can be stopped and goes on."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrc_env.core.results import write_whole

Say = Callable[[float, str], None]
"""Told by how much the share that is done grew, and what is being done."""
Tick = Callable[[float], None]
"""Told by how much the share of a part that is done grew."""


@dataclass(frozen=True, slots=True)
class Shelf:
    """Parts of one experiment, each a JSON file; those of other code or settings do not count."""

    folder: Path
    fingerprint: str
    n_parts: float
    """A part is one of so many in the progress that is told."""
    say: Say

    def part(self, label: str, make: Callable[[Tick], dict[str, Any]]) -> dict[str, Any]:
        """The part called `label`: the one that is there, or a new one."""
        part = self._load(label)
        if part is not None:
            self.say(1 / self.n_parts, label)
            return part
        self.say(0.0, label)
        told = 0.0

        def tick(share: float) -> None:
            nonlocal told
            told += share
            self.say(share / self.n_parts, label)

        part = make(tick)
        self._store(label, part)
        self.say(max(1.0 - told, 0.0) / self.n_parts, label)
        return part

    def has(self, label: str) -> bool:
        """Whether a part is there."""
        return self._load(label) is not None

    def _load(self, label: str) -> dict[str, Any] | None:
        """A part that is there, whole, and made by the same code and settings."""
        path = self.folder / f"{label}.json"
        try:
            content: Mapping[str, Any] = json.loads(path.read_text())
        except (FileNotFoundError, json.JSONDecodeError):
            return None
        return content["part"] if content["fingerprint"] == self.fingerprint else None

    def _store(self, label: str, part: Mapping[str, Any]) -> None:
        """Write a part, whole or not at all."""
        content = json.dumps({"fingerprint": self.fingerprint, "part": part})
        write_whole(self.folder / f"{label}.json", content)
