"""The folder of a study: whose it is, and the finished parts by which a stopped run goes on."""

import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import write_whole

Progress = Callable[[float, str], None]
"""Told by how much the share that is done grew, and what is being done; shares sum to 1."""
PartProgress = Callable[[float], None]
"""Told by how much the share of a part that is done grew."""
LABEL = "experiment.json"


@dataclass(frozen=True, slots=True)
class PartCache:
    """Finished parts, each a JSON file beside the key of what it was made from."""

    folder: Path
    fingerprint: str
    """Key of parts that are given none of their own (`fingerprint_of`)."""
    n_parts: float
    """A part is one of so many in the progress."""
    progress: Progress

    def part(
        self, label: str, make: Callable[[PartProgress], dict[str, Any]], key: str | None = None
    ) -> dict[str, Any]:
        """The part called `label`: the one that is there if its key is the same, or a new one."""
        key, told = key or self.fingerprint, 0.0

        def tick(share: float) -> None:
            nonlocal told
            told += share
            self.progress(share / self.n_parts, label)

        part = self._load(label, key)
        if part is None:
            tick(0.0)
            part = make(tick)
            content = json.dumps({"fingerprint": key, "part": part})
            write_whole(self.folder / f"{label}.json", content)
        tick(max(1.0 - told, 0.0))
        return part

    def _load(self, label: str, key: str) -> dict[str, Any] | None:
        try:
            content: Mapping[str, Any] = json.loads((self.folder / f"{label}.json").read_text())
        except (FileNotFoundError, json.JSONDecodeError):
            return None
        return content["part"] if content["fingerprint"] == key else None


def own_folder(out: Path, name: str, overwrite: bool = False) -> None:
    """Make `out` the folder of a study; what an earlier run of it finished there stays. Other
    results are deleted if that is wanted, or else a `ConfigError`, as is a file."""
    if out.exists() and not out.is_dir():
        raise ConfigError(f"--out must be a folder; {out} is a file.")
    owner = owner_of(out)
    if owner not in (None, name):
        if not overwrite:
            raise ConfigError(
                f"{out} holds the results of {owner!r}; this is {name!r}. Choose another --out, "
                "or give --overwrite to delete those."
            )
        for each in ("parts", "figures"):
            shutil.rmtree(out / each, ignore_errors=True)
        (out / "results.json").unlink(missing_ok=True)
    write_whole(out / LABEL, json.dumps({"experiment": name}))


def owner_of(out: Path) -> str | None:
    """Whose results a folder holds; None: nobody's."""
    for path in (out / LABEL, out / "results.json"):
        if path.exists():
            try:
                content = json.loads(path.read_text())
                return str(content["experiment"] if path.name == LABEL else "another benchmark")
            except (json.JSONDecodeError, KeyError, TypeError):
                return f"something unreadable ({path.name})"
    return None
