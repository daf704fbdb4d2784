"""Checks of command-line arguments before a command begins its work."""

import math
import tempfile
from pathlib import Path

from hrc_env.core.errors import ConfigError, HRCError


def check_at_least(option: str, value: float | None, low: float) -> None:
    """Raise `ConfigError` if an option's number is below `low` or not finite; None is accepted."""
    if value is not None and not (math.isfinite(value) and value >= low):
        raise ConfigError(f"{option} must be {low:g} or more, got {value:g}.")


def check_writable_folder(path: Path, option: str = "--out") -> None:
    """Raise `HRCError` if files cannot be written into a folder, which need not exist yet."""
    reason = "a file has this name, but a folder is required" if path.is_file() else ""
    _raise_if(reason or _explain_unwritable(path), option, path)


def check_writable_file(path: Path, suffix: str = "", option: str = "--out") -> None:
    """Raise an error if a file cannot be written or its name lacks the required ending.

    Raises:
        ConfigError: the name has another ending.
        HRCError: the file cannot be written.
    """
    if suffix and path.suffix.lower() != suffix:
        raise ConfigError(f"{option} must end in {suffix}, got {path.name!r}.")
    reason = "it is a folder, but a file is required" if path.is_dir() else ""
    _raise_if(reason or _explain_unwritable(path.parent), option, path)


def _explain_unwritable(folder: Path) -> str:
    """Return the reason why a folder or its nearest existing parent is not writable, or ""."""
    there = folder.absolute()
    while not there.exists() and there != there.parent:
        there = there.parent
    try:
        with tempfile.TemporaryFile(dir=there) as file:
            file.write(b"hrc_env")
    except OSError as error:
        return f"{there}: {error.strerror}" if there.is_dir() else f"{there} is not a folder"
    return ""


def _raise_if(reason: str, option: str, path: Path) -> None:
    if reason:
        raise HRCError(f"{path} cannot be written ({reason}). Choose another path with {option}.")
