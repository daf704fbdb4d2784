"""Errors in one voice: what was expected, what came, what would be valid.

A worker who is not seen is data (growing covariance, a flag), never one of these.
"""

import contextlib
import difflib
import numbers
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Any, TypeVar

T = TypeVar("T")


class HRCError(Exception):
    """Base of every error that this package raises on purpose."""


class ConfigError(HRCError, ValueError):
    """A setting, name, shape or value that cannot work, with what would."""


class NoGoalError(ConfigError, AttributeError):
    """A reward by goals is asked for of a task that has none. Who asks with `hasattr` hears so."""


class NoAttributeError(ConfigError, AttributeError):
    """An environment has no attribute of this name; `hasattr` gives False."""


class DownloadError(HRCError, RuntimeError):
    """Something that is fetched once could not be fetched, or is not what it should be."""


class WeightsError(DownloadError):
    """The pose network's weights are missing or are not the official ones."""


class RenderingError(HRCError, RuntimeError):
    """No OpenGL context could be made on this machine."""


class CheckpointError(HRCError, RuntimeError):
    """A saved agent that does not fit the environment it is loaded for."""


class MissingExtraError(HRCError, ImportError):
    """Something is wanted whose libraries are an extra that is not installed."""


@contextlib.contextmanager
def learner() -> Iterator[None]:
    """Round imports of the learner's libraries: a `MissingExtraError` has the line to type."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            f"Learning and trained policies need {error.name}, which is not installed. Type: "
            'pip install "hrc_env[train]"  (in a checkout: make train-quick, or '
            'pip install -c constraints.txt -e ".[train]")'
        ) from error


REGISTERED = ("task", "environment", "robot", "estimator", "detector", "shield")
"""Kinds of things that users can register (`hrc_env.registration`)."""
OWN = "One of your own is known once its file is imported: --import FILE, hrc_env.import_files."


def unknown(what: str, got: object, valid: Iterable[str]) -> ConfigError:
    """The error for a name that is not in a list, with the nearest valid one."""
    names = list(valid)
    near = difflib.get_close_matches(str(got), names, n=1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    own = f" {OWN}" if what in REGISTERED else ""
    return ConfigError(f"Unknown {what} {got!r}.{hint} Valid: {', '.join(map(repr, names))}.{own}")


def check_names(what: str, names: Iterable[object], valid: Collection[str]) -> None:
    """Raise the error for the first of the names that is not in a list, if there is one."""
    for name in names:
        if name not in valid:
            raise unknown(what, name, valid)


_MUST: dict[str, Callable[[float], bool]] = {
    "be positive": lambda value: value > 0,
    "not be negative": lambda value: value >= 0,
    "be in (0, 1)": lambda value: 0 < value < 1,
    "be in (0, 1]": lambda value: 0 < value <= 1,
    "be in [0, 1)": lambda value: 0 <= value < 1,
    "be in [0, 1]": lambda value: 0 <= value <= 1,
}


def check_fields(record: object, must: str, *names: str) -> None:
    """Raise `ConfigError` for the first field of these names that is not as it `must` (`_MUST`)."""
    for name in names:
        value = getattr(record, name)
        if not _MUST[must](value):
            raise ConfigError(f"{name} must {must}, got {value}.")


def needed(value: T | None, what: str) -> T:
    """A value that must be there, or `ConfigError`."""
    if value is None:
        raise ConfigError(f"{what} is asked for, and there is none here.")
    return value


def check_shape(what: str, got: tuple[int, ...], expected: tuple[int, ...], meaning: str) -> None:
    """Raise `ConfigError` unless the shapes agree; `meaning` says what the axes are."""
    if tuple(got) != tuple(expected):
        raise ConfigError(f"{what} must have shape {expected} ({meaning}), got {tuple(got)}.")


def whole(what: str, value: Any, low: int, high: int) -> int:
    """A whole number in [low, high], or a `ConfigError`."""
    is_whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not is_whole or not low <= int(value) <= high:
        raise ConfigError(f"{what} must be a whole number from {low} to {high}, got {value!r}.")
    return int(value)
