"""Access to the rows of records of arrays whose first axis is the environment.

A component that processes only some environments, such as the 3 of 64 that are reset, operates on a
record of their rows. The computation is the same, because no result depends on the batch size.
"""

import copy
import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, TypeVar, cast

import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints, is_array, is_dict, is_list_or_tuple

RecordT = TypeVar("RecordT")
State = dict[str, Any]


def rows(record: RecordT, ids: Ints | Bools) -> RecordT:
    """Return rows `ids` of every array of a (nested) record, as copies."""
    return map_arrays(record, lambda array: array[ids])


def one(record: RecordT, b: int) -> RecordT:
    """Return environment `b` of a record without the batch axis; its arrays are views."""
    return map_arrays(record, lambda array: array[b])


def write_rows(record: object, ids: Any, part: object) -> None:
    """Write a record of rows into a record of the same kind.

    Args:
        record: record that is changed in place.
        ids: indices of the rows: integers, a mask or `...`.
        part: record with the values of these rows.
    """
    if is_array(record):
        record[ids] = part
    if is_dict(record) and is_dict(part):
        for name, array in record.items():
            write_rows(array, ids, part[name])
    for name in names_of(type(record)):
        write_rows(getattr(record, name), ids, getattr(part, name))


def map_arrays(record: RecordT, change: Callable[[Any], Any]) -> RecordT:
    """Return a (nested) record of the same kind with `change` applied to every array."""
    if is_array(record):
        return change(record)
    if is_dict(record):
        changed: Any = type(record)((k, map_arrays(part, change)) for k, part in record.items())
        return changed
    names = names_of(type(record))
    values = [map_arrays(getattr(record, name), change) for name in names]
    return type(record)(*values) if names else record


def copy_arrays(value: Any) -> Any:
    """Return a deep copy of records, lists and generators; read-only arrays are shared."""
    if is_array(value):
        return value.copy() if value.flags.writeable else value
    kind = cast(type[Any], type(value))
    if names := names_of(kind):
        return kind(*[copy_arrays(getattr(value, name)) for name in names])
    if is_list_or_tuple(value):
        return type(value)(copy_arrays(each) for each in value)
    return copy.deepcopy(value)


def flatten_axes(array: Floats, n_last: int) -> Floats:
    """Return an array (..., *last) reshaped to (count, *last), in contiguous memory.

    `last` stands for the last `n_last` axes.
    """
    last = array.shape[-n_last:]
    return np.ascontiguousarray(array).reshape(math.prod(array.shape[:-n_last]), *last)


def select_streams(streams: Sequence[np.random.Generator], ids: Ints) -> list[np.random.Generator]:
    """Return the random generators of environments `ids`."""
    return [streams[b] for b in ids]


class Stateful:
    """Base class of objects with a state that can be saved and restored."""

    CHANGES: ClassVar[tuple[str, ...]] = ()

    def get_state(self) -> Any:
        """Return a copy of the changing attributes; `set_state` restores it bit for bit."""
        parts = {name: getattr(self, name) for name in self.CHANGES}
        return {
            name: part.get_state() if hasattr(part, "get_state") else copy_arrays(part)
            for name, part in parts.items()
        }

    def set_state(self, state: Any) -> None:
        """Restore the state of an object with the same settings; the argument is not changed."""
        for name in self.CHANGES:
            part = getattr(self, name)
            if hasattr(part, "set_state"):
                part.set_state(state[name])
            else:
                setattr(self, name, copy_arrays(state[name]))


@functools.cache
def names_of(kind: type[Any]) -> tuple[str, ...]:
    """Return the field names of a dataclass or a named tuple; () for any other class."""
    if dataclasses.is_dataclass(kind):
        return tuple(each.name for each in dataclasses.fields(kind))
    return getattr(kind, "_fields", ())
