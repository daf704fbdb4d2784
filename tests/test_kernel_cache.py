"""Compiled kernels never outlive a change of any source."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from hrc_env.kernel_cache import forget_stale

CALLER = """
import numba
from callee import add
@numba.njit(cache=True)
def twice(x):
    return 2 * add(x)
print(twice(1))
"""
CALLEE = """
import numba
@numba.njit(cache=True)
def add(x):
    return x + {}
"""


@pytest.fixture(params=["beside the sources", "NUMBA_CACHE_DIR"])
def package(request, tmp_path, monkeypatch) -> Path:
    """Two files, one kernel of which is built into the other's."""
    if request.param == "NUMBA_CACHE_DIR":
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    else:
        monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "caller.py").write_text(CALLER)
    (folder / "callee.py").write_text(CALLEE.format(1))
    return folder


def answer(package: Path) -> int:
    run = subprocess.run(
        [sys.executable, "caller.py"], cwd=package, env=os.environ, check=True, capture_output=True
    )
    return int(run.stdout)


def test_a_kernel_is_compiled_anew_when_one_that_it_calls_has_changed(package):
    forget_stale(package)
    assert answer(package) == 4
    (package / "callee.py").write_text(CALLEE.format(20))
    assert answer(package) == 4  # numba alone does not see it
    assert forget_stale(package)
    assert answer(package) == 42


def test_kernels_stay_while_nothing_changes(package):
    forget_stale(package)
    answer(package)
    kept = sorted(package.parent.rglob("*.nb[ic]"))
    assert not forget_stale(package)
    assert kept
    assert sorted(package.parent.rglob("*.nb[ic]")) == kept
