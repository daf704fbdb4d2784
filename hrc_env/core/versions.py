"""Versions of behaviour.

`behaviour.toml` contains a version number for each subsystem. If the probes in `tests/behaviour/`
detect a change in the behaviour of a subsystem, its number is increased. Changes of code that do
not affect behaviour do not change it.
"""

import tomllib
from pathlib import Path

from hrc_env.core.errors import ConfigError, check_names

SUBSYSTEMS = ("env", "tracker", "emulator", "detector", "motion", "shield", "agents")
"""Names of the subsystems in `behaviour.toml`."""


def find_behaviour() -> Path:
    """Return the path of `behaviour.toml`, a file of the package."""
    return Path(__file__).parents[1] / "behaviour.toml"


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
