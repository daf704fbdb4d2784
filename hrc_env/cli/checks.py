"""Whether a command can do what it was asked, found out before it begins."""

import math
import tempfile
from pathlib import Path

from hrc_env.core.errors import ConfigError, HRCError


def at_least(option: str, value: float | None, low: float) -> None:
    """Raise `ConfigError` unless the number is `low` or more; None is a default, and fine."""
    if value is not None and not (math.isfinite(value) and value >= low):
        raise ConfigError(f"{option} must be {low:g} or more, got {value:g}.")


def writable_folder(path: Path, option: str = "--out") -> None:
    """Raise `HRCError` unless files can be written into the folder; it need not exist yet."""
    reason = "a file of that name is there, and a folder is needed" if path.is_file() else ""
    _refuse(option, path, reason or _unwritable(path))


def writable_file(path: Path, suffix: str = "", option: str = "--out") -> None:
    """Raise `HRCError` unless a file of that name and ending can be written."""
    if suffix and path.suffix.lower() != suffix:
        raise ConfigError(f"{option} must end in {suffix}, got {path.name!r}.")
    reason = "it is a folder, and a file is needed" if path.is_dir() else ""
    _refuse(option, path, reason or _unwritable(path.parent))


def _unwritable(folder: Path) -> str:
    """Why nothing can be written into the folder, or the nearest one above it that exists."""
    there = folder.absolute()
    while not there.exists() and there != there.parent:
        there = there.parent
    try:
        with tempfile.TemporaryFile(dir=there) as file:
            file.write(b"hrc_env")
    except OSError as error:
        return f"{there}: {error.strerror}" if there.is_dir() else f"{there} is no folder"
    return ""


def _refuse(option: str, path: Path, reason: str) -> None:
    if reason:
        raise HRCError(f"{path} cannot be written ({reason}). Name another place with {option}.")
