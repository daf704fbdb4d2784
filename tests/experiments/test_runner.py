"""What the experiments share: folders, parts, intervals and the page."""

import json
import os
from dataclasses import asdict, dataclass, replace

import numpy as np
import pytest
from PIL import Image
from scipy import stats

from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.results import Metric, write_results, write_whole
from hrc_env.evaluation import intervals
from hrc_env.evaluation.counts import ERRORS_M
from hrc_env.experiments import plots, report, runner
from hrc_env.experiments.cache import PartCache, claim_folder, read_owner, release_folder
from hrc_env.experiments.columns import Column

PLAYED = []
"""What was played of `Counting`."""


@dataclass(frozen=True)
class Counting:
    """An experiment of one part."""

    n: int
    name = "count"
    depends = ("env",)
    seeds = (0,)
    n_parts = 1

    def settings(self):
        return asdict(self)

    def play(self, cache):
        return cache.make_part("one", lambda tick: PLAYED.append(self.n) or {"x": self.n})

    def metrics(self, played):
        return {"x": Metric(played["x"], played["x"], played["x"], "1", 1)}

    def report(self, played, metrics, figures):
        return report.Report("Counted", "How many?", ())


def silent(share, label):
    """Say nothing."""


def test_a_folder_belongs_to_one_experiment(tmp_path):
    claim_folder(tmp_path, "site")
    claim_folder(tmp_path, "site")
    with pytest.raises(ConfigError, match=r"holds the results of 'site'.*--overwrite"):
        claim_folder(tmp_path, "lab")
    claim_folder(tmp_path, "lab", overwrite=True)
    assert read_owner(tmp_path) == "lab"


def test_a_benchmarks_results_are_not_overwritten(tmp_path):
    write_results(tmp_path / "results.json", {}, [0], {})
    with pytest.raises(ConfigError, match="another benchmark"):
        claim_folder(tmp_path, "site")


def test_a_half_written_result_is_said_and_kept(tmp_path):
    (tmp_path / "results.json").write_text('{"config": ')
    with pytest.raises(ConfigError, match="unreadable"):
        claim_folder(tmp_path, "site")
    assert (tmp_path / "results.json").exists()


def test_a_half_written_part_is_made_anew(tmp_path):
    cache = PartCache(tmp_path, "code", 2, silent)
    cache.make_part("one", lambda tick: {"x": 1})
    (tmp_path / "one.json").write_text('{"ke')
    assert cache.make_part("one", lambda tick: {"x": 2}) == {"x": 2}
    assert cache.make_part("one", lambda tick: {"x": 3}) == {"x": 2}


def test_parts_of_another_key_do_not_count(tmp_path):
    PartCache(tmp_path, "old", 1, silent).make_part("one", lambda tick: {"x": 1})
    cache = PartCache(tmp_path, "new", 1, silent)
    assert cache.make_part("one", lambda tick: {"x": 2}) == {"x": 2}
    assert cache.make_part("one", lambda tick: {"x": 3}, key="other") == {"x": 3}


def test_the_progress_of_parts_sums_to_one(tmp_path):
    shares: list[float] = []
    cache = PartCache(tmp_path, "code", 3, lambda share, label: shares.append(share))
    cache.make_part("quiet", lambda tick: {})
    cache.make_part("ticking", lambda tick: [tick(0.25) for _ in range(3)] and {})
    cache.make_part("quiet", lambda tick: {})
    assert sum(shares) == pytest.approx(1.0)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_full_disk_is_said_and_loses_nothing(tmp_path, monkeypatch):
    path = tmp_path / "results.json"
    write_whole(path, "before")
    (tmp_path / "results.json.draft").symlink_to("/dev/full")
    with pytest.raises(HRCError, match=r"No space left.*start the same command again"):
        write_whole(path, "after" * 100_000)
    assert path.read_text() == "before"


