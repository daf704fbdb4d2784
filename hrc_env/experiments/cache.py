"""The folder of a study. It caches results of completed parts, from which a stopped run resumes."""

import json
import os
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError
from hrc_env.core.machine import n_cores
from hrc_env.core.results import write_whole
from hrc_env.engines.engine import Done, Engine
from hrc_env.engines.local import Processes, Serial

Progress = Callable[[float, str], None]
"""Callback that receives the increase of the completed fraction and the label of the current part.

The increases sum to 1.
"""
PartProgress = Callable[[float], None]
"""Callback that receives the increase of the completed fraction of a part."""
LABEL = "experiment.json"
"""Name of the file that identifies the study to which a folder belongs."""
_MAX_DIFFERENCES = 3
"""Maximum number of different settings that an error message lists."""


@dataclass(frozen=True, slots=True)
class Part:
    """A unit of work of a study, with a result that is stored in a file."""

    label: str
    """Name of the part and of its file."""
    make: Callable[[PartProgress], dict[str, Any]]
    """Function that computes the part and reports its progress. It must be picklable for engines
    that use other processes."""
    key: str | None = None
    """Cache key of the part's inputs; None: the key of the cache."""
    notes: Mapping[str, float] = field(default_factory=dict)
    """Numbers that are stored with the part, if its label does not suffice to compute it again."""
    weight: float = 1.0
    """Weight of the part in the progress display. The weights of a study sum to its `n_parts`."""


@dataclass(frozen=True, slots=True)
class PartCache:
    """Cache of completed parts. Each part is a JSON file that contains the key of its inputs."""

    folder: Path
    key: str
    """Key of the parts with a `Part.key` of None, as `versions.make_key` returns it."""
    n_parts: float
    """Total weight of the study's parts."""
    progress: Progress
    engine: Engine | None = field(default=None, kw_only=True)
    """Engine that computes missing parts; None: the fastest on this machine."""

    def make_part(
        self,
        label: str,
        make: Callable[[PartProgress], dict[str, Any]],
        key: str | None = None,
        notes: Mapping[str, float] | None = None,
    ) -> dict[str, Any]:
        """Return a part from its file if the key matches; otherwise compute it in this process.

        Args:
            label: name of the part.
            make: function that computes the part, as in `Part`.
            key: key of the part, as in `Part`.
            notes: numbers to store with the part, as in `Part`.
        """
        return self._make_parts([Part(label, make, key, notes or {})], Serial())[0]

    def make_parts(self, parts: Sequence[Part], one_core: bool = False) -> list[dict[str, Any]]:
        """Return parts from their files, and compute missing ones by the engine.

        Each part is stored as soon as it is complete.

        Args:
            parts: parts that do not depend on each other.
            one_core: whether a part is computed on only one core; if no engine is chosen, several
                processes then compute the parts.
        """
        engine = self.engine or (Processes() if one_core and n_cores() > 1 else Serial())
        return self._make_parts(parts, engine)

    def _make_parts(self, parts: Sequence[Part], engine: Engine) -> list[dict[str, Any]]:
        loaded = {k: self._load(part) for k, part in enumerate(parts)}
        results = {k: result for k, result in loaded.items() if result is not None}
        for k in results:
            self.progress(parts[k].weight / self.n_parts, parts[k].label)
        missing = [k for k in range(len(parts)) if k not in results]
        reported = dict.fromkeys(missing, 0.0)

        def tick(number: int, share: float) -> None:
            k = missing[number]
            reported[k] += share
            self.progress(share * parts[k].weight / self.n_parts, parts[k].label)

        if missing:
            self.progress(0.0, parts[missing[0]].label)
        for done in engine.run([parts[k].make for k in missing], tick):
            k = missing[done.k]
            results[k] = done.result
            self._store(parts[k], done)
            tick(done.k, max(1.0 - reported[k], 0.0))
        return [results[k] for k in range(len(parts))]

    def _store(self, part: Part, done: Done) -> None:
        content = {
            "key": part.key or self.key,
            "seconds": round(done.seconds, 2),
            "notes": dict(part.notes),
            "part": done.result,
        }
        write_whole(self.folder / f"{part.label}.json", json.dumps(content))

    def _load(self, part: Part) -> dict[str, Any] | None:
        path = self.folder / f"{part.label}.json"
        try:
            content: Mapping[str, Any] = json.loads(path.read_text())
        except (FileNotFoundError, json.JSONDecodeError):
            return None
        if content.get("key") != (part.key or self.key):
            return None
        os.utime(path, ns=(time.time_ns(), path.stat().st_mtime_ns))  # last use
        return content["part"]


