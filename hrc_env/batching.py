"""Some rows of a batch: states are records of arrays whose first axis is the environment.

An organ that works on a few environments only (a reset of 3 of 64) works on a record of
their rows; as no result depends on the size of the batch, that is the same computation.
"""

import copy
import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from hrc_env.typing import Ints

RecordT = TypeVar("RecordT")


def rows(record: RecordT, ids: Ints) -> RecordT:
    """A copy of rows `ids` of every array of a (nested) record."""
    return type(record)(**{name: _rows(value, ids) for name, value in _fields(record)})


def one(record: RecordT, b: int) -> RecordT:
    """Environment `b` of a record, without the batch's axis; its arrays are views."""
    return type(record)(
        **{
            name: value[b] if isinstance(value, np.ndarray) else value
            for name, value in _fields(record)
        }
    )


def write_rows(record: object, ids: Ints, part: object) -> None:
    """Write a record of rows back into rows `ids` of a record, in place."""
    for name, value in _fields(record):
        new = getattr(part, name)
        if isinstance(value, np.ndarray):
            value[ids] = new
        elif _is_record(value):
            write_rows(value, ids, new)


def mapped(record: RecordT, change: Callable[[Any], Any]) -> RecordT:
    """A (nested) record of the same kind with `change` applied to every array."""
    return type(record)(**{name: _mapped(value, change) for name, value in _fields(record)})


def copied(value: Any) -> Any:
    """A deep copy of records, lists and generators; arrays that are read-only are shared."""
    if isinstance(value, np.ndarray):
        return value.copy() if value.flags.writeable else value
    if _is_record(value):
        return type(value)(**{name: copied(each) for name, each in _fields(value)})
    if isinstance(value, (list, tuple)):
        return type(value)(copied(each) for each in value)
    return copy.deepcopy(value)


def picked(streams: Sequence[np.random.Generator], ids: Ints) -> list[np.random.Generator]:
    """The generators of environments `ids`."""
    return [streams[b] for b in ids]


def _fields(record: Any) -> list[tuple[str, Any]]:
    """Names and values of a dataclass or a named tuple."""
    if isinstance(record, tuple):
        return list(zip(record._fields, record, strict=True))  # type: ignore[attr-defined]
    return [(each.name, getattr(record, each.name)) for each in dataclasses.fields(record)]


def _is_record(value: object) -> bool:
    return dataclasses.is_dataclass(value) or hasattr(value, "_fields")


def _rows(value: Any, ids: Ints) -> Any:
    if isinstance(value, np.ndarray):
        return value[ids]
    return rows(value, ids) if _is_record(value) else value


def _mapped(value: Any, change: Callable[[Any], Any]) -> Any:
    if isinstance(value, np.ndarray):
        return change(value)
    return mapped(value, change) if _is_record(value) else value
