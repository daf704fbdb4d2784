"""What the experiments share: folders, parts, intervals and the page."""

import os

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.results import Metric, write_results, write_whole
from hrc_env.experiments.study import intervals
from hrc_env.experiments.study.folder import claim, owner_of
from hrc_env.experiments.study.page import Picture, Section, Table, said, write_report
from hrc_env.experiments.study.shelf import Shelf


def silent(share, label):
    """Say nothing."""


def test_a_folder_belongs_to_one_experiment(tmp_path):
    claim(tmp_path, "site")
    claim(tmp_path, "site")
    with pytest.raises(ConfigError, match=r"holds the results of 'site'.*--overwrite"):
        claim(tmp_path, "lab")
    claim(tmp_path, "lab", overwrite=True)
    assert owner_of(tmp_path) == "lab"


def test_a_benchmarks_results_are_not_overwritten(tmp_path):
    write_results(tmp_path / "results.json", {}, [0], {})
    with pytest.raises(ConfigError, match="another benchmark"):
        claim(tmp_path, "site")


def test_a_half_written_result_is_said_and_kept(tmp_path):
    (tmp_path / "results.json").write_text('{"config": ')
    with pytest.raises(ConfigError, match="unreadable"):
        claim(tmp_path, "site")
    assert (tmp_path / "results.json").exists()


def test_a_half_written_part_is_made_anew(tmp_path):
    shelf = Shelf(tmp_path, "code", 2, silent)
    shelf.part("one", lambda tick: {"x": 1})
    (tmp_path / "one.json").write_text('{"fingerp')
    assert shelf.part("one", lambda tick: {"x": 2}) == {"x": 2}
    assert shelf.part("one", lambda tick: {"x": 3}) == {"x": 2}


def test_parts_of_other_code_do_not_count(tmp_path):
    Shelf(tmp_path, "old", 1, silent).part("one", lambda tick: {"x": 1})
    assert not Shelf(tmp_path, "new", 1, silent).has("one")


def test_the_progress_of_parts_sums_to_one(tmp_path):
    shares: list[float] = []
    shelf = Shelf(tmp_path, "code", 3, lambda share, label: shares.append(share))
    shelf.part("quiet", lambda tick: {})
    shelf.part("ticking", lambda tick: [tick(0.25) for _ in range(3)] and {})
    shelf.part("quiet", lambda tick: {})
    assert sum(shares) == pytest.approx(1.0)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_full_disk_is_said_and_loses_nothing(tmp_path, monkeypatch):
    path = tmp_path / "results.json"
    write_whole(path, "before")
    (tmp_path / "results.json.draft").symlink_to("/dev/full")
    with pytest.raises(HRCError, match=r"No space left.*start the same command again"):
        write_whole(path, "after" * 100_000)
    assert path.read_text() == "before"


def test_intervals_hold_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(0)
    held = [
        interval.low <= 2.0 <= interval.high
        for interval in (intervals.mean_over(rng.normal(2, 1, 30), "m") for _ in range(60))
    ]
    assert 0.85 <= np.mean(held) <= 1.0


def test_one_seed_has_no_interval_and_says_so():
    one = intervals.rmse_over([4.0], [1.0], "m")
    assert (one.value, one.low, one.high, one.n) == (2.0, 2.0, 2.0, 1)


def test_ratios_of_paired_rows_are_narrower_than_of_strangers():
    rng = np.random.default_rng(1)
    hard = rng.uniform(1, 9, 40)
    paired = intervals.rmse_ratio_over(4 * hard, hard)
    strangers = intervals.rmse_ratio_over(4 * hard, rng.permutation(hard))
    assert paired.value == pytest.approx(2.0)
    assert paired.high - paired.low < 1e-9 < strangers.high - strangers.low


def test_a_ratio_to_nothing_in_some_draws_still_has_an_interval():
    found = intervals.ratio_over([1.0, 0.0, 2.0], [2.0, 0.0, 4.0], "share")
    assert (found.value, found.low, found.high) == (0.5, 0.5, 0.5)


def test_a_quantile_draws_whole_seeds():
    same = [[1.0, 2.0, 3.0]] * 5
    found = intervals.quantile_over(same, 0.5, "m")
    assert (found.value, found.low, found.high) == (2.0, 2.0, 2.0)


def test_the_page_holds_its_pictures_and_escapes_words(tmp_path):
    figure = tmp_path / "one.png"
    figure.write_bytes(b"not really a picture")
    table = Table(("who", "m"), (("a < b", said(Metric(0.1234, 0.1, 0.2, "m", 3), 100)),))
    parts = ("run `make`", table, Picture(figure, "seen"))
    write_report(tmp_path, "Title", "Lead", [Section("Heading", parts)])
    page = (tmp_path / "report.html").read_text()
    assert "data:image/png;base64," in page
    assert "a &lt; b" in page
    assert "12.3 <span class='whole'>(10.0-20.0)</span>" in page
    assert "<code>make</code>" in page
    assert "| a < b | 12.3 (10.0-20.0) |" in (tmp_path / "report.md").read_text()