def test_a_rate_of_what_never_happened_says_how_often_it_may():
    none, some = (intervals.estimate_rate([k] * 50, 0.05, "per 1000") for k in (0, 1))
    assert (none.value, none.low) == (0.0, 0.0)
    assert none.high == pytest.approx(-np.log(0.025) / 0.05)
    assert (some.value, some.n) == (1000.0, 50)
    assert (some.low, some.high) == pytest.approx((742.2, 1318.4), abs=0.1)  # tables: 37.11, 65.92


@pytest.mark.parametrize(
    ("count", "low", "high"),  # Garwood's table
    [(0, 0.0, 3.6889), (1, 0.0253, 5.5716), (2, 0.2422, 7.2247), (10, 4.7954, 18.3904)],
)
def test_a_rate_has_the_exact_interval_of_a_poisson_count(count, low, high):
    found = intervals.estimate_rate([0, count], [1.0, 1.0], "1/h")
    assert (2 * found.value, 2 * found.low, 2 * found.high) == pytest.approx(
        (count, low, high), abs=1e-4
    )


def test_a_rate_in_no_time_is_not_known():
    assert np.isnan(intervals.estimate_rate([0.0], 0.0, "1/h").value)


@pytest.mark.parametrize(("k", "n"), [(0, 1), (0, 64), (3, 10), (64, 64)])
def test_a_share_has_the_exact_interval_of_a_binomial_count(k, n):
    found = intervals.estimate_share([True] * k + [False] * (n - k))
    exact = stats.binomtest(k, n).proportion_ci(0.95, method="exact")
    assert (found.value, found.low, found.high, found.n) == (k / n, exact.low, exact.high, n)


def test_what_always_succeeded_may_fail_as_often_as_seeds_allow():
    found = intervals.estimate_clustered_share([3.0] * 64, [3.0] * 64)
    assert (found.value, found.high, found.n) == (1.0, 1.0, 64)
    assert found.low == pytest.approx(0.025 ** (1 / 64))
    mixed = intervals.estimate_clustered_share([3.0, 1.0], [3.0, 3.0])
    assert mixed.value == 2 / 3
    assert np.isnan([mixed.low, mixed.high]).all()  # two seeds


def test_goals_that_were_never_reached_have_a_bound():
    none, some = (intervals.estimate_goal_rate([k] * 30, [1.0] * 30) for k in (0.0, 5.0))
    assert none.high == pytest.approx(3.6889 / 30, abs=1e-4)
    assert some == intervals.estimate_rate([5.0] * 30, [1.0] * 30, "1/min")  # not without a width


def test_one_rate_less_another_has_a_width_also_where_both_are_zero():
    zero, five = (intervals.estimate_rate([k], 15.0, "1/min") for k in (0, 5))
    same, more = intervals.subtract_rates(zero, zero), intervals.subtract_rates(five, zero)
    assert (same.value, -same.low) == (0.0, same.high)
    assert same.high == pytest.approx(3.6889 / 15, abs=1e-4)
    assert more.low < 0.0 < more.value  # five against none is no difference yet: p = 1/16
    assert more.high == pytest.approx(five.high)


@pytest.mark.parametrize("exposure", [1.0, 0.64])
def test_a_zero_of_a_count_is_shown_with_its_bound(exposure):
    zero = intervals.estimate_rate([0] * 64, exposure, "1/h")
    assert report.format_metric(zero) == f"0.0 (0.0 to {3.6889 / exposure:.1f})"
    assert not report.format_metric(intervals.subtract_rates(zero, zero), signed=True).endswith(
        "+0.0"
    )


def test_an_interval_without_a_visible_width_is_not_shown():
    assert report.format_interval(1.0, 0.999, 1.001, 2) == "1.00"
    assert report.format_interval(-1e-9, -1.0, 1.0, 1, "+") == "+0.0 (-1.0 to +1.0)"


def test_intervals_hold_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(0)
    held = [
        interval.low <= 2.0 <= interval.high
        for interval in (intervals.estimate_mean(rng.normal(2, 1, 30), "m") for _ in range(60))
    ]
    assert 0.85 <= np.mean(held) <= 1.0


