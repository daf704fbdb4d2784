"""Studies of episodes: what is counted, how parts are kept, and what a declaration may not say."""

import json

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.evaluation.sums import STATISTICS
from hrc_env.experiments.columns import (
    Column,
    difference_from_baseline,
    mean,
    per_minute,
    rate,
    share_of_baseline,
    share_of_episodes,
    share_of_tries,
)
from hrc_env.experiments.report import Table
from hrc_env.experiments.runner import run_experiment
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.study import Row, Study, split_row
from hrc_env.safety.shield import SHIELDS
from hrc_env.tracking.estimators import ESTIMATORS

TRUTH = PerceptionSetup("truth")
UNAWARE = {"people": "unaware"}


def study(**changes) -> Study:
    """Two rows that are cheap to play, the second beside the first."""
    known = {
        "name": "cheap", "title": "Cheap", "about": "Nothing.", "depends": ("env",),
        "first_seed": 5,
        "rows": {
            "bare": Row("no shield", 4, setup=TRUTH, env=UNAWARE, baseline="bare"),
            "qp": Row("`qp`", 2, setup=TRUTH, env={**UNAWARE, "shield": "qp"}, baseline="bare"),
        },
        "columns": (
            share_of_baseline("goals_reached", "throughput [%]", scale=100), mean("cost", "cost"),
        ),
    }  # fmt: skip
    return Study(**{**known, **changes})


def episode(**changes: float) -> dict[str, float]:
    return dict.fromkeys(STATISTICS, 0.0) | {"seconds": 10.0, "goals_reached": 4.0} | changes


def measure(column: Column, own, theirs=()) -> Metric:
    return column.measure(own, theirs)


def test_numbers_come_from_the_same_episodes():
    own = [episode(contacts_towards=1.0, cost=6.0), episode(contacts_standing=1.0, success=1.0)]
    theirs = [episode(goals_reached=8.0, cost=1.0), episode(goals_reached=8.0, cost=1.0)]
    kinds = ("contacts_towards", "contacts_standing")
    found = {
        "share": measure(share_of_baseline("goals_reached"), own, theirs),
        "goals": measure(per_minute("goals_reached"), own),
        "towards": measure(rate("contacts_towards", per="1000 episodes"), own),
        "all": measure(rate(kinds, per="hour"), own),
        "cost": measure(mean("cost"), own),
        "less": measure(difference_from_baseline("cost"), own, theirs),
        "success": measure(share_of_episodes("success"), own),
        "tries": measure(share_of_tries(clustered=False), [episode(goals_missed=1.0)]),
    }
    assert {name: each.value for name, each in found.items()} == pytest.approx({
        "share": 0.5, "goals": 24.0, "towards": 500.0, "all": 360.0, "cost": 3.0, "less": 2.0,
        "success": 0.5, "tries": 0.8,
    })  # fmt: skip
    assert found["towards"].low < 20.0 < 500.0 < found["towards"].high  # exact, of one event


def test_a_pair_tells_a_difference_that_rows_by_themselves_do_not():
    rng = np.random.default_rng(0)
    costs = rng.uniform(0, 100, 20)
    own, theirs = ([episode(cost=each) for each in values] for values in (costs + 1, costs))
    paired, alone = (
        measure(difference_from_baseline("cost"), own, theirs),
        measure(mean("cost"), own),
    )
    assert paired.value == pytest.approx(1.0)
    assert paired.high - paired.low < 1e-9 < alone.high - alone.low


def test_parts_are_first_seeds_and_counts():
    assert split_row(Row("", 5, n_together=2), 100) == [(100, 2), (102, 2), (104, 1)]


def test_a_row_is_played_once_and_again_only_where_it_changed(tmp_path, monkeypatch):
    first = run_experiment(study(), tmp_path)
    assert first["bare.share"].value == 1.0
    assert 0 < first["qp.share"].value < 1.0
    assert json.loads((tmp_path / "results.json").read_text())["seeds"] == [5, 6, 7, 8]
    assert "| `qp` | " in (tmp_path / "report.md").read_text()
    monkeypatch.setattr(
        "hrc_env.experiments.study.play_episodes", lambda *of, **_: pytest.fail("played again")
    )
    assert run_experiment(study(), tmp_path) == first
    other = {**study().rows, "qp": Row("`ssm`", 2, setup=TRUTH, env={"shield": "ssm"})}
    with pytest.raises(pytest.fail.Exception, match="played again"):
        run_experiment(study(rows=other, columns=(mean("cost"),)), tmp_path, overwrite=True)


def test_the_size_of_a_part_changes_no_number(tmp_path):
    row = Row("", 3, setup=TRUTH, env=UNAWARE)
    rows = {"one": row, "two": Row("", 3, setup=TRUTH, env=UNAWARE, n_together=2)}
    found = run_experiment(study(rows=rows, columns=(mean("cost"), mean("r"))), tmp_path)
    assert found["one.r"] == found["two.r"]


def test_episodes_take_turns_in_the_cameras_that_are_left():
    turns = Row("", 4, setup=PerceptionSetup(n_cameras=1), env={"faults": ()}).keywords()
    assert len({turn["faults"][0].cameras for turn in turns}) == 4
    (late,) = Row("", 4, setup=PerceptionSetup(latency_s=0.2)).keywords()
    assert {camera.latency_s for camera in late["cameras"]} == {0.2}
    assert "cameras" not in Row("", 4).keywords()[0]  # the scene's own


