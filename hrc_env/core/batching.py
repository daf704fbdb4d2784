"""States: records of arrays whose first axis is the environment; their rows, copies, saved ones.

A component that works on a few environments only (a reset of 3 of 64) works on a record of
their rows; as no result depends on the size of the batch, that is the same computation.
"""

import copy
import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, TypeVar

import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints

RecordT = TypeVar("RecordT")
State = dict[str, Any]


def rows(record: RecordT, ids: Ints | Bools) -> RecordT:
    """A copy of rows `ids` of every array of a (nested) record."""
    return mapped(record, lambda array: array[ids])


def one(record: RecordT, b: int) -> RecordT:
    """Environment `b` of a record, without the batch's axis; its arrays are views."""
    return mapped(record, lambda array: array[b])


def write_rows(record: object, ids: Any, part: object) -> None:
    """Write a record of rows back into rows `ids` (integers, a mask, `...`) of a record."""
    if isinstance(record, np.ndarray):
        record[ids] = part
    if isinstance(record, dict):
        for name, array in record.items():
            write_rows(array, ids, part[name])  # type: ignore[index]
    for name in names_of(type(record)):
        write_rows(getattr(record, name), ids, getattr(part, name))


def mapped(record: RecordT, change: Callable[[Any], Any]) -> RecordT:
    """A (nested) record of the same kind with `change` applied to every array."""
    if isinstance(record, np.ndarray):
        return change(record)
    if isinstance(record, dict):
        return type(record)((name, mapped(part, change)) for name, part in record.items())
    names = names_of(type(record))
    values = [mapped(getattr(record, name), change) for name in names]
    return type(record)(*values) if names else record


def copied(value: Any) -> Any:
    """A deep copy of records, lists and generators; arrays that are read-only are shared."""
    if isinstance(value, np.ndarray):
        return value.copy() if value.flags.writeable else value
    if names := names_of(type(value)):
        return type(value)(*[copied(getattr(value, name)) for name in names])
    if isinstance(value, (list, tuple)):
        return type(value)(copied(each) for each in value)
    return copy.deepcopy(value)


def flat(array: Floats, n_last: int) -> Floats:
    """(..., *last) as (count, *last), contiguous, where there are n_last axes in `last`."""
    last = array.shape[-n_last:]
    return np.ascontiguousarray(array).reshape(math.prod(array.shape[:-n_last]), *last)


def picked(streams: Sequence[np.random.Generator], ids: Ints) -> list[np.random.Generator]:
    """The generators of environments `ids`."""
    return [streams[b] for b in ids]


class Stateful:
    """Saves and brings back the attributes in `CHANGES`; the others are settings and constants."""

    CHANGES: ClassVar[tuple[str, ...]] = ()

    def get_state(self) -> Any:
        """A copy of everything that changes; `set_state` brings it back bit for bit."""
        parts = {name: getattr(self, name) for name in self.CHANGES}
        return {
            name: part.get_state() if hasattr(part, "get_state") else copied(part)
            for name, part in parts.items()
        }

    def set_state(self, state: Any) -> None:
        """Continue from a state of a thing with the same settings; the state stays as it is."""
        for name in self.CHANGES:
            part = getattr(self, name)
            if hasattr(part, "set_state"):
                part.set_state(state[name])
            else:
                setattr(self, name, copied(state[name]))


@functools.cache
def names_of(kind: type) -> tuple[str, ...]:
    """The fields of a dataclass or a named tuple; whatever else there is has none."""
    if dataclasses.is_dataclass(kind):
        return tuple(each.name for each in dataclasses.fields(kind))
    return getattr(kind, "_fields", ())
