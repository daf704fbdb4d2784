"""Declared records: one class defines NumPy's dtype, the type for checkers, and the documentation.

    class Track:
        mean: Annotated[Floats, (15, 6)]    # each field with a docstring below it
        age_s: Annotated[Floats, (15,)]
        is_tracked: bool

    TRACK = dtype_of(Track)
    tracks = make_records(Track, (n_envs, n_workers))  # dtype TRACK, of type Records2[Track]

A kernel whose argument is annotated `tracks: Records2[Track]` reads and writes
`tracks[e, w].age_s[j]`; the type checker reports a misspelt field before anything runs. Such a
class is never instantiated: its rows are stored in arrays. Python code reads their fields by name
(`tracks["age_s"]`); attributes of rows exist in kernels only. Groups of arrays whose sizes vary
between calls (with the robot or the batch) are `typing.NamedTuple` classes, which kernels accept
directly.
"""

from collections.abc import Iterator
from functools import cache
from types import EllipsisType
from typing import (
    Annotated,
    Any,
    Protocol,
    Self,
    TypeAlias,
    TypeVar,
    get_args,
    get_origin,
    get_type_hints,
    overload,
)

import numpy as np
from numpy.typing import NDArray

RowT = TypeVar("RowT", covariant=True)
NewT = TypeVar("NewT")
Selection: TypeAlias = slice | NDArray[Any] | list[int] | EllipsisType
"""Index that selects rows and keeps their axis."""
SCALARS: dict[Any, str] = {bool: "?", int: "i8", float: "f8"}
"""NumPy type codes of the fields that hold a single value."""


@cache
def dtype_of(declaration: type) -> np.dtype[Any]:
    """Return the structured dtype of a declared record, with fields aligned as in C.

    Args:
        declaration: a class whose annotated attributes are the fields, in order: `bool`, `int` or
            `float` for one value, `Annotated[Floats, shape]` (or of any other `NDArray`) for an
            array of a fixed shape, another declared record, or `Annotated[Record, shape]`.

    Raises:
        TypeError: a field has another annotation.
    """
    hints = get_type_hints(declaration, include_extras=True)
    return np.dtype([(name, *_field_type(name, hint)) for name, hint in hints.items()], align=True)


def _field_type(name: str, hint: Any) -> tuple[Any, ...]:
    """Return the NumPy type of a field, as (type,) or (type, shape)."""
    shapes: list[tuple[int, ...]] = []
    if get_origin(hint) is Annotated:
        hint, *metadata = get_args(hint)
        shapes = [each for each in metadata if isinstance(each, tuple)]
    shape = shapes[-1:]
    if hint in SCALARS:
        return SCALARS[hint], *shape
    if get_origin(hint) is np.ndarray and shape:
        return get_args(get_args(hint)[1])[0], *shape
    if isinstance(hint, type) and get_type_hints(hint):
        return dtype_of(hint), *shape
    raise TypeError(
        f"The field {name} of a declared record must be bool, int, float, a declared record or "
        f"Annotated[Floats, shape], got {hint}."
    )


@overload
def make_records(declaration: type[NewT], shape: int | tuple[int]) -> "Records1[NewT]": ...
@overload
def make_records(declaration: type[NewT], shape: tuple[int, int]) -> "Records2[NewT]": ...
@overload
def make_records(declaration: type[NewT], shape: tuple[int, int, int]) -> "Records3[NewT]": ...
@overload
def make_records(declaration: type[NewT], shape: tuple[int, int, int, int]) -> "Records4[NewT]": ...
@overload
def make_records(
    declaration: type[NewT], shape: tuple[int, int, int, int, int]
) -> "Records5[NewT]": ...
def make_records(declaration: type[Any], shape: Any) -> Any:
    """Return an array of declared records, all zero.

    Args:
        declaration: the class that declares a row.
        shape: lengths of the axes, of which there are one to five.
    """
    return np.zeros(shape, dtype_of(declaration))


class AnyRecords(Protocol):
    """Interface of a structured array for the type checker; at run time it is a NumPy array."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Length of every axis."""
        ...

    @property
    def size(self) -> int:
        """Number of rows over all axes."""
        ...

    @property
    def dtype(self) -> np.dtype[Any]:
        """Structured dtype of a row."""
        ...

    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[Any]: ...
    def __setitem__(self, at: Any, value: Any, /) -> None: ...
    def copy(self) -> Self:
        """Return the rows as a new array."""
        ...


class Records1(AnyRecords, Protocol[RowT]):
    """A structured array of one axis with rows declared by `RowT`."""

    @overload
    def __getitem__(self, at: int, /) -> RowT: ...
    @overload
    def __getitem__(self, at: Selection, /) -> Self: ...
    @overload
    def __getitem__(self, at: str, /) -> NDArray[Any]: ...
    def __getitem__(self, at: Any, /) -> Any: ...


class Records2(AnyRecords, Protocol[RowT]):
    """A structured array of two axes with rows declared by `RowT`."""

    @overload
    def __getitem__(self, at: int, /) -> "Records1[RowT]": ...
    @overload
    def __getitem__(self, at: tuple[int, int], /) -> RowT: ...
    @overload
    def __getitem__(self, at: Selection, /) -> Self: ...
    @overload
    def __getitem__(self, at: str, /) -> NDArray[Any]: ...
    def __getitem__(self, at: Any, /) -> Any: ...


class Records3(AnyRecords, Protocol[RowT]):
    """A structured array of three axes with rows declared by `RowT`."""

    @overload
    def __getitem__(self, at: int, /) -> "Records2[RowT]": ...
    @overload
    def __getitem__(self, at: tuple[int, int], /) -> "Records1[RowT]": ...
    @overload
    def __getitem__(self, at: tuple[int, int, int], /) -> RowT: ...
    @overload
    def __getitem__(self, at: Selection, /) -> Self: ...
    @overload
    def __getitem__(self, at: str, /) -> NDArray[Any]: ...
    def __getitem__(self, at: Any, /) -> Any: ...


class Records4(AnyRecords, Protocol[RowT]):
    """A structured array of four axes with rows declared by `RowT`."""

    @overload
    def __getitem__(self, at: int, /) -> "Records3[RowT]": ...
    @overload
    def __getitem__(self, at: tuple[int, int], /) -> "Records2[RowT]": ...
    @overload
    def __getitem__(self, at: tuple[int, int, int], /) -> "Records1[RowT]": ...
    @overload
    def __getitem__(self, at: tuple[int, int, int, int], /) -> RowT: ...
    @overload
    def __getitem__(self, at: Selection, /) -> Self: ...
    @overload
    def __getitem__(self, at: str, /) -> NDArray[Any]: ...
    def __getitem__(self, at: Any, /) -> Any: ...


class Records5(AnyRecords, Protocol[RowT]):
    """A structured array of five axes with rows declared by `RowT`."""

    @overload
    def __getitem__(self, at: int, /) -> "Records4[RowT]": ...
    @overload
    def __getitem__(self, at: tuple[int, int], /) -> "Records3[RowT]": ...
    @overload
    def __getitem__(self, at: tuple[int, int, int], /) -> "Records2[RowT]": ...
    @overload
    def __getitem__(self, at: tuple[int, int, int, int], /) -> "Records1[RowT]": ...
    @overload
    def __getitem__(self, at: tuple[int, int, int, int, int], /) -> RowT: ...
    @overload
    def __getitem__(self, at: Selection, /) -> Self: ...
    @overload
    def __getitem__(self, at: str, /) -> NDArray[Any]: ...
    def __getitem__(self, at: Any, /) -> Any: ...
