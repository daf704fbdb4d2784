"""The folder of a study: whose it is, and the finished parts by which a stopped run goes on."""

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
"""Told by how much the share that is done grew, and what is being done; shares sum to 1."""
PartProgress = Callable[[float], None]
"""Told by how much the share of a part that is done grew."""
LABEL = "experiment.json"
_MOST_SAID = 3
"""Differences of settings that an error names."""


@dataclass(frozen=True, slots=True)
class Part:
    """What is played at once, and kept."""

    label: str
    """Its name, which is also its file's."""
    make: Callable[[PartProgress], dict[str, Any]]
    """Makes it, and reports its progress; for engines in other processes it can be pickled."""
    key: str | None = None
    """Key of what it is made from; the cache's own if it is not given."""
    notes: Mapping[str, float] = field(default_factory=dict)
    """Numbers that are kept beside it, for a study whose labels do not say all that is needed to
    make it again."""
    weight: float = 1.0
    """How much of the progress it is; all of a study sum to its `n_parts`."""


@dataclass(frozen=True, slots=True)
class PartCache:
    """Finished parts, each a JSON file beside the key of what it was made from."""

    folder: Path
    key: str
    """Key of parts that are given none of their own (`versions.key_of`)."""
    n_parts: float
    """A part is one of so many in the progress."""
    progress: Progress
    engine: Engine | None = field(default=None, kw_only=True)
    """Where parts are made; None: where it is fastest on this machine."""

    def part(
        self,
        label: str,
        make: Callable[[PartProgress], dict[str, Any]],
        key: str | None = None,
        notes: Mapping[str, float] | None = None,
    ) -> dict[str, Any]:
        """Return the part that is there, if its key is the same, or make it in this process.

        Args:
            label: here and below: as of `Part`.
        """
        return self._parts([Part(label, make, key, notes or {})], Serial())[0]

    def parts(self, parts: Sequence[Part], one_core: bool = False) -> list[dict[str, Any]]:
        """Return parts, of which the engine makes those that are not there; each is kept as soon as
        it is done.

        Args:
            parts: none needs another.
            one_core: whether making one keeps one core busy only; where no engine is chosen,
                several processes then make them.
        """
        engine = self.engine or (Processes() if one_core and n_cores() > 1 else Serial())
        return self._parts(parts, engine)

    def _parts(self, parts: Sequence[Part], engine: Engine) -> list[dict[str, Any]]:
        found = {k: kept for k, each in enumerate(parts) if (kept := self._load(each)) is not None}
        for k in found:
            self.progress(parts[k].weight / self.n_parts, parts[k].label)
        missing = [k for k in range(len(parts)) if k not in found]
        told = dict.fromkeys(missing, 0.0)

        def tick(number: int, share: float) -> None:
            k = missing[number]
            told[k] += share
            self.progress(share * parts[k].weight / self.n_parts, parts[k].label)

        if missing:
            self.progress(0.0, parts[missing[0]].label)
        for done in engine.run([parts[k].make for k in missing], tick):
            k = missing[done.k]
            found[k] = done.result
            self._keep(parts[k], done)
            tick(done.k, max(1.0 - told[k], 0.0))
        return [found[k] for k in range(len(parts))]

    def _keep(self, part: Part, done: Done) -> None:
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
        os.utime(path, ns=(time.time_ns(), path.stat().st_mtime_ns))  # used, not made, now
        return content["part"]


def own_folder(
    out: Path, name: str, overwrite: bool = False, settings: Mapping[str, Any] | None = None
) -> None:
    """Make `out` the folder of a study.

    Args:
        out: folder. Parts that an earlier run with the same settings finished there stay.
        name: of the study.
        overwrite: delete other results; parts of the same study stay, as each has the key
            of its settings.
        settings: all that the numbers depend on; None: not known.

    Raises:
        ConfigError: a file, or other results that are not to be deleted.
    """
    if out.exists() and not out.is_dir():
        raise ConfigError(f"--out must be a folder; {out} is a file.")
    owner, asked = owner_of(out), None if settings is None else _as_written(settings)
    differs = ""
    if owner not in (None, name):
        differs = f"the results of {owner!r}; this is {name!r}"
    elif owner is not None and asked is not None and (found := _settings_in(out)) is not None:
        differs = "; ".join(_differences(found, asked))
        differs = differs and f"results of {name!r} with other settings: {differs}"
    if differs:
        if not overwrite:
            raise ConfigError(
                f"{out} holds {differs}. Choose another folder (--out), or delete what is there: "
                "--overwrite, in Python overwrite=True."
            )
        for each in ("figures",) if owner == name else ("parts", "figures"):
            shutil.rmtree(out / each, ignore_errors=True)
        (out / "results.json").unlink(missing_ok=True)
    known = {} if asked is None else {"settings": asked}
    write_whole(out / LABEL, json.dumps({"experiment": name, **known}))


def disown(out: Path) -> None:
    """Let any settings go on in a folder, with the parts that are the same."""
    for each in (LABEL, "results.json"):
        (out / each).unlink(missing_ok=True)


def _as_written(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings as JSON has them, without digests of source files: after a change of code a
    study goes on in the same folder, and parts that depend on it are made anew."""

    def kept(value: Any) -> Any:
        if isinstance(value, dict):
            named = {k: each for k, each in value.items() if not k.endswith("source")}
            return {name: kept(each) for name, each in named.items()}
        return [kept(each) for each in value] if isinstance(value, list) else value

    return kept(json.loads(json.dumps(settings, default=str)))


def _settings_in(out: Path) -> dict[str, Any] | None:
    """Return the settings with which a folder's study began; None: not known."""
    label, results = out / LABEL, out / "results.json"
    content = json.loads(label.read_text()) if label.exists() else {}
    found = content.get("settings")
    if found is None and results.exists():  # of an earlier version
        with suppress(json.JSONDecodeError, KeyError):
            found = json.loads(results.read_text())["config"]
            found.pop("experiment", None)
    return None if found is None else _as_written(found)


def _differences(found: Any, asked: Any, where: str = "") -> list[str]:
    """Return in words where two settings differ, at most `_MOST_SAID` places."""
    said: list[str] = []
    if isinstance(found, dict) and isinstance(asked, dict):
        for name in dict.fromkeys((*found, *asked)):
            here = f"{where}.{name}" if where else name
            theirs, ours = found.get(name, "nothing"), asked.get(name, "nothing")
            said += _differences(theirs, ours, here) if theirs != ours else []
    elif found != asked:
        said.append(f"{where} is {_short(found)} there and {_short(asked)} here")
    more = len(said) - _MOST_SAID
    return said if more <= 0 else [*said[:_MOST_SAID], f"and {more} more"]


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


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
