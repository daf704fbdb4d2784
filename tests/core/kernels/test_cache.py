"""Compiled kernels lie in the user's cache or where the user may write, and always fit."""

import errno
import logging
import os
import shutil
import time
from pathlib import Path

import pytest

import hrc_env
from hrc_env.core.folders import temporary_cache
from hrc_env.core.kernels import cache, kernel

PACKAGE = Path(hrc_env.__file__).resolve().parent
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

    def asked(tree: Path, cache: str = "") -> bool:
        words = "-c", COMPILE.format(KERNEL)
        cache = cache or str(tree / "cache")
        done = process(
            *words, cwd=tree, NUMBA_CACHE_DIR=None, PYTHONPATH=str(tree), XDG_CACHE_HOME=cache
        )
        assert done.returncode == 0, done.stderr
        told = done.stdout.split()
        assert told[1] == "True"
        return told[0] == "True"

    return asked


def test_checkouts_of_equal_sources_share_what_is_compiled(tree, was_compiled, tmp_path):
    copy = tree.with_name("second")
    shutil.copytree(tree, copy)
    home = str(tmp_path / "home")
    assert not was_compiled(tree, home)
    assert was_compiled(copy, home)


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


def make_kernel(constant: float = 1.0):
    scope = {"kernel": kernel, "__name__": __name__, "C": constant}
    exec("@kernel\ndef grow(x):\n    return x + C", scope)
    return scope["grow"]


def test_the_forms_of_several_checkouts_lie_side_by_side(tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "folder", lambda: tmp_path)
    assert [make_kernel(constant)(1.0) for constant in (1.0, 2.0)] == [2.0, 3.0]
    assert len(list(tmp_path.glob("*grow*"))) == 2


def test_files_that_were_not_used_for_longest_are_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "folder", lambda: tmp_path)
    monkeypatch.setattr(cache, "MAX_BYTES", 2500)
    for days, name in ((3, "old"), (2, "used"), (1, "new")):
        (tmp_path / f"{name}{cache.SUFFIX}").write_bytes(bytes(1000))
        os.utime(tmp_path / f"{name}{cache.SUFFIX}", (time.time() - 86_400 * days,) * 2)
    (tmp_path / "not ours.txt").write_bytes(bytes(5000))
    cache._note_use(tmp_path / f"used{cache.SUFFIX}")
    cache._limit_size.cache_clear()
    cache._limit_size(tmp_path)
    assert {each.stem for each in tmp_path.iterdir()} == {"used", "new", "not ours"}


@pytest.mark.parametrize(
    ("setting", "usual", "other"),
    [
        ("NUMBA_BOUNDSCHECK", "0", "1"),
        ("NUMBA_DEBUGINFO", "0", "1"),
        ("NUMBA_CPU_NAME", None, "generic"),
    ],
)
def test_other_settings_and_processors_find_other_files(setting, usual, other, process, tmp_path):
    code = COMPILE.format(KERNEL)
    for value, was_there in ((usual, "False"), (other, "False"), (other, "True"), (usual, "True")):
        done = process("-c", code, NUMBA_CACHE_DIR=str(tmp_path), **{setting: value})
        assert done.stdout.split() == [was_there, "True"], done.stderr


@pytest.fixture
def unwritable(tmp_path) -> Path:
    """A path in a file, where nobody, root included, makes a folder."""
    (tmp_path / "file").touch()
    return tmp_path / "file"


@pytest.fixture
def find_folder(monkeypatch, tmp_path):
    """The folder of kernels for a user's cache in this place."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)

    def find(home: Path) -> Path:
        monkeypatch.setenv("XDG_CACHE_HOME", str(home))
        cache.folder.cache_clear()
        return cache.folder()

    yield find
    cache.folder.cache_clear()


def test_kernels_go_to_the_users_cache_or_where_files_can_be_written(
    find_folder, tmp_path, unwritable
):
    assert find_folder(tmp_path) == tmp_path / "hrc_env" / "kernels"
    assert find_folder(unwritable) == temporary_cache() / "kernels"


@pytest.mark.parametrize("place", ["distributed", "hrc_env/kernels"])
def test_kernels_in_a_folder_that_is_only_read_are_used(tmp_path, monkeypatch, place):
    """As in a wheel that contains them, or in a user's cache that cannot be written."""
    monkeypatch.setattr(cache, "DISTRIBUTED", tmp_path / "distributed")
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / place)
    assert make_kernel(5.0)(1.0) == 6.0
    (kept,) = (tmp_path / place).glob("*grow*")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "elsewhere")
    again = make_kernel(5.0)
    assert again(1.0) == 6.0
    assert sum(again.stats.cache_hits.values()) == 1
    assert kept.exists()
    assert not (tmp_path / "elsewhere").exists()


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EROFS])
def test_where_nothing_can_be_saved_kernels_work_and_a_warning_says_why(
    tmp_path, monkeypatch, caplog, error
):
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "kernels")

    def refuse(path, content):
        path.touch()
        raise OSError(error, os.strerror(error))

    monkeypatch.setattr(Path, "write_bytes", refuse)
    cache._warn_unsaved.cache_clear()
    with caplog.at_level(logging.WARNING):
        assert [make_kernel(constant)(1.0) for constant in (7.0, 8.0)] == [8.0, 9.0]
    assert caplog.text.count("cannot be saved") == 1
    assert os.strerror(error) in caplog.text
    assert not list(tmp_path.rglob("*.tmp"))


@pytest.mark.parametrize("damage", [
    lambda form: form[:100],
    lambda form: b"",
    lambda form: form[:-1],
    lambda form: form[:5000] + bytes([form[5000] ^ 1]) + form[5001:],
    lambda form: form[32:],
])  # fmt: skip
def test_a_damaged_file_is_compiled_anew(tmp_path, monkeypatch, damage):
    """Damaged code would end the process, or compute something else."""
    monkeypatch.setattr(cache, "folder", lambda: tmp_path)
    assert make_kernel(9.0)(1.0) == 10.0
    (kept,) = tmp_path.glob("*grow*")
    whole = kept.read_bytes()
    kept.write_bytes(damage(whole))
    again = make_kernel(9.0)
    assert again(1.0) == 10.0
    assert sum(again.stats.cache_hits.values()) == 0
    third = make_kernel(9.0)
    assert third(1.0) == 10.0
    assert sum(third.stats.cache_hits.values()) == 1


def test_a_damaged_file_of_a_distribution_is_replaced_in_the_users_cache(tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "DISTRIBUTED", tmp_path / "distributed")
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "distributed")
    assert make_kernel(11.0)(1.0) == 12.0
    (kept,) = (tmp_path / "distributed").glob("*grow*")
    kept.write_bytes(b"damaged")
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "own")
    assert make_kernel(11.0)(1.0) == 12.0
    assert kept.read_bytes() == b"damaged"
    again = make_kernel(11.0)
    assert again(1.0) == 12.0
    assert sum(again.stats.cache_hits.values()) == 1
