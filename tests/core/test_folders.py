"""Where files are kept between runs: the user's caches, or a folder of their own elsewhere."""

import stat
import tempfile

import pytest

from hrc_env.core import folders


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """Temporary files of this machine lie here."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    folders.temporary_cache.cache_clear()
    yield tmp_path / "tmp"
    folders.temporary_cache.cache_clear()


def test_caches_that_can_be_written_are_used(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "caches"))
    assert folders.user_cache() == tmp_path / "caches" / "hrc_env"


def test_a_home_that_cannot_be_written_gives_a_private_temporary_folder(
    tmp_path, monkeypatch, elsewhere
):
    file = tmp_path / "file"
    file.touch()  # nobody, root included, makes a folder in a file
    monkeypatch.setenv("XDG_CACHE_HOME", str(file))
    folder = folders.user_cache()
    assert folder.parent == elsewhere
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert folders.user_cache() == folder


def test_without_a_home_there_is_a_folder_all_the_same(monkeypatch, elsewhere):
    def homeless(_):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr("pathlib.Path.expanduser", homeless)
    assert folders.usual_cache() is None
    assert folders.user_cache().parent == elsewhere


def test_a_folder_that_others_may_write_is_not_used(elsewhere):
    taken = folders.temporary_cache()
    folders.temporary_cache.cache_clear()
    taken.chmod(0o777)
    assert folders.temporary_cache() != taken
    assert folders.can_write(folders.temporary_cache())


def test_who_comes_second_waits_for_the_lock(tmp_path, process):
    code = f"""
import pathlib
from hrc_env.core.folders import alone
with alone(pathlib.Path({str(tmp_path)!r}), lambda: print("waits", flush=True) or exit()):
    print("holds")
"""
    with folders.alone(tmp_path, lambda: pytest.fail("nobody was before")):
        where = str(tempfile.gettempdir())
        assert process("-c", code, TMPDIR=where).stdout == "waits\n"
    assert process("-c", code, TMPDIR=where).stdout == "holds\n"
    assert list(tmp_path.iterdir()) == [tmp_path / "tmp"]