def claim_folder(
    out: Path, name: str, overwrite: bool = False, settings: Mapping[str, Any] | None = None
) -> None:
    """Mark `out` as the folder of a study.

    Args:
        out: the folder. Completed parts of an earlier run with the same settings are kept.
        name: name of the study.
        overwrite: whether to delete results of other studies or settings. Parts of the same study
            are kept, because each contains the key of its settings.
        settings: all settings on which the numbers depend; None if unknown.

    Raises:
        ConfigError: `out` is a file, or contains other results that may not be deleted.
    """
    if out.exists() and not out.is_dir():
        raise ConfigError(f"--out must be a folder; {out} is a file.")
    owner, given = read_owner(out), None if settings is None else _normalize(settings)
    differs = ""
    if owner not in (None, name):
        differs = f"the results of {owner!r}; this study is {name!r}"
    elif owner is not None and given is not None and (found := _read_settings(out)) is not None:
        differs = "; ".join(_list_differences(found, given))
        differs = differs and f"results of {name!r} with other settings: {differs}"
    if differs:
        if not overwrite:
            raise ConfigError(
                f"{out} holds {differs}. Choose another folder (--out), or delete these results: "
                "--overwrite, in Python overwrite=True."
            )
        for each in ("figures",) if owner == name else ("parts", "figures"):
            shutil.rmtree(out / each, ignore_errors=True)
        (out / "results.json").unlink(missing_ok=True)
    known = {} if given is None else {"settings": given}
    write_whole(out / LABEL, json.dumps({"experiment": name, **known}))


def release_folder(out: Path) -> None:
    """Remove a folder's mark, so that a study with any settings can use it and its parts."""
    for each in (LABEL, "results.json"):
        (out / each).unlink(missing_ok=True)


def _normalize(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings as JSON stores them, without digests of source files.

    A study can therefore continue in the same folder after a change of code; only the parts that
    depend on the code are computed again.
    """

    def strip(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: strip(item) for k, item in value.items() if not k.endswith("source")}
        return [strip(item) for item in value] if isinstance(value, list) else value

    return strip(json.loads(json.dumps(settings, default=str)))


def _read_settings(out: Path) -> dict[str, Any] | None:
    """Return the settings of the study that owns a folder, or None if they are unknown."""
    label, results = out / LABEL, out / "results.json"
    content = json.loads(label.read_text()) if label.exists() else {}
    found = content.get("settings")
    if found is None and results.exists():  # written by an earlier version
        with suppress(json.JSONDecodeError, KeyError):
            found = json.loads(results.read_text())["config"]
            found.pop("experiment", None)
    return None if found is None else _normalize(found)


def _list_differences(found: Any, given: Any, path: str = "") -> list[str]:
    """Return descriptions of at most `_MAX_DIFFERENCES` differences between two settings."""
    texts: list[str] = []
    if isinstance(found, dict) and isinstance(given, dict):
        for name in dict.fromkeys((*found, *given)):
            inner = f"{path}.{name}" if path else name
            theirs, ours = found.get(name, "nothing"), given.get(name, "nothing")
            texts += _list_differences(theirs, ours, inner) if theirs != ours else []
    elif found != given:
        texts.append(f"{path} is {_shorten(found)} there and {_shorten(given)} here")
    more = len(texts) - _MAX_DIFFERENCES
    return texts if more <= 0 else [*texts[:_MAX_DIFFERENCES], f"and {more} more"]


def _shorten(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def read_owner(out: Path) -> str | None:
    """Return the name of the study that owns a folder, or None if no study does."""
    for path in (out / LABEL, out / "results.json"):
        if path.exists():
            try:
                content = json.loads(path.read_text())
                return str(content["experiment"] if path.name == LABEL else "another benchmark")
            except (json.JSONDecodeError, KeyError, TypeError):
                return f"an unreadable file ({path.name})"
    return None
