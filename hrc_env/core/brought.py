"""Checks of functions and values that users supply: arguments, types, shapes and ranges."""

import inspect
import os
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.typing import is_array, is_list_or_tuple, is_numpy_scalar

LONGEST = 80
"""Maximum number of characters of a value in an error message."""


def describe(value: object) -> str:
    """Return a short description of a value, for error messages."""
    if is_array(value):
        return f"an array of {value.dtype} with shape {value.shape}"
    if is_list_or_tuple(value):
        parts = ", ".join(describe(each) for each in value[:4])
        more = ", ..." if len(value) > 4 else ""
        return f"a {type(value).__name__} of {len(value)} ({parts}{more})"
    text = repr(value)
    text = text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
    return text if value is None else f"{type(value).__name__} {text}"


def check_arguments(what: str, function: Callable[..., Any], *names: str) -> None:
    """Raise `ConfigError` unless a function can be called with these positional arguments.

    Args:
        what: role of the function, for error messages.
        function: the user's function.
        names: names of the arguments.
    """
    try:
        signature = inspect.signature(function)
    except (ValueError, TypeError) as error:  # functions in C have no signature
        if isinstance(function, type):
            raise ConfigError(
                f"{what} must be a function of ({', '.join(names)}), got the class "
                f"{function.__name__}."
            ) from error
        return
    try:
        signature.bind(*names)
    except TypeError as error:
        raise ConfigError(
            f"{what} must be a function of ({', '.join(names)}), got a function of {signature}: "
            f"{error}."
        ) from error


def function_called(what: str, name: str, meaning: str) -> Any:
    """Import and return the function named by "MODULE:FUNCTION".

    Modules in the working directory are found, too.

    Args:
        what: role of the function, such as "agent", for error messages.
        name: dotted name of the module and, after a colon, name of the function.
        meaning: requirement on the function, for error messages.

    Raises:
        ConfigError: there is no such function.
    """
    module, _, function = name.partition(":")
    if os.getcwd() not in sys.path:  # as with `python -m`
        sys.path.append(os.getcwd())
    try:
        found = getattr(import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        raise ConfigError(
            f"There is no {what} {name!r} ({error}). It must be MODULE:FUNCTION: a module that can "
            f"be imported from the working directory, which contains {meaning}."
        ) from error
    return found


def numbers_of(
    what: str, value: object, shape: tuple[int, ...], meaning: str, finite: bool = True
) -> NDArray[np.float64]:
    """Return a value as a new array of float64, contiguous.

    Args:
        what: name of the value with its unit, for error messages.
        value: an array, or any value that NumPy converts to one.
        shape: the expected shape.
        meaning: meaning of the axes, for error messages.
        finite: whether NaN and infinite numbers are refused.

    Raises:
        ConfigError: the value does not consist of real numbers, has another shape, or is not
            finite.
    """
    try:
        array = np.asarray(value)
    except (ValueError, TypeError) as error:  # ragged lists, faulty __array__
        raise ConfigError(f"{what} must be an array, got {describe(value)}: {error}") from error
    if array.dtype.kind not in "fiub":
        raise ConfigError(
            f"{what} must be real numbers of shape {shape} ({meaning}), got {describe(value)}."
        )
    check_shape(what, array.shape, shape, meaning)
    numbers = np.array(array, np.float64, order="C")
    if finite and not np.isfinite(numbers).all():
        n = int(np.size(numbers) - np.isfinite(numbers).sum())
        raise ConfigError(
            f"{what} must be finite ({meaning}), got {n} of {numbers.size} numbers that are not "
            "finite."
        )
    return numbers


def flags_of(what: str, value: object, shape: tuple[int, ...], meaning: str) -> NDArray[np.bool_]:
    """Return a value as an array of booleans.

    Args:
        what: name of the value, for error messages.
        value: an array, or any value that NumPy converts to one.
        shape: the expected shape.
        meaning: meaning of the axes, for error messages.

    Raises:
        ConfigError: the value has another shape, or contains numbers other than 0 and 1.
    """
    numbers = numbers_of(what, value, shape, meaning)
    if not np.isin(numbers, (0.0, 1.0)).all():
        raise ConfigError(f"{what} must be true or false (1 or 0), got other numbers.")
    return numbers > 0


def points_of(what: str, value: object) -> NDArray[np.float64]:
    """Return a value as an array (N, 3) of at least one point, or raise `ConfigError`."""
    return numbers_of(what, value, (count_of(value), 3), "points, xyz")


def count_of(value: object) -> int:
    """Return the length of a list or array, but at least 1; return 1 for any other value."""
    if is_list_or_tuple(value) or (is_array(value) and value.ndim > 0):
        return max(len(value), 1)
    return 1


def positive(what: str, value: object, unit: str) -> float:
    """Return a positive finite number, or raise `ConfigError`."""
    plain = value.item() if is_numpy_scalar(value) else value
    if isinstance(plain, bool) or not isinstance(plain, int | float):
        plain = np.nan
    number = float(plain)
    if not 0 < number < np.inf:
        raise ConfigError(f"{what} must be positive and finite [{unit}], got {describe(value)}.")
    return number


def check_kind(what: str, value: object, *kinds: type | None) -> None:
    """Raise `ConfigError` unless a value has one of these types; the type None permits None."""
    if not any(value is None if kind is None else isinstance(value, kind) for kind in kinds):
        names = " or ".join("None" if kind is None else kind.__name__ for kind in kinds)
        article = "an" if names[0] in "AEIOaeio" else "a"
        raise ConfigError(f"{what} must be {article} {names}, got {describe(value)}.")


def check_kinds(what: str, values: object, *kinds: type) -> None:
    """Raise `ConfigError` unless `values` is a list of at least one value of these types."""
    if not is_list_or_tuple(values) or not values:
        names = " or ".join(kind.__name__ for kind in kinds)
        raise ConfigError(f"{what} must be a list of at least one {names}, got {describe(values)}.")
    for k, value in enumerate(values):
        check_kind(f"{what}[{k}]", value, *kinds)
