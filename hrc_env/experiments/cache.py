"""The folder of a study: whose it is, and the finished parts by which a stopped run goes on."""

import json
import os
import shutil
import time
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
    key: str
    """Key of parts that are given none of their own (`versions.key_of`)."""
    n_parts: float
    """A part is one of so many in the progress."""
    progress: Progress

    def part(
        self,
        label: str,
        make: Callable[[PartProgress], dict[str, Any]],
        key: str | None = None,
        notes: Mapping[str, float] | None = None,
    ) -> dict[str, Any]:
        """Return the part that is there, if its key is the same, or make it.

        Args:
            label: the part's name, which is also its file's.
            make: makes the part, and reports its progress.
            key: the key of what it is made from; the cache's own if it is not given.
            notes: numbers that are kept beside the part, for a study whose labels do not say
                all that is needed to make it again.
        """
        key, told = key or self.key, 0.0

        def tick(share: float) -> None:
            nonlocal told
            told += share
            self.progress(share / self.n_parts, label)

        part = self._load(label, key)
        if part is None:
            tick(0.0)
            started_s = time.monotonic()
            part = make(tick)
            took_s = round(time.monotonic() - started_s, 2)
            content = {"key": key, "seconds": took_s, "notes": dict(notes or {}), "part": part}
            write_whole(self.folder / f"{label}.json", json.dumps(content))
        tick(max(1.0 - told, 0.0))
        return part

    def _load(self, label: str, key: str) -> dict[str, Any] | None:
        path = self.folder / f"{label}.json"
        try:
            content: Mapping[str, Any] = json.loads(path.read_text())
        except (FileNotFoundError, json.JSONDecodeError):
            return None
        if content.get("key") != key:
            return None
        os.utime(path, ns=(time.time_ns(), path.stat().st_mtime_ns))  # used, not made, now
        return content["part"]


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
