"""Records of arrays: copies with other fields, and arrays with fewer axes."""

from dataclasses import FrozenInstanceError, dataclass

import numpy as np
import pytest

from hrc_env.core.batching import change_fields, flatten_axes


@dataclass(frozen=True, slots=True)
class Pair:
    a: np.ndarray
    b: int = 0

    def __post_init__(self) -> None:
        if self.b < 0:
            raise ValueError("checked")


def test_a_changed_copy_shares_the_other_fields_and_is_as_frozen():
    pair = Pair(np.arange(3))
    changed = change_fields(pair, b=-1)  # values are not checked
    assert changed.a is pair.a
    assert (pair.b, changed.b) == (0, -1)
    with pytest.raises(FrozenInstanceError):
        changed.b = 2  # type: ignore[misc]
    with pytest.raises(TypeError, match="Pair has no field 'c', but a, b"):
        change_fields(pair, c=1)


@pytest.mark.parametrize("array", [np.zeros((2, 0, 3)), np.arange(24.0).reshape(2, 3, 4)[:, ::2]])
def test_flat_arrays_are_contiguous(array):
    flat = flatten_axes(array, 1)
    assert flat.shape == (array.shape[0] * array.shape[1], array.shape[2])
    assert flat.flags.c_contiguous
    np.testing.assert_array_equal(flat, array.reshape(-1, array.shape[2]))
