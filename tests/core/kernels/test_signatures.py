"""Types of arguments survive the file they are recorded in."""

import numpy as np
import pytest
from numba import typeof, types

from hrc_env.core.kernels import signatures
from hrc_env.tracking.settings import Settings


@pytest.mark.parametrize(
    "value",
    [
        1.0,
        2,
        True,
        np.zeros(3),
        np.zeros((2, 3), np.bool_)[:, ::2],
        (1.0, (2, np.zeros((1, 1), np.int64))),
        Settings(*([1.0] * len(Settings._fields))),
    ],
)
def test_a_type_survives_the_file(value):
    kind = typeof(value)
    assert signatures.decode(signatures.encode(kind)) == kind


def test_an_array_that_must_not_be_written_is_told_from_one_that_may():
    fixed = np.zeros(3)
    fixed.flags.writeable = False
    assert signatures.encode(typeof(fixed)) != signatures.encode(typeof(np.zeros(3)))
    assert signatures.decode(signatures.encode(typeof(fixed))) == typeof(fixed)


PAIR = np.dtype([("mean", "f8", (2, 3)), ("tracked", "?")], align=True)


def test_a_structured_array_is_recorded_by_the_name_of_its_dtype(monkeypatch):
    monkeypatch.setattr(signatures, "PAIR", PAIR, raising=False)
    pairs = np.zeros((4, 2), PAIR)
    assert signatures.encode(typeof(pairs)) == "hrc_env.core.kernels.signatures:PAIR[2C]"
    for kind in (typeof(pairs), typeof(pairs).dtype):
        assert signatures.decode(signatures.encode(kind)) == kind


def test_a_dtype_without_a_name_is_refused():
    with pytest.raises(TypeError, match="define its dtype as a named constant"):
        signatures.encode(typeof(np.zeros(1, [("a_dtype_of_nobody", "f8")])))


def test_a_type_that_cannot_be_recorded_is_named():
    with pytest.raises((TypeError, AttributeError), match=r"[Ss]et"):
        signatures.encode(types.Set(types.float64))


def test_every_recorded_kernel_is_there_with_types_that_numba_knows():
    recorded = signatures.recorded()
    assert {each.kernel for each in recorded} >= {"hrc_env.observations:_scale"}
    for each in recorded:
        assert len(each.types()) == len(each.args)
        assert signatures.kernel_named(each.kernel) is not None