def test_one_seed_has_no_interval_and_says_so():
    one = intervals.estimate_rmse([4.0], [1.0], "m")
    assert (one.value, one.n) == (2.0, 1)
    assert np.isnan([one.low, one.high]).all()


def test_ratios_of_paired_rows_are_narrower_than_of_strangers():
    rng = np.random.default_rng(1)
    hard = rng.uniform(1, 9, 40)
    paired = intervals.estimate_rmse(4 * hard, hard, "ratio")
    strangers = intervals.estimate_rmse(4 * hard, rng.permutation(hard), "ratio")
    assert paired.value == pytest.approx(2.0)
    assert paired.high - paired.low < 1e-9 < strangers.high - strangers.low


def test_a_ratio_to_nothing_in_some_draws_still_has_an_interval():
    found = intervals.estimate_ratio([1.0, 0.0, 2.0] * 3, [2.0, 0.0, 4.0] * 3, "share")
    assert (found.value, found.low, found.high) == (0.5, 0.5, 0.5)


def test_a_quantile_draws_whole_seeds():
    same = [[1.0, 2.0, 3.0]] * 8
    found = intervals.estimate_quantile(same, 0.5, "m")
    assert (found.value, found.low, found.high) == (2.0, 2.0, 2.0)


def test_pairs_tell_a_difference_that_strangers_do_not():
    rng = np.random.default_rng(1)
    walks = rng.uniform(1, 9, 20)
    ours, theirs = walks, walks + rng.uniform(0.0, 0.4, 20)
    mean = intervals.make_ratio([*ours, *theirs], np.ones(40))
    found = intervals.compare_paired("head", mean, 20, "m")
    assert found["difference.head"].value == pytest.approx((ours - theirs).mean())
    assert found["difference.head"].high < 0
    assert found["p.head"].value < 0.001
    assert intervals.estimate_mean(ours, "m").low < intervals.estimate_mean(theirs, "m").value


def test_the_test_of_pairs_is_wrong_as_often_as_it_says():
    rng = np.random.default_rng(2)
    p = []
    for _ in range(200):
        squares = rng.exponential(1.0, 24)
        rmse = intervals.make_rmse(squares, np.ones(24))
        p.append(intervals.compare_paired("x", rmse, 12, "m", 400)["p.x"].value)
    assert 0.02 <= np.mean(np.array(p) <= 0.05) <= 0.09
    assert 0.4 <= np.mean(np.array(p) <= 0.5) <= 0.6


@pytest.mark.parametrize("of", ["ratio", "rmse", "quantile", "counted"])
def test_a_row_does_not_differ_from_itself(of):
    values = np.random.default_rng(3).uniform(0.1, 2.0, (8, 5))
    both = [*values, *values]
    statistic = {
        "ratio": lambda: intervals.make_ratio(np.sum(both, 1), np.full(16, 5)),
        "rmse": lambda: intervals.make_rmse(np.sum(both, 1), np.full(16, 5)),
        "quantile": lambda: intervals.make_quantile(both, 0.5),
        "counted": lambda: intervals.make_binned_quantile(ERRORS_M, ERRORS_M.count(np.array(both)),
                                                         0.5),
    }[of]()  # fmt: skip
    found = intervals.compare_paired("x", statistic, 8, "m", 200)
    off = found["difference.x"]
    assert (off.value, off.low, off.high) == (0.0, 0.0, 0.0)
    assert found["p.x"].value == 1.0


