"""What commands find out before they begin."""

from pathlib import Path

import pytest

from hrc_env.cli.checks import check_at_least, check_writable_file, check_writable_folder
from hrc_env.core.errors import ConfigError, HRCError


def test_a_number_below_the_least_is_named_with_what_would_do():
    with pytest.raises(ConfigError, match=r"--steps must be 1 or more, got -5\."):
        check_at_least("--steps", -5, 1)
    for strange in (float("nan"), float("inf")):
        with pytest.raises(ConfigError, match="--weight"):
            check_at_least("--weight", strange, 0)
    check_at_least("--steps", 1, 1)
    check_at_least("--steps", None, 1)


def test_a_place_that_can_be_written_is_left_as_it_is(tmp_path: Path):
    check_writable_folder(tmp_path / "a" / "b")
    check_writable_file(tmp_path / "a" / "film.mp4", ".mp4")
    assert list(tmp_path.iterdir()) == []


def test_what_is_there_may_be_replaced(tmp_path: Path):
    film = tmp_path / "film.mp4"
    film.write_text("old")
    check_writable_file(film, ".mp4")
    check_writable_folder(tmp_path)
    assert film.read_text() == "old"


@pytest.mark.parametrize("below", ["", "deeper/still"])
def test_a_file_where_a_folder_is_needed_is_refused(tmp_path: Path, below: str):
    (tmp_path / "notes").write_text("")
    with pytest.raises(HRCError, match=r"cannot be written .*Choose another path with --out\."):
        check_writable_folder(tmp_path / "notes" / below)


def test_a_folder_where_a_file_is_needed_and_another_ending_are_refused(tmp_path: Path):
    (tmp_path / "film.mp4").mkdir()
    with pytest.raises(HRCError, match=r"it is a folder.*--video"):
        check_writable_file(tmp_path / "film.mp4", ".mp4", "--video")
    with pytest.raises(ConfigError, match=r"--out must end in \.mp4, got 'film\.gif'"):
        check_writable_file(tmp_path / "film.gif", ".mp4")


def test_a_folder_that_lets_nobody_write_is_refused():
    """/proc lets not even root."""
    with pytest.raises(HRCError, match=r"/proc/hrc_env cannot be written \(/proc: "):
        check_writable_folder(Path("/proc/hrc_env"))
