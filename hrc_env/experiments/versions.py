"""Versions of behaviour, which show whether cached parts and tables are up to date.

`behaviour.toml` contains a version number for each subsystem. A study names the subsystems on which
its results depend; a part that was computed with other versions or settings is computed again. If
the probes in `tests/behaviour/` detect a change in the behaviour of a subsystem, its number is
increased. Changes of code that do not affect behaviour therefore do not invalidate parts.
"""

import hashlib
import inspect
import json
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError, check_names

SUBSYSTEMS = ("env", "tracker", "emulator", "detector", "motion", "shield", "agents")
"""Names of the subsystems in `behaviour.toml`."""
_PACKAGE = Path(__file__).parents[1]


def find_behaviour() -> Path:
    """Return the path of `behaviour.toml`, a file of the package."""
    return _PACKAGE / "behaviour.toml"


def read_versions(path: Path | None = None) -> dict[str, int]:
    """Return the version of every subsystem.

    Args:
        path: a file to read in place of the one that `find_behaviour` returns.

    Raises:
        ConfigError: the file is missing or unreadable, names a subsystem that does not exist,
            leaves one out, or gives one a version that is not a whole number from 1 on.
    """
    path = path or find_behaviour()
    if not path.is_file():
        raise ConfigError(
            f"The file {path.name} with the version of each subsystem is missing. In a clone, "
            f"restore it by `git checkout {path.name}`; otherwise reinstall the package."
        )
    try:
        versions = tomllib.loads(path.read_text())
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path.name} must be lines such as `env = 1`; {error}.") from error
    check_names(f"subsystem in {path.name}", versions, SUBSYSTEMS)
    for name in SUBSYSTEMS:
        version = versions.get(name)
        if not isinstance(version, int) or isinstance(version, bool) or version < 1:
            given = "nothing" if version is None else repr(version)
            raise ConfigError(
                f"{path.name} must give {name} a whole number from 1 on, got {given}."
            )
    return versions


def check_subsystems(subsystems: Iterable[str]) -> None:
    """Raise `ConfigError` unless at least one subsystem is named, and all of them exist."""
    names = tuple(subsystems)
    if not names:
        raise ConfigError(
            "A study must name the subsystems that its numbers depend on, at least one of "
            f"{', '.join(SUBSYSTEMS)}; got none."
        )
    check_names("subsystem", names, SUBSYSTEMS)


def select_versions(subsystems: Iterable[str]) -> dict[str, int]:
    """Return the versions of some subsystems, in the order of `SUBSYSTEMS`."""
    names = tuple(subsystems)
    check_subsystems(names)
    versions = read_versions()
    return {name: versions[name] for name in SUBSYSTEMS if name in names}


def make_key(settings: Mapping[str, Any], subsystems: Iterable[str]) -> str:
    """Return the cache key of a part: a digest of its settings and of its subsystems' versions.

    Args:
        settings: all settings on which the part's numbers depend besides the code, for JSON.
        subsystems: names of the subsystems on which the numbers depend.
    """
    content = json.dumps([settings, select_versions(subsystems)], sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()[:16]


def hash_file(path: Path) -> str:
    """Return the digest of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def hash_source(item: object) -> str:
    """Return the digest of the file that defines an object registered by a user.

    It replaces the version number, which does not exist for users' objects. It is "" for objects of
    this package, which have version numbers, and for objects without a file.
    """
    try:
        path = Path(inspect.getfile(item)).absolute()  # type: ignore[arg-type]
        is_ours = path.is_relative_to(_PACKAGE)
        return "" if is_ours else hash_file(path)
    except (OSError, TypeError):
        return ""
