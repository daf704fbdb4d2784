"""Keys of cached parts, which show whether parts and tables are up to date.

A study names the subsystems on which its results depend; a part that was computed with other
versions of them (`core.versions`) or other settings is computed again.
"""

import hashlib
import inspect
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.versions import SUBSYSTEMS, read_versions

_PACKAGE = Path(__file__).parents[1]


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
