"""Read-only views of arrays for users' functions.

Other code uses the same arrays, which a user's function must therefore not change.
"""

import functools
from collections.abc import Callable, Collection
from typing import Any, NoReturn, TypeVar

from hrc_env.core.batching import names_of
from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import is_array, is_dict, is_list_or_tuple

RecordT = TypeVar("RecordT")
_CONSTANTS: dict[int, tuple[Any, Any]] = {}
"""Cached read-only forms of constant records, by `id` of the record."""
_MOST = 64
"""Number of records in `_CONSTANTS` at which the cache is cleared."""


def read_only(record: RecordT, constants: Collection[str] = ()) -> RecordT:
    """Return a (nested) record of the same kind with read-only views of its arrays.

    Args:
        record: an array, or a dataclass, named tuple, tuple, list or dict of arrays; any other
            value is returned as it is.
        constants: names of fields whose values never change (`constant`).
    """
    if is_array(record):
        view: Any = record.view()
        view.setflags(write=False)
        return view
    if record is None or isinstance(record, float | int | str):
        return record
    names = names_of(type(record))
    if names:
        parts = [
            constant(getattr(record, n)) if n in constants else read_only(getattr(record, n))
            for n in names
        ]
        return _record_of(type(record), names, parts)
    if is_dict(record):
        items: Any = type(record)((name, read_only(part)) for name, part in record.items())
        return items
    if is_list_or_tuple(record):
        parts_of: Any = type(record)(map(read_only, record))
        return parts_of
    return record


def constant(record: RecordT) -> RecordT:
    """Return the read-only form of a record that never changes; it is created once."""
    known = _CONSTANTS.get(id(record))
    if known is None or known[0] is not record:
        if len(_CONSTANTS) >= _MOST:
            _CONSTANTS.clear()
        known = _CONSTANTS[id(record)] = record, read_only(record)
    return known[1]


def is_of_user(function: Any) -> bool:
    """Return whether a function is defined outside this package."""
    try:
        return _is_of_user(function)
    except TypeError:  # an object with a __call__, not hashable
        return True


@functools.cache
def _is_of_user(function: Any) -> bool:
    while isinstance(function, functools.partial):
        function = function.func
    return str(getattr(function, "__module__", "")).partition(".")[0] != "hrc_env"


def call_user_function(what: str, function: Callable[..., Any], *given: Any) -> Any:
    """Call a user's function with read-only arguments.

    Args:
        what: name of the function, for the error message.
        function: the user's function.
        given: arguments of the function, as `read_only` returns them.

    Raises:
        ConfigError: the function writes to an argument.
    """
    try:
        return function(*given)
    except ValueError as error:
        if "read-only" in str(error):
            refuse_writing(what, error)
        raise


def refuse_writing(what: str, error: ValueError) -> NoReturn:
    """Raise `ConfigError` for a function that writes to its arguments."""
    raise ConfigError(
        f"{what} writes to an array that it receives ({error}). Such arrays are shared and "
        "read-only: make a copy first (x = x.copy()), or create a new array (x = x - y instead of "
        "x -= y)."
    ) from error


def _record_of(kind: type[Any], names: tuple[str, ...], values: list[Any]) -> Any:
    """Return a record with the given field values, without calling `__post_init__`."""
    if tuple in kind.__mro__:
        return kind(*values)
    made, write = object.__new__(kind), object.__setattr__
    for name, value in zip(names, values, strict=True):
        write(made, name, value)
    return made
