"""On a numba that the lean compiler was not tested with, numba's own compiles the kernels."""

import warnings

import numpy as np
import pytest

import hrc_env.core.kernels as kernels
from hrc_env.core.kernels.plain import PlainDispatcher


@pytest.fixture
def plain(tmp_path, monkeypatch):
    """The decorator, as with such a numba; a folder of its own for what is compiled."""
    monkeypatch.setattr("hrc_env.core.kernels.cache.folder", lambda: tmp_path)
    monkeypatch.setattr(kernels, "DISPATCHER", PlainDispatcher)
    return kernels.kernel


def test_a_release_that_was_not_tested_gets_numbas_own_compiler_and_one_warning():
    with pytest.warns(UserWarning, match=r"not tested with numba 0\.99\.1, but with") as said:
        assert kernels.dispatcher("0.99.1") is PlainDispatcher
    assert len(said) == 1


def test_a_release_that_was_tested_gets_the_lean_one_and_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = kernels.dispatcher(f"{kernels.LEAN_WITH[0]}.7")
    assert found.__name__ == "KernelDispatcher"


def test_plain_kernels_call_each_other(plain):
    scope = {"kernel": plain, "np": np, "__name__": __name__}
    exec("@kernel\ndef half(x):\n    return 0.5 * x", scope)
    exec(
        "@kernel(makes_arrays=True)\ndef halves(rows):\n"
        "    return np.array([half(row) for row in rows])",
        scope,
    )
    assert scope["halves"](np.arange(3.0)) == pytest.approx([0.0, 0.5, 1.0])


def test_a_plain_kernel_is_found_on_disk_by_the_next_process(plain, monkeypatch):
    source = "@kernel\ndef grow(x):\n    return x + 1.0"
    for can_compile in (True, False):
        scope = {"kernel": plain, "__name__": __name__}
        exec(source, scope)
        if not can_compile:
            monkeypatch.setattr(scope["grow"]._compiler, "compile", None)
        assert scope["grow"](1.0) == 2.0
