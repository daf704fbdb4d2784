"""Registries of objects by name: those of the package and those that users register.

Registrations of the parent process are inherited; their objects are unpickled on first use. A
registration of the same name in this process replaces an inherited one.
"""

import threading
from collections import UserDict
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from io import BytesIO
from pickle import loads
from typing import Any, TypeVar

from hrc_env.core import snapshot
from hrc_env.core.errors import ConfigError
from hrc_env.core.snapshot import Entry, Snapshot

ObjectT = TypeVar("ObjectT")
FILES: dict[str, str] = {}
"""Python files that this process imported, with their error messages; "" for a file without an
error."""
_LOCK = threading.RLock()
_REGISTRIES: "dict[str, Registry[Any]]" = {}
_IMPORTING: list[str] = []
"""Stack of the files that are being imported, with the innermost last; "" stands for a file that
every child process imports by itself."""


class Registry(UserDict[str, ObjectT]):
    """Registry of objects of one kind by name."""

    def __init__(self, kind: str, known: Mapping[str, ObjectT] | None = None) -> None:
        super().__init__(known or {})
        self.kind = kind
        self.own: dict[str, str | None] = {}
        """Names registered in this process, with the file that registered each name; None if the
        file is unknown."""
        _REGISTRIES[kind] = self

    def register(self, name: str, thing: ObjectT) -> None:
        """Register an object, also for child processes; raise `ConfigError` if its name exists."""
        taken = name in self.data and (name in self.own or name not in self.inherited)
        if taken:
            raise ConfigError(f"The {self.kind} {name!r} exists already; choose another name.")
        self.data[name] = thing
        if not (_IMPORTING and _IMPORTING[-1] == ""):
            self.own[name] = _IMPORTING[-1] if _IMPORTING else None
            share()

    @property
    def inherited(self) -> Mapping[str, Entry]:
        """Registrations of the parent process."""
        return snapshot.inherited().entries.get(self.kind, {})

    def name_of(self, thing: object) -> str | None:
        """Return the name of an object, or None if it is not registered."""
        return next((name for name, each in self.data.items() if each is thing), None)

    def __contains__(self, name: object) -> bool:
        return name in self.data or name in self.inherited

    def __getitem__(self, name: str) -> ObjectT:
        if name not in self.data and name in self.inherited:
            found = _restored(self.kind, name, self.inherited[name])
            self.data.setdefault(name, found)  # its module may have registered it
        return self.data[name]

    def __delitem__(self, name: str) -> None:
        del self.data[name]
        if name in self.own:
            del self.own[name]
            share()

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self.data, *self.inherited)))

    def __len__(self) -> int:
        return len(list(iter(self)))


@contextmanager
def importing(file: str, recorded: bool) -> Generator[None]:
    """Attribute registrations to a file; if `recorded`, child processes import it as well."""
    _IMPORTING.append(file if recorded else "")
    try:
        yield
    finally:
        _IMPORTING.pop()


def share() -> None:
    """Make the current registrations of this process available to child processes.

    Functions that are defined in a script or notebook are sent with the current values of their
    globals. This runs with every registration and whenever an environment is made.
    """
    with _LOCK:
        parent = snapshot.inherited()
        own = {id(each.data[name]) for each in _REGISTRIES.values() for name in each.own}
        entries = {kind: dict(found) for kind, found in parent.entries.items()}
        for kind, registry in _REGISTRIES.items():
            for name, file in registry.own.items():
                entries.setdefault(kind, {})[name] = _entry(registry.data[name], file, own)
        snapshot.write(Snapshot(entries, tuple(dict.fromkeys((*parent.files, *FILES)))))


def _entry(thing: Any, file: str | None, own: set[int]) -> Entry:
    limit = getattr(thing, "max_episode_steps", 0)
    if file is not None:
        return Entry(file=file, max_episode_steps=limit)
    try:
        return Entry(_pickled(thing, own), max_episode_steps=limit)
    except Exception as error:  # users' objects may raise anything
        return Entry(refused=f"{type(error).__name__}: {error}", max_episode_steps=limit)


def _pickled(thing: Any, own: set[int]) -> bytes:
    """Pickle a registered object by value, which permits objects from scripts and notebooks."""
    import cloudpickle  # type: ignore[reportMissingTypeStubs]  # takes time to import

    pickler: Any = cloudpickle.Pickler

    class ByValue(pickler):
        def reducer_override(self, obj: Any) -> Any:
            """Reduce a registered record to its class and fields."""
            if id(obj) in own and is_dataclass(obj):
                return type(obj), tuple(getattr(obj, each.name) for each in fields(obj))
            return pickler.reducer_override(self, obj)

    file = BytesIO()
    by_value: Any = ByValue(file)
    by_value.dump(thing)
    return file.getvalue()


def _restored(kind: str, name: str, entry: Entry) -> Any:
    """Return an inherited object, or raise `ConfigError` with other ways to provide it."""
    reason, cause = entry.refused or FILES.get(entry.file) or f"{entry.file} lacks it", None
    if entry.pickled:
        try:
            return loads(entry.pickled)
        except Exception as error:
            reason, cause = f"{type(error).__name__}: {error}", error
    raise ConfigError(
        f"The {kind} {name!r} was registered in the parent process and cannot be transferred to "
        f"this one ({reason}). Expected an object that can be pickled, from modules that can be "
        "imported here. Otherwise, register it in a Python file and name this file in "
        "HRC_ENV_IMPORT or import_files, so that every process imports it."
    ) from cause
