"""Attribute access to the fields of structured arrays in Python, as in compiled kernels."""

from collections.abc import Callable
from operator import itemgetter
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.core.declared import dtype_of

RowType = TypeVar("RowType", bound=type[np.void])


def with_fields(declaration: type) -> Callable[[RowType], RowType]:
    """Return a class decorator that adds an attribute for each field of a declaration.

    Access to such an attribute takes a third of the time that it takes with `numpy.record`.
    """

    def add_fields(row: RowType) -> RowType:
        for name in dtype_of(declaration).names or ():
            setattr(row, name, property(itemgetter(name), _make_setter(name)))
        return row

    return add_fields


def _make_setter(name: str) -> Callable[[np.void, ArrayLike], None]:
    """Return a function that sets a field of a row."""

    def set_field(row: np.void, value: ArrayLike) -> None:
        row[name] = value

    return set_field
