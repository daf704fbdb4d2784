"""What tables say: no zero without a bound, few seeds no interval, marks by adjusted p-values."""

import ast
import json
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import results
from benchmarks.studies import COMMANDS
from docs import tables
from hrc_env.core.results import Metric
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.evaluation.counts import ERRORS_M, GAPS_M, SPEEDS_MPS
from hrc_env.evaluation.intervals import MIN_SEEDS
from hrc_env.evaluation.sums import INTERVENTIONS, RARE, STATISTICS
from hrc_env.experiments import columns
from hrc_env.experiments.columns import Column
from hrc_env.experiments.entries import read_entry
from hrc_env.experiments.impact.metrics import PER_1000, compute_metrics
from hrc_env.experiments.report import Table, format_cell, format_interval, format_metric
from hrc_env.experiments.runner import run_experiment
from hrc_env.experiments.setups import REFERENCE, PerceptionSetup
from hrc_env.experiments.study import Row, Study

ROOT = Path(__file__).resolve().parents[2]
SAFETY = ("impact", "kept", "shielded", "limited", "price", "under_shield")
"""Commands of the safety studies."""
ZERO = re.compile(r"[+-]?0(\.0+)?( ●)?")
WIDTHLESS = re.compile(r"[+-]?0(?:\.0+)? \([+-]?0(?:\.0+)? to [+-]?0(?:\.0+)?\)")
INTERVAL = re.compile(r"\([+-]?[\d.,]+ to [+-]?[\d.,]+\)")


def list_cells(table: Table, metrics, intervals: bool) -> Iterator[tuple[Metric, str]]:
    """Yield the metric and the text of each cell that has a number."""
    for column in table.columns:
        shown = column if intervals else replace(column, plain=not column.counted)
        for row in table.rows:
            (name, *_) = column.list_metrics(row)
            if name in metrics and column.shows in ("value", "value of n"):
                yield metrics[name], format_cell(shown, metrics, row)


def find_bare_zeros(table: Table, metrics) -> list[str]:
    """Return the cells with a zero of several observations that has neither a bound nor a word."""
    return [
        text
        for intervals in (True, False)
        for metric, text in list_cells(table, metrics, intervals)
        if metric.n > 1 and (ZERO.fullmatch(text) or WIDTHLESS.search(text))
    ]


@pytest.mark.parametrize("name", tables.names())
def test_no_table_of_the_documentation_has_a_bare_zero(name):
    """In any form in which a page can show it."""
    result = tables.read(name)
    assert find_bare_zeros(result.table, result.metrics) == []


def test_no_table_of_the_leaderboard_has_a_bare_zero():
    paths = sorted((tables.RESULTS / "leaderboard").glob("*.json"))
    scores = [metric for path in paths for metric in read_entry(path).scores.values()]
    zeros = [format_metric(metric) for metric in scores if metric.value == 0]
    assert len(zeros) > 20
    assert [each for each in zeros if not re.search(r" to 0*[1-9.]|in all 64", each)] == []


def test_the_guard_finds_a_bare_zero(monkeypatch):
    table = Table("t", "T", {"a": ("a",)}, [Column("{}.x", "x", counted=True)])
    exact, every = Metric(0.0, 0.0, 0.1, "1/h", 30), Metric(0.0, 0.0, 0.0, "1/h", 30)
    assert find_bare_zeros(table, {"a.x": exact}) == find_bare_zeros(table, {"a.x": every}) == []
    assert format_cell(table.columns[0], {"a.x": every}, "a") == "0.0 in all 30"
    unbounded = Metric(0.0, math.nan, math.nan, "1/h", 30)
    assert find_bare_zeros(table, {"a.x": unbounded}) == ["0.0", "0.0"]
    told = "0.0 (0.0 to 0.0)"
    monkeypatch.setattr("hrc_env.experiments.report.format_metric", lambda *of: told)
    assert find_bare_zeros(table, {"a.x": every}) == [told, told]


def test_small_numbers_are_not_shown_as_zero():
    assert format_interval(0.004, 0.001, 0.01, 1) == "0.00 (0.00 to 0.01)"
    assert format_interval(0.0, 0.0, 0.004, 1) == "0.000 (0.000 to 0.004)"
    assert format_interval(0.0003, math.nan, math.nan, 2) == "0.0003"
    assert format_interval(0.0, math.nan, math.nan, 2) == "0.00"
    assert format_metric(Metric(0.0, 0.0, 0.0, "m", 12), digits=2, signed=True) == "+0.00 in all 12"


@pytest.mark.parametrize("name", COMMANDS)
def test_results_with_a_zero_without_a_bound_are_to_be_renewed(name):
    made = results.read_results(name)
    zeros = results.list_unbounded_zeros(made.get("metrics", {}))
    assert not zeros or "zero without a bound" in results.explain_stale(name)