def test_a_report_holds_its_pictures_its_origin_and_all_numbers(tmp_path):
    figure = tmp_path / "figures" / "one.png"
    figure.parent.mkdir()
    figure.write_bytes(b"not really a picture")
    metrics = {"m.a": Metric(0.1234, 0.1, 0.2, "m", 3), "d.a": Metric(-0.5, -0.7, -0.1, "m", 3),
               "p_holm.d.a": Metric(0.01, 0.01, 0.01, "p", 4)}  # fmt: skip
    columns = (Column("m.{}", "cm", scale=100), Column("d.{}", "less", signed=True),
               Column("x.{}", "not measured"))  # fmt: skip
    table = report.format_metrics("who", {"a": "a < b"}, columns, metrics)
    asked = "run `make`"
    page = report.Report("Title", asked, ("## Found", table, report.format_picture(figure, "seen")))
    page.write(tmp_path, {"n": 1}, [3, 4], metrics)
    html, text = ((tmp_path / f"report.{kind}").read_text() for kind in ("html", "md"))
    assert 'src="data:image/png;base64,' in html
    assert "a &lt; b" in html
    assert "<code>make</code>" in html
    assert "| a < b | 12.3 (10.0 to 20.0) | -0.5 (-0.7 to -0.1) ● | - |" in text
    assert "seeds 3 to 4" in text
    assert set(json.loads((tmp_path / "results.json").read_text())["metrics"]) == set(metrics)


def test_an_experiment_plays_each_part_once_and_again_with_other_settings(tmp_path):
    for n in (1, 1, 2):
        found = runner.run_experiment(Counting(n), str(tmp_path), overwrite=n == 2)
        assert found["x"].value == n
    assert PLAYED == [1, 2]
    assert runner.override(Counting(1), n=None) == Counting(1)
    with pytest.raises(ConfigError, match="n must be at least 1, got 0"):
        runner.check_at_least_one(Counting(0), "n")


@pytest.mark.parametrize("left", ["experiment.json", "results.json"])
def test_results_with_other_settings_are_refused_and_stay(tmp_path, left):
    runner.run_experiment(Counting(1), tmp_path)
    for name in {"experiment.json", "results.json"} - {left}:
        (tmp_path / name).unlink()
    if left == "results.json":  # as earlier versions wrote the other one
        (tmp_path / "experiment.json").write_text('{"experiment": "count"}')
    before = {each: each.read_bytes() for each in tmp_path.iterdir() if each.is_file()}
    with pytest.raises(ConfigError, match=r"other settings: n is 1 there and 2 here.*--overwrite"):
        runner.run_experiment(Counting(2), tmp_path)
    assert before == {each: each.read_bytes() for each in tmp_path.iterdir() if each.is_file()}
    assert runner.run_experiment(Counting(1), tmp_path)["x"].value == 1
    assert runner.run_experiment(Counting(2), tmp_path, overwrite=True)["x"].value == 2
    with pytest.raises(ConfigError, match="n is 2 there and 1 here"):
        claim_folder(tmp_path, "count", settings={"n": 1})
    release_folder(tmp_path)
    claim_folder(tmp_path, "count", settings={"n": 1})


def test_differences_of_settings_are_named_and_those_of_code_are_none(tmp_path):
    def settings(**row):
        return {"rows": {"a": {"source": "f0", **row}}, "setups": ("x", "y")}

    claim_folder(tmp_path, "s", settings=settings(n=1))
    claim_folder(tmp_path, "s", settings=settings(n=1, source="f1", estimator_source="9"))
    with pytest.raises(ConfigError) as refused:
        claim_folder(tmp_path, "s", settings=settings(n=2, b=1, c=2, d=3))
    assert "rows.a.n is 1 there and 2 here; rows.a.b is" in str(refused.value)
    assert "and 1 more" in str(refused.value)


def test_a_quick_report_says_so_at_every_table_and_figure_and_marks_nothing(tmp_path):
    p = Metric(0.001, 0.001, 0.001, "p", 1)
    metrics = {"d.a": Metric(2.0, 1.0, 3.0, "m", 9), "p_holm.d.a": p}
    column = Column("d.{}", "less [m]", signed=True)
    figure = plots.make_figure(3, 2)
    plots.save(figure, tmp_path / "figures" / "one.png")
    before = Image.open(tmp_path / "figures" / "one.png").size
    parts = ["## Heading", report.format_picture(tmp_path / "figures" / "one.png", "Picture."),
             report.format_metrics("row", {"a": "A"}, [column], metrics)]  # fmt: skip
    whole = report.Report("Title", "Asked.", parts)
    whole.write(tmp_path, {}, [0], metrics)
    assert "●" in (tmp_path / "report.md").read_text()
    quick = replace(whole, quick=report.describe_quick_run(4, 10.0))
    quick.write(tmp_path, {}, [0], metrics)
    text = (tmp_path / "report.md").read_text()
    assert text.count("Quick run, 4 seeds of 10 s: too few seeds for intervals and") == 3
    assert "●" not in text
    after = Image.open(tmp_path / "figures" / "one.png").size
    assert after[0] == before[0]
    assert after[1] > before[1]  # a strip with the words


