"""Errors of this package; their messages state the expected value, the given value and valid ones.

    HRCError
    ├── ConfigError            an invalid setting, name, shape or value (a ValueError)
    │   ├── NoGoalError        a goal-based reward for a task without goals
    │   └── NoAttributeError   an attribute that an environment does not have
    ├── DownloadError          a failed download, or one with unexpected content
    │   └── WeightsError       weights of the pose network
    ├── RenderingError         no OpenGL context
    ├── CheckpointError        a saved agent that does not fit its environment
    ├── AgentError             an agent in a process of its own that fails
    └── MissingExtraError      libraries of an extra that is not installed

A worker out of sight is reported as data (a growing covariance, a flag), never as an error.
"""

import contextlib
import difflib
import numbers
from collections.abc import Callable, Collection, Generator, Iterable
from typing import Any, TypeVar

T = TypeVar("T")


class HRCError(Exception):
    """Base class of all errors that this package raises deliberately."""


class ConfigError(HRCError, ValueError):
    """A setting, name, shape or value is invalid; the message names valid ones."""


class NoGoalError(ConfigError, AttributeError):
    """A goal-based reward is requested for a task without goals.

    It is an `AttributeError`, for which `hasattr` returns False.
    """


class NoAttributeError(ConfigError, AttributeError):
    """An environment has no attribute of this name; `hasattr` returns False for this error."""


class DownloadError(HRCError, RuntimeError):
    """A file cannot be downloaded or has unexpected content."""


class WeightsError(DownloadError):
    """The weights of the pose network are missing or are not the official ones."""


class RenderingError(HRCError, RuntimeError):
    """No OpenGL context could be created on this machine."""


class CheckpointError(HRCError, RuntimeError):
    """A saved agent does not fit the environment for which it is loaded."""


class AgentError(HRCError, RuntimeError):
    """The process of an agent ended, does not answer, or returned invalid actions."""


class MissingExtraError(HRCError, ImportError):
    """A feature needs libraries of an optional extra that is not installed."""


@contextlib.contextmanager
def learner() -> Generator[None]:
    """Return a context that turns failed imports of a learning library into `MissingExtraError`."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            f"Learning and trained policies need {error.name}, which is not installed. Install it "
            'with: pip install "hrc_env[train]"  (in a checkout: make train-quick, or pip install '
            '-c constraints.txt -e ".[train]")'
        ) from error


REGISTERED = ("task", "environment", "robot", "estimator", "detector", "shield")
"""Kinds of objects that users can register (`hrc_env.registration`)."""
OWN = (
    "A custom one becomes available when its file is imported: --import FILE, hrc_env.import_files."
)


def make_unknown_name_error(what: str, got: object, valid: Iterable[str]) -> ConfigError:
    """Return the error for an unknown name, which suggests the nearest valid one.

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
    """Raise `ConfigError` for the first invalid name, if there is one."""
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
        record: record of settings.
        must: the condition, as a key of `_MUST`.
        names: names of the fields.
    """
    for name in names:
        value = getattr(record, name)
        if not _MUST[must](value):
            raise ConfigError(f"{name} must {must}, got {value}.")


def require(value: T | None, what: str) -> T:
    """Return a value, or raise `ConfigError` if it is None."""
    if value is None:
        raise ConfigError(f"{what} is required, but is not available in this environment.")
    return value


def check_shape(what: str, got: tuple[int, ...], expected: tuple[int, ...], meaning: str) -> None:
    """Raise `ConfigError` unless two shapes agree.

    Args:
        what: name of the array, for the error message.
        got: shape of the array.
        expected: required shape.
        meaning: meaning of the axes, for the error message.
    """
    if tuple(got) != tuple(expected):
        raise ConfigError(f"{what} must have shape {expected} ({meaning}), got {tuple(got)}.")


def check_integer(what: str, value: Any, low: int, high: int) -> int:
    """Return an integer from `low` to `high`, or raise `ConfigError`."""
    is_bool = isinstance(value, bool)
    if is_bool or not isinstance(value, numbers.Integral) or not low <= int(value) <= high:
        raise ConfigError(f"{what} must be a whole number from {low} to {high}, got {value!r}.")
    return int(value)