def test_a_new_result_with_a_zero_without_a_bound_is_listed(monkeypatch):
    """Though it is of today's versions."""
    made = {"value": 0.0, "low": 0.0, "high": 0.0, "unit": "share", "n": 30}
    assert results.list_unbounded_zeros({"lost.x": made}) == ["lost.x"]
    for change in ({"high": 0.1}, {"unit": "m"}, {"n": 1}):
        assert results.list_unbounded_zeros({"lost.x": made | change}) == []
    assert results.list_unbounded_zeros({"difference.lost.x": made}) == []
    command = COMMANDS["site"]
    fresh = {"command": command.command, "metrics": {"lost.x": made},
             "depends": results.select_versions(command.depends)}  # fmt: skip
    monkeypatch.setattr(results, "read_results", lambda name: fresh)
    monkeypatch.setattr(results.records, "read", lambda name: results.records.Record())
    assert results.explain_stale("site") == "zero without a bound: lost.x and 0 more"


NOTHING = [{**dict.fromkeys(STATISTICS, 0.0), "seconds": 10.0} for _ in range(30)]
SOME = [each | dict.fromkeys(RARE, 1.0) for each in NOTHING]
MAKERS = (
    columns.mean, columns.per_minute, columns.rate, columns.share_of_episodes,
    columns.difference_from_baseline, columns.share_of_baseline,
)  # fmt: skip


@pytest.mark.parametrize("make", MAKERS, ids=lambda make: make.__name__)
@pytest.mark.parametrize("statistic", RARE)
def test_a_column_of_a_count_has_no_bootstrap(make, statistic):
    """Which would have no width where nothing was counted."""
    column = make(statistic, "heading")
    theirs = SOME if make is columns.share_of_baseline else NOTHING
    found = column.measure(NOTHING, theirs)
    assert found.value == 0.0 < found.high
    if make is columns.difference_from_baseline:
        assert found.low < 0.0
        assert column.test(NOTHING, NOTHING).value == 1.0


@pytest.mark.parametrize("statistic", ["success", "goals_reached", "goals_missed", INTERVENTIONS])
def test_other_counts_of_zero_have_a_bound(statistic):
    for column in (columns.mean(statistic), columns.rate(statistic)):
        assert column.measure(NOTHING, NOTHING).high > 0


def test_columns_of_contacts_can_be_chosen_and_say_what_is_not_known():
    by_name = {each.metric.removeprefix("{}."): each for each in columns.list_safety_columns()}
    bare = [each | {INTERVENTIONS: np.nan} for each in NOTHING]
    one = {"contacts_towards": 1.0, "contacts_rated": 2.0, "contacts_above_limit": 1.0}
    touched = [each | one for each in NOTHING]
    found = {name: column.measure(bare, bare) for name, column in by_name.items()}
    assert np.isnan(found["above_force_limit"].value)  # there was no contact
    assert np.isnan(found["interventions_per_hour"].value)  # there is no shield
    assert found["towards_per_hour"].value == 0.0 < found["towards_per_hour"].high
    measured = {name: column.measure(touched, touched) for name, column in by_name.items()}
    assert measured["towards_per_hour"].value == pytest.approx(360.0)
    metrics = {f"a.{name}": metric for name, metric in measured.items()}
    shown = format_cell(by_name["above_force_limit"], metrics, "a")
    assert shown == "50.0 (36.8 to 63.2) of 60"  # Clopper and Pearson
    lacking = {f"a.{name}": metric for name, metric in found.items()}
    for name in ("above_force_limit", "interventions_per_hour"):
        assert format_cell(by_name[name], lacking, "a") == "-"


def test_every_row_of_a_count_in_impact_is_bounded():
    """Also where the robot never came near."""
    n, n_steps = 12, 250
    nothing = dict.fromkeys(
        ("cost", "cost_towards", "goals", "contacts_towards", "contacts_standing",
         "contacts_fleeing", "contacts_rated", "contacts_above_limit", "interventions", *PER_1000),
        [0] * n,
    )  # fmt: skip
    histograms = {
        "error_counts": [[n_steps * N_JOINTS, *[0] * len(ERRORS_M.edges)]] * n,
        "optimism_counts": [[1, *[0] * len(GAPS_M.edges)]] * n,
        "robot_speed_counts": [[1, *[0] * len(SPEEDS_MPS.edges)]] * n,
        "worker_speed_counts": [[1, *[0] * len(SPEEDS_MPS.edges)]] * n,
    }
    row = {**nothing, **histograms, "minutes": [1 / 6] * n, "separation_min_m": [0.5] * n,
           "walk": [""] * n}  # fmt: skip
    found = compute_metrics({("scripted", REFERENCE): row}, ())
    counts = {name: each for name, each in found.items() if each.unit in results.COUNTED_IN}
    assert len(counts) > 10
    assert [name for name, each in counts.items() if each.value == 0 == each.high] == []
    assert np.isnan(found[f"scripted.{REFERENCE}.above_force_limit"].value)