def test_somebody_elses_estimator_policy_and_shield_are_compared(tmp_path, brought):
    """Registered by a file, or functions as they are."""

    class Still:
        def act(self, observation):
            return np.zeros((*observation.shape[:-1], 6), np.float32)

    def halved(belief, velocities, dt_s):
        return 0.5 * velocities, {}

    rows = {
        "usual": Row("usual", 1),
        "estimator": Row("dlt_kalman", 1, setup=PerceptionSetup(estimator="dlt_kalman")),
        "policy": Row("still", 1, agent=lambda env_info: Still()),
        "shield": Row("halved", 1, env={"shield": halved}),
    }
    made = study(rows=rows, columns=(per_minute("goals_reached"), mean("r", "return")))
    assert made.settings()["rows"]["shield"]["env"]["shield"]["source"] != ""
    found = run_experiment(made, tmp_path)
    goals = {name: found[f"{name}.goals_reached_per_minute"].value for name in rows}
    assert goals["policy"] == 0.0 < goals["usual"]
    assert found["estimator.r"].value != found["usual.r"].value
    assert goals["shield"] < goals["usual"]
    assert "dlt_kalman" in ESTIMATORS
    assert halved not in SHIELDS.values()


ROW = Row("", 2, setup=TRUTH)
BARE = Row("", 2, setup=TRUTH, baseline="bare")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rows": {"a": Row("", 2, "scriptd")}}, r"Row 'a' of 'cheap'.*Did you mean 'scripted'"),
        ({"rows": {"a": Row("", 2, "hrc://HRCReach-v0/none")}}, r"Row 'a'.*HRCReach-v0"),
        ({"rows": {"a": Row("", 2, "runs/none.zip")}}, "Unknown agent 'runs/none.zip'"),
        ({"rows": {"a": Row("", 2, setup=PerceptionSetup(estimator="partical"))}},
         "Did you mean 'particle'"),
        ({"rows": {"a": Row("", 2, setup=PerceptionSetup("keypoint"))}},
         "Did you mean 'keypoints'"),
        ({"rows": {"a": Row("", 2, env={"task": "HRCReach-v1"})}}, "Did you mean 'HRCReach-v0'"),
        ({"rows": {"a": Row("", 2, env={"shield": "qpp"})}}, "Did you mean 'qp'"),
        ({"rows": {"a": Row("", 2, env={"peple": "unaware"})}}, "Did you mean 'people'"),
        ({"rows": {"a": Row("", 2, env={"perception": "truth"})}},
         "which comes from the row's setup"),
        ({"rows": {"a": Row("", 0)}}, "n_episodes and n_together must be at least 1, got 0"),
        ({"rows": {"a": ROW}}, "has no baseline, which 'a.share' requires"),
        ({"rows": {"bare": BARE, "a": Row("", 2, setup=TRUTH, baseline="bear")}},
         "baseline of row 'a'.*Did you mean 'bare'"),
        ({"rows": {"bare": BARE, "a": Row("", 3, setup=TRUTH, baseline="bare")}},
         "its baseline 'bare' must have as many; it has 2"),
        ({"rows": {}}, "must have rows and columns"),
        ({"columns": (mean("cost"), mean("cost"))}, "measures 'bare.cost' twice"),
        ({"depends": ("envs",)}, "Did you mean 'env'"),
        ({"tables": (Table("t", "T", {"bare": ("x",)}, (Column("{}.costs", "cost"),)),)},
         r"no row has the metric '{}.costs'; a row has cost, share"),
        ({"tables": (Table("t", "T", {"bare": ("x", "y")}, (Column("{}.cost", "cost"),)),)},
         "must have a cell for each of the heads"),
    ],
)  # fmt: skip
def test_a_row_that_names_nothing_is_refused_when_it_is_declared(changes, words):
    with pytest.raises(ConfigError, match=words):
        study(**changes)


@pytest.mark.parametrize(
    "declare",
    [mean, per_minute, rate, share_of_episodes, share_of_baseline, difference_from_baseline],
    ids=lambda declare: declare.__name__,
)
def test_an_unknown_statistic_is_refused_when_a_column_is_declared(declare):
    with pytest.raises(ConfigError, match=r"Unknown statistic 'costs'\. Did you mean 'cost'"):
        declare("costs")


def test_an_unknown_unit_is_refused_when_a_column_is_declared():
    with pytest.raises(ConfigError, match="Unknown exposure '100 episodes'"):
        rate("contacts", per="100 episodes")


def test_some_rows_are_selected_with_their_baselines():
    assert list(study().select(["qp"]).rows) == ["bare", "qp"]
    with pytest.raises(ConfigError, match=r"Unknown row of 'cheap' 'pq'"):
        study().select(["pq"])
    assert {row.n_episodes for row in study(n_quick=1).shorten().rows.values()} == {1}


def test_the_environment_of_a_policy_has_what_it_observes():
    agent = "hrc://HRCReach-v0/shielded"
    (known,) = Row("", 1, agent, env={"shield": None, "config": {"worker": "any"}}).keywords()
    assert known["config"] == {"worker": "any", "observe_shield": True, "forecast_s": (0.2, 0.4)}
    assert "config" not in Row("", 1, "scripted").keywords()[0]
