"""Access to the rows of records of arrays whose first axis is the environment.

A component that processes only some environments, such as the 3 of 64 that are reset, operates on a
record of their rows. The computation is the same, because no result depends on the batch size.
"""

import copy
import dataclasses
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, TypeVar, cast

import numpy as np

from hrc_env.core.brought import describe
from hrc_env.core.errors import HRCError
from hrc_env.core.typing import Bools, Floats, Ints, is_array, is_dict, is_list_or_tuple

RecordT = TypeVar("RecordT")
ValueT = TypeVar("ValueT")
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


def change_fields(record: RecordT, **fields: Any) -> RecordT:
    """Return a copy of a dataclass in which some fields have other values, which are not checked.

    `dataclasses.replace` also calls `__init__` and `__post_init__`, which takes twice as long.
    """
    kind = type(record)
    changed, names = object.__new__(kind), names_of(kind)
    for name in fields:
        if name not in names:
            raise TypeError(f"{kind.__name__} has no field {name!r}, but {', '.join(names)}.")
    for name in names:
        value = fields[name] if name in fields else getattr(record, name)
        object.__setattr__(changed, name, value)
    return changed


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


def gather(parts: Sequence[Any], bounds: Sequence[int], ids: Ints) -> Any:
    """Return the state of environments `ids`, which may lie in different simulations.

    The first axis of arrays and the entries of lists are environments; entries are not copied.
    Numbers, texts and None are settings, which must be equal in all parts. A record with other
    contents has its own `gather`, with these arguments.

    Args:
        parts: states of S simulations with the same settings: (nested) dictionaries and records.
        bounds: (S + 1,) part s contains environments `bounds[s]` to `bounds[s + 1]` - 1.
        ids: (n,) indices of environments over all parts; an environment may occur repeatedly.

    Raises:
        HRCError: a value has no entry per environment.
    """
    kinds = cast(list[Any], [*map(type, parts)])
    for each in kinds:
        if hasattr(each, "gather"):
            return each.gather(parts, bounds, ids)
    first, kind = parts[0], kinds[0]
    names, sizes = names_of(kind), np.diff(bounds).tolist()
    is_one_kind = all(each is kind for each in kinds)
    has_rows = is_one_kind and kind in (np.ndarray, list) and [*map(len, parts)] == sizes
    if has_rows and is_array(first):
        whole = np.empty((sum(sizes), *first.shape[1:]), first.dtype)
        return np.concatenate(parts, out=whole)[ids]  # out: it keeps the class of records
    if has_rows:
        together: list[Any] = [each for part in parts for each in part]
        return [together[k] for k in ids.tolist()]
    if is_one_kind and is_dict(first):
        return {name: gather([part[name] for part in parts], bounds, ids) for name in first}
    if is_one_kind and (names or issubclass(kind, tuple)):
        columns = [[getattr(part, n) for part in parts] for n in names] or zip(*parts, strict=True)
        values = [gather(column, bounds, ids) for column in columns]
        return kinds[0](*values) if names else tuple(values)
    is_setting = is_one_kind and issubclass(kind, str | float | int | None)
    if is_setting and all(part == first for part in parts):
        return parts[0]
    raise HRCError(
        f"The state of {sizes} environments must consist of arrays and lists with an entry per "
        f"environment, and of equal settings, got {', '.join(map(describe, parts))}. Such "
        "environments cannot be branched."
    )


def gather_entries(
    parts: Sequence[Mapping[int, ValueT]], bounds: Sequence[int], ids: Ints
) -> dict[int, ValueT]:
    """Return the entries of environments `ids` in mappings that have entries for some of them.

    Args:
        parts: entries by the index of the environment within its part.
        bounds: first environments of the parts, as in `gather`.
        ids: (n,) indices of environments over all parts.

    Returns:
        Entries by row of `ids`.
    """
    known = {low + b: each for low, part in zip(bounds, parts, strict=False)
             for b, each in part.items()}  # fmt: skip
    return {row: known[k] for row, k in enumerate(ids.tolist()) if k in known}


def copy_arrays(value: Any) -> Any:
    """Return a deep copy of records, lists and generators; read-only arrays are shared.

    An object that occurs twice is copied twice.
    """
    if is_array(value):
        return value.copy() if value.flags.writeable else value
    kind = cast(type[Any], type(value))
    if names := names_of(kind):
        return kind(*[copy_arrays(getattr(value, name)) for name in names])
    if is_list_or_tuple(value):
        return type(value)(copy_arrays(each) for each in value)
    if is_dict(value) and kind is dict:
        return {name: copy_arrays(each) for name, each in value.items()}
    return copy.deepcopy(value)


def flatten_axes(array: Floats, n_last: int) -> Floats:
    """Return an array (..., *last) reshaped to (count, *last), in contiguous memory.

    `last` stands for the last `n_last` axes.
    """
    if not array.flags.c_contiguous:
        array = np.ascontiguousarray(array)
    shape = array.shape
    return array.reshape(math.prod(shape[:-n_last]), *shape[-n_last:])


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

    def get_rows(self, ids: Ints, batch: int) -> Any:
        """Return a copy of the state of environments `ids` of a batch, as `gather` does."""
        parts = {name: getattr(self, name) for name in self.CHANGES}
        return {
            name: part.get_rows(ids, batch)
            if hasattr(part, "get_rows")
            else copy_arrays(gather([part], [0, batch], ids))
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