ALLOWED = {
    "hrc_env/experiments/columns.py": 2,  # of statistics that are no counts
    "hrc_env/experiments/impact/metrics.py": 1,  # of costs, goals and separations
    "hrc_env/experiments/price/metrics.py": 1,  # of the cost
    "hrc_env/evaluation/intervals.py": 1,  # for a mean
    "benchmarks/speed/pixels.py": 1,  # of mean errors
}
"""Numbers of calls of `estimate_ratio`, a bootstrap of a sum over a sum."""


def test_no_study_computes_a_share_by_a_bootstrap():
    """If this fails: a fraction of trials has `estimate_clustered_share` or `estimate_share`."""
    found: dict[str, int] = {}
    for folder in ("hrc_env", "benchmarks", "assets", "agents", "docs", "examples"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                named = getattr(node, "attr", None) or getattr(node, "id", None)
                if isinstance(node, ast.Attribute | ast.Name) and named == "estimate_ratio":
                    name = path.relative_to(ROOT).as_posix()
                    found[name] = found.get(name, 0) + 1
    assert found == ALLOWED


@pytest.mark.parametrize("name", SAFETY)
def test_every_table_of_a_safety_study_names_its_conditions(name):
    for table in COMMANDS[name].declared_tables.values():
        assert table.conditions is not None, table.name
        note = table.format_note({})
        for word in ("Body: `any`", "people: `", "scene: ", "perception: ", "Played on seeds "):
            assert word in note, (table.name, word)
        assert re.search(r"seeds? [\d,]+|not recorded", table.conditions.chosen_on), table.name


def test_old_numbers_of_one_body_are_not_said_to_be_of_all():
    for name in SAFETY:
        for table in COMMANDS[name].tables:
            result = tables.read(table)
            if result.bodies != result.table.conditions.worker:
                stale = tables.describe_stale(table, result)
                assert "all workers have the body `worker_1`" in stale, table


def make_study(n: int) -> Study:
    """A study of two rows that differ, with so many episodes each."""
    rows = {
        name: Row(name, n, setup=PerceptionSetup("none"), env={"max_episode_steps": steps},
                  baseline="short")
        for name, steps in (("short", 4), ("long", 8))
    }  # fmt: skip
    return Study(
        name="lengths", title="Lengths", about="Two lengths.", depends=("env",), first_seed=3,
        rows=rows,
        columns=(columns.mean("l", "length"), columns.mean("r", "return", digits=4),
                 columns.difference_from_baseline("r", "difference"),
                 columns.difference_from_baseline("l", "longer")),
    )  # fmt: skip


def test_few_seeds_have_no_interval_no_mark_and_words(tmp_path):
    run_experiment(make_study(MIN_SEEDS - 1), tmp_path)
    text = (tmp_path / "report.md").read_text()
    assert not INTERVAL.search(text)
    assert "●" not in text
    assert "too few seeds (fewer than 8)" in text
    content = json.loads((tmp_path / "results.json").read_text())["metrics"]
    assert math.isnan(content["p.long.difference.r"]["value"])


def test_eight_seeds_are_marked_by_p_values_that_are_adjusted(tmp_path):
    found = run_experiment(make_study(MIN_SEEDS), tmp_path)
    assert found["p.long.difference.l"].value == 2 / 2**8
    assert found["p_holm.long.difference.l"].value == pytest.approx(2 * 2 / 2**8)
    text = (tmp_path / "report.md").read_text()
    assert INTERVAL.search(text)
    assert text.count("●") == 2
    assert "after Holm's correction for the 2 contrasts of the study" in text


@pytest.mark.parametrize(("p", "is_marked"), [(0.049, True), (0.051, False), (math.nan, False)])
def test_only_an_adjusted_p_value_marks_a_difference(p, is_marked):
    column = Column("difference.{}.x", "less", signed=True)
    metrics = {"difference.a.x": Metric(2.0, 1.0, 3.0, "m", 30)}
    assert format_cell(column, metrics, "a") == "+2.0 (+1.0 to +3.0)"  # though it excludes zero
    metrics |= {"p.a.x": Metric(1e-4, 1e-4, 1e-4, "p", 30), "p_holm.a.x": Metric(p, p, p, "p", 9)}
    assert ("●" in format_cell(column, metrics, "a")) == is_marked
    table = Table("t", "T", {"a": ("a",)}, [column])
    says = table.describe_intervals(metrics)
    assert ("for the 9 contrasts" in says) != math.isnan(p)
    assert ("No difference is marked" in says) == math.isnan(p)
