"""The errors of this package: each states the expected value, the given value and valid ones.

    HRCError
    ├── ConfigError            a setting, name, shape or value that cannot work (a ValueError)
    │   ├── NoGoalError        a reward by goals of a task without goals
    │   └── NoAttributeError   an attribute that an environment does not have
    ├── DownloadError          a download that failed or has another content
    │   └── WeightsError       weights of the pose network
    ├── RenderingError         no OpenGL context
    ├── CheckpointError        a saved agent that does not fit its environment
    └── MissingExtraError      libraries of an extra that is not installed

A worker out of sight is data (a growing covariance, a flag), never an error.
"""

import contextlib
import difflib
import numbers
from collections.abc import Callable, Collection, Generator, Iterable
from typing import Any, TypeVar

T = TypeVar("T")


class HRCError(Exception):
    """Base of every error that this package raises on purpose."""


class ConfigError(HRCError, ValueError):
    """A setting, name, shape or value that cannot work; the message has valid ones."""


class NoGoalError(ConfigError, AttributeError):
    """A reward by goals is requested for a task without goals; `hasattr` gives False."""


class NoAttributeError(ConfigError, AttributeError):
    """An environment has no attribute of this name; `hasattr` gives False."""


class DownloadError(HRCError, RuntimeError):
    """A file that is downloaded once is not available, or is not the expected one."""


class WeightsError(DownloadError):
    """The pose network's weights are missing or are not the official ones."""


class RenderingError(HRCError, RuntimeError):
    """No OpenGL context could be made on this machine."""


class CheckpointError(HRCError, RuntimeError):
    """A saved agent does not fit the environment for which it is loaded."""


class MissingExtraError(HRCError, ImportError):
    """A feature needs libraries of an extra that is not installed."""


@contextlib.contextmanager
def learner() -> Generator[None]:
    """Turn a failed import of a learner's library into a `MissingExtraError` with the remedy."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            f"Learning and trained policies need {error.name}, which is not installed. Type: "
            'pip install "hrc_env[train]"  (in a checkout: make train-quick, or '
            'pip install -c constraints.txt -e ".[train]")'
        ) from error


REGISTERED = ("task", "environment", "robot", "estimator", "detector", "shield")
"""Kinds of objects that users can register (`hrc_env.registration`)."""
OWN = "One of your own is known once its file is imported: --import FILE, hrc_env.import_files."


def make_unknown_name_error(what: str, got: object, valid: Iterable[str]) -> ConfigError:
    """Return the error for an unknown name, with the nearest valid one.

    Args:
        what: kind of the name, such as "shield".
        got: the unknown name.
        valid: all valid names.
    """
    names = list(valid)
    near = difflib.get_close_matches(str(got), names, n=1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    own = f" {OWN}" if what in REGISTERED else ""
    return ConfigError(f"Unknown {what} {got!r}.{hint} Valid: {', '.join(map(repr, names))}.{own}")


def check_names(what: str, names: Iterable[object], valid: Collection[str]) -> None:
    """Raise `ConfigError` for the first of the names that is not valid, if there is one."""
    for name in names:
        if name not in valid:
            raise make_unknown_name_error(what, name, valid)


_MUST: dict[str, Callable[[float], bool]] = {
    "be positive": lambda value: value > 0,
    "not be negative": lambda value: value >= 0,
    "be in (0, 1)": lambda value: 0 < value < 1,
    "be in (0, 1]": lambda value: 0 < value <= 1,
    "be in [0, 1)": lambda value: 0 <= value < 1,
    "be in [0, 1]": lambda value: 0 <= value <= 1,
}


def check_fields(record: object, must: str, *names: str) -> None:
    """Raise `ConfigError` for the first field that violates a condition.

    Args:
        record: the settings.
        must: the condition, a key of `_MUST`.
        names: the fields.
    """
    for name in names:
        value = getattr(record, name)
        if not _MUST[must](value):
            raise ConfigError(f"{name} must {must}, got {value}.")


def require(value: T | None, what: str) -> T:
    """Return a value that must not be None, or raise `ConfigError`."""
    if value is None:
        raise ConfigError(f"{what} is asked for, and there is none here.")
    return value


def check_shape(what: str, got: tuple[int, ...], expected: tuple[int, ...], meaning: str) -> None:
    """Raise `ConfigError` unless two shapes agree.

    Args:
        what: name of the array, for the error.
        got: its shape.
        expected: the shape that it must have.
        meaning: meaning of the axes, for the error.
    """
    if tuple(got) != tuple(expected):
        raise ConfigError(f"{what} must have shape {expected} ({meaning}), got {tuple(got)}.")


def check_integer(what: str, value: Any, low: int, high: int) -> int:
    """Return an integer from `low` to `high`, or raise `ConfigError`."""
    is_bool = isinstance(value, bool)
    if is_bool or not isinstance(value, numbers.Integral) or not low <= int(value) <= high:
        raise ConfigError(f"{what} must be a whole number from {low} to {high}, got {value!r}.")
    return int(value)
