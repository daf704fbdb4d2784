"""Compiled kernels lie beside the package or where the user may write, and always fit."""

import shutil
from pathlib import Path

import pytest

from hrc_env.core.kernels import cache

PACKAGE = cache.PACKAGE
KERNEL = "hrc_env.observations:_scale"
COMPILE = """
import numpy as np
from hrc_env.core.kernels.signatures import kernel_named, recorded
(each,) = [each for each in recorded() if each.kernel == {0!r}]
was_there = each.is_compiled()
kernel_named({0!r}).compile(each.types())
print(was_there, each.is_compiled())
"""


@pytest.fixture
def tree(tmp_path) -> Path:
    """A copy of the package in which nothing is compiled."""
    copy = tmp_path / "first"
    shutil.copytree(PACKAGE, copy / "hrc_env", ignore=shutil.ignore_patterns("__pycache__"))
    return copy


@pytest.fixture
def was_compiled(process):
    """Whether a tree's kernel lay on disk; it does from then on."""

    def asked(tree: Path) -> bool:
        words = "-c", COMPILE.format(KERNEL)
        cache = str(tree / "cache")
        done = process(
            *words, cwd=tree, NUMBA_CACHE_DIR=None, PYTHONPATH=str(tree), XDG_CACHE_HOME=cache
        )
        assert done.returncode == 0, done.stderr
        told = done.stdout.split()
        assert told[1] == "True"
        return told[0] == "True"

    return asked


def test_a_copied_and_edited_tree_keeps_the_kernels_that_still_fit(tree, was_compiled):
    assert not was_compiled(tree)
    copy = tree.with_name("second")
    shutil.copytree(tree, copy, copy_function=shutil.copy)  # with times of its own
    edit(copy / "hrc_env/core/errors.py", "class HRCError", "# a comment\n\n\nclass HRCError")
    assert was_compiled(copy)
    edit(copy / "hrc_env/observations.py", "/ scale[i]", "* (1.0 / scale[i])")
    assert not was_compiled(copy)


def edit(path: Path, before: str, after: str) -> None:
    source = path.read_text()
    assert source.count(before) == 1
    path.write_text(source.replace(before, after))


@pytest.mark.parametrize(("chosen", "n_kept"), [("", 1), ("a folder of several checkouts", 2)])
def test_an_older_form_of_a_kernel_goes_but_from_a_chosen_folder(
    tmp_path, monkeypatch, chosen, n_kept
):
    from hrc_env.core.kernels import kernel

    monkeypatch.setenv("NUMBA_CACHE_DIR", chosen)
    monkeypatch.setattr(cache, "folder", lambda: tmp_path)
    for constant in (1.0, 2.0):
        scope = {"kernel": kernel, "__name__": __name__, "C": constant}
        exec("@kernel\ndef grow(x):\n    return x + C", scope)
        assert scope["grow"](1.0) == 1.0 + constant
    assert len(list(tmp_path.glob("*grow*"))) == n_kept


def test_where_the_package_cannot_be_written_kernels_go_to_the_users_cache(tmp_path, monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    file = tmp_path / "file"
    file.touch()  # nobody, root included, makes a folder in a file
    monkeypatch.setattr(cache, "PACKAGE", file / "hrc_env")
    cache.folder.cache_clear()
    try:
        assert cache.folder().parent == tmp_path / "home" / "hrc_env"
    finally:
        cache.folder.cache_clear()


def test_where_nothing_can_be_written_kernels_work_all_the_same(tmp_path, monkeypatch):
    from hrc_env.core.kernels import kernel

    file = tmp_path / "file"
    file.touch()
    monkeypatch.setattr(cache, "folder", lambda: file / "kernels")
    assert kernel(lambda x: x + 1.0)(1.0) == 2.0


def test_a_damaged_file_is_compiled_anew(tmp_path, monkeypatch):
    from hrc_env.core.kernels import kernel

    monkeypatch.setattr(cache, "folder", lambda: tmp_path)
    source = "@kernel\ndef grow(x):\n    return x + 1.0"
    for _ in range(2):
        scope = {"kernel": kernel, "__name__": __name__}
        exec(source, scope)
        assert scope["grow"](1.0) == 2.0
        (kept,) = tmp_path.glob("*grow*")
        kept.write_bytes(kept.read_bytes()[:100])