def test_seeds_of_a_quick_run_are_counted_in_words():
    one = report.describe_quick_run(1, (2.0, 7.25), "round")
    assert one == "Quick run, 1 round of 2 to 7.25 s: too few for comparisons."


METRICS = {"a.x": Metric(0.25, 0.2, 0.5, "share", 8), "b.x": Metric(np.nan, 0.0, 0.0, "share", 0),
           "x.a.b": Metric(1234.5, 1000.0, 2000.0, "m", 4)}  # fmt: skip


@pytest.mark.parametrize(
    ("column", "row", "shown"),
    [
        (Column("{}.x", scale=100), "a", "25.0 (20.0 to 50.0)"),
        (Column("{}.x", digits=2, plain=True), "a", "0.25"),
        (Column("{}.x", scale=-1), "a", "-0.2 (-0.5 to -0.2)"),
        (Column("{}.x", shows="count"), "a", "2 of 8"),
        (Column("{}.x", shows="n"), "a", "8"),
        (Column("{}.x", beside="x.{0}.b", digits=0), "a", "0.2 (1,234)"),
        (Column("x.{0}.{1}", beside="{0}.x", digits=0), ("a", "b"), "1,234 (0)"),
        (Column("a.x", digits=2, plain=True), (), "0.25"),
        (Column("{}.x"), "b", "-"),
        (Column("{}.x"), "nobody", "-"),
        (Column("{}.x", beside="{}.y"), "a", "-"),
    ],
)
def test_a_cell_is_an_interval_a_count_or_a_pair(column, row, shown):
    assert report.format_cell(column, METRICS, row) == shown


TABLE = report.Table(
    "t", "T", {"a": ("A",), "printed": ("a paper",), "nobody": ("N",)},
    (Column("{}.x", "share [%]", 0, 100), Column("{}.x", "n", shows="n")),
    note="{n[a.x]} seeds, {best} at best.", numbers={"best": Column("a.x", digits=2, plain=True)},
    printed={"printed.x": 0.5},
)  # fmt: skip


def test_a_table_has_what_others_report_and_numbers_in_its_note():
    lines = TABLE.to_markdown(METRICS).splitlines()
    assert lines[-4:] == ["| A | 25 (20 to 50) | 8 |", "| a paper | 50 | 1 |", "",
                          "8 seeds, 0.25 at best."]  # fmt: skip
    assert "| A | 25 | 8 |" in TABLE.to_markdown(METRICS, intervals=False)
    assert TABLE.list_metrics() == {"a.x", "nobody.x"}


def test_a_column_or_a_number_that_no_metric_has_is_refused():
    TABLE.check(METRICS)
    for wrong in (
        replace(TABLE, columns=(Column("{}.y"),)),
        replace(TABLE, columns=(Column("{}.x", beside="{}.y"),)),
        replace(TABLE, numbers={"best": Column("a.y")}),
    ):
        with pytest.raises(ConfigError, match="no row has the metric"):
            wrong.check(METRICS)


def test_a_table_of_nothing_is_not_printed():
    assert report.format_metrics("row", {"a": "A"}, [Column("d.{}", "x")], {}) == ""
    assert (
        report.format_metrics("row", {}, [Column("d.{}", "x")], {"d.a": Metric(1, 1, 1, "m", 1)})
        == ""
    )
