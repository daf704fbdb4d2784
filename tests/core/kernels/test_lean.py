"""Kernels give what Python gives; callees are part of them; others' functions are left alone."""

import gc
import platform

import llvmlite.binding
import numba
import numpy as np
import pytest
from numba.core import registry
from numba.core.codegen import JITCodeLibrary

from hrc_env.core.kernels import DISPATCHER, kernel, lean
from hrc_env.core.kernels.lean import KernelDispatcher, LeanLibrary

pytestmark = pytest.mark.skipif(
    DISPATCHER is not KernelDispatcher, reason="not tested: a numba that lean was not tested with"
)


@kernel
def scaled(row, factor):
    total = 0.0
    for k in range(len(row)):
        row[k] *= factor
        total += row[k]
    if total < 0.0:
        raise ValueError("the sum must not be negative")
    return total


@kernel(makes_arrays=True)
def with_ones(n, width=2):
    return np.ones((n, width))


@kernel(makes_arrays=True)
def sums(rows, factor):
    ones = with_ones(len(rows), width=1)
    return np.array([scaled(rows[k], factor) for k in range(len(rows))]) + ones[:, 0]


@pytest.fixture(autouse=True)
def nothing_kept(tmp_path, monkeypatch):
    """A folder of its own for what is compiled here."""
    monkeypatch.setattr("hrc_env.core.kernels.cache.folder", lambda: tmp_path)


def test_a_kernel_that_calls_others_gives_what_python_gives():
    rows = np.arange(12.0).reshape(3, 4)
    expected = rows.sum(axis=1) * 0.5 + 1.0
    assert sums(rows, 0.5) == pytest.approx(expected)
    assert rows[2] == pytest.approx([4.0, 4.5, 5.0, 5.5])


def test_an_error_in_a_callee_reaches_python():
    with pytest.raises(ValueError, match="must not be negative"):
        sums(-np.ones((2, 3)), 1.0)


def test_a_callee_is_compiled_only_within_its_caller():
    sums(np.ones((2, 3)), 1.0)
    assert scaled.overloads == {}
    (callee,) = scaled.callee.overloads.values()
    assert isinstance(callee.library, LeanLibrary)
    assert callee.library._is_callee
    assert len(scaled.callee.signatures) == 1


def test_what_a_kernel_gives_does_not_depend_on_what_python_called_before():
    def fresh():
        inner = kernel(lambda x, y: x * y + y)
        scope = {"inner": inner, "__name__": __name__}
        exec("def outer(x, y):\n    return inner(x, y) / 3.0 + inner(y, x)", scope)
        return inner, kernel(scope["outer"])

    _, alone = fresh()
    inner, after = fresh()
    assert inner(0.1, 0.7) == pytest.approx(0.77)
    pairs = np.random.default_rng(0).normal(size=(100, 2))
    assert [alone(*each) for each in pairs] == [after(*each) for each in pairs]


def test_functions_that_others_compile_with_numba_are_compiled_as_ever():
    @numba.njit
    def theirs(x):
        return 2.0 * x

    assert theirs(2.0) == 4.0
    (compiled,) = theirs.overloads.values()
    assert type(compiled.library) is JITCodeLibrary


HOLDER = np.dtype([("inside", float, (2, 3))])


@kernel
def add_entry(values, k):
    return values[0, k] + k


@kernel
def call_with_constants(records, values, k):
    inside = records[0].inside
    return add_entry(values, 0) + add_entry(values, 1) + add_entry(values, k) + add_entry(inside, 2)


def test_a_callee_is_compiled_once_for_constants_and_arrays_in_records():
    records, values = np.zeros(1, HOLDER), np.arange(6.0).reshape(2, 3)
    records["inside"] = 10.0
    assert call_with_constants(records, values, 2) == 0.0 + 2.0 + 4.0 + 12.0
    assert len(add_entry.callee.signatures) == 1


@kernel(makes_arrays=True)
def write_rows(target, source):
    target[1:] = source


def test_arrays_that_do_not_fit_into_a_slice_are_refused():
    target = np.zeros((3, 2))
    write_rows(target, np.ones((2, 2)))
    write_rows(target, np.full((1, 2), 5.0))
    np.testing.assert_array_equal(target, [[0, 0], [5, 5], [5, 5]])
    with pytest.raises(ValueError, match="cannot assign slice from input of different size"):
        write_rows(target, np.ones((3, 2)))


def test_garbage_is_collected_as_usual_after_a_compilation():
    before = gc.get_threshold()
    with pytest.raises(numba.TypingError):
        kernel(lambda x: x.no_such_attribute)(1.0)
    assert gc.get_threshold() == before


SHOW_PROCESSOR = """
from hrc_env.core.kernels.lean import _lean_context
print(_lean_context().codegen().magic_tuple())
"""


def test_kernels_are_for_all_processors_of_a_level_unless_numba_has_one_set(process):
    usual = process("-c", SHOW_PROCESSOR)
    assert usual.returncode == 0, usual.stderr
    available = llvmlite.binding.get_host_cpu_features()
    if platform.machine() == "x86_64" and available["avx2"]:
        assert "'x86-64-v3', ''" in usual.stdout
    chosen = process("-c", SHOW_PROCESSOR, NUMBA_CPU_NAME="generic")
    assert "'generic', ''" in chosen.stdout
    assert "-avx" in process("-c", SHOW_PROCESSOR, NUMBA_ENABLE_AVX="0").stdout


@pytest.mark.parametrize("left_out", ["avx2", "fma", "bmi2", "lzcnt"])
def test_a_processor_without_a_feature_of_the_level_gets_code_of_its_own(monkeypatch, left_out):
    usual = registry.cpu_target.target_context.codegen()
    features = dict.fromkeys(lean.PORTABLE_FEATURES, True)
    monkeypatch.setattr(llvmlite.binding, "get_host_cpu_features", lambda: features)
    if usual.magic_tuple()[0].startswith("x86_64"):
        assert isinstance(lean._make_generator(usual), lean.PortableCodegen)
    features[left_out] = False
    assert lean._make_generator(usual).magic_tuple() == usual.magic_tuple()
