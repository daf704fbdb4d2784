"""The study of learners under a shield: its arms, their environments, the summary over seeds."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import learning, limited, under_shield
from benchmarks.learning import Training, pool_rates, summarize_runs
from benchmarks.studies import COMMANDS
from benchmarks.under_shield import ARMS, LEARNERS, UnderShieldArguments, make_study, make_trainings
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.evaluation.intervals import estimate_rate, estimate_share_of
from hrc_env.experiments.report import Table


def make_metrics(goals, counts, n=2000):
    """Metrics of one policy in each row."""
    metrics = {}
    for k, (goal, count) in enumerate(zip(goals, counts, strict=True)):
        of_row = {
            "goals_per_minute": Metric(goal, goal - 1, goal + 1, "1/min", n),
            "cost_per_episode": Metric(10.0 * goal, 0.0, 1.0, "control steps", n),
            "interventions_per_hour": Metric(np.nan, np.nan, np.nan, "1/h", n),
            "towards": estimate_rate([count] + [0] * (n - 1), n),
            "towards_per_hour": estimate_rate([count], n / 360, "1/h"),
            "seconds": Metric(10.0, 10.0, 10.0, "s", n),
            "above_force_limit": estimate_share_of([1] if count else [], [count] if count else []),
        }
        metrics |= {f"qp_{k}.{name}": metric for name, metric in of_row.items()}
    return metrics, {"qp": [f"qp_{k}" for k in range(len(goals))]}


def test_learners_are_compared_by_interquartile_means_and_all_contacts():
    found = summarize_runs(*make_metrics([50.0, 51.0, 52.0, 53.0, 10.0], [0, 0, 3, 1, 0]))
    assert found["qp.goals_per_minute"].value == pytest.approx(51.0)
    assert found["qp.goals_per_minute"].low < 51.0 < found["qp.goals_per_minute"].high
    assert found["qp.goals_per_minute"].n == 5
    towards, exact = found["qp.towards"], estimate_rate([4], 10_000)
    assert (towards.value, towards.low, towards.high) == (exact.value, exact.low, exact.high)
    assert towards.n == 10_000
    assert found["qp.towards_per_hour"].high == pytest.approx(exact.high * 360)
    assert found["qp.above_force_limit"].n == 4
    assert np.isnan(found["qp.interventions_per_hour"].value), "unknown, not 0"


def test_four_seeds_have_no_interval_but_exact_counts():
    found = summarize_runs(*make_metrics([50.0, 51.0, 52.0, 53.0], [0, 0, 0, 0]))
    assert np.isnan(found["qp.goals_per_minute"].low)
    assert found["qp.towards"].high == pytest.approx(estimate_rate([0], 8000).high)
    assert summarize_runs({}, {"qp": []}) == {}


def test_rates_of_several_policies_are_those_of_all_their_episodes():
    pooled = pool_rates([estimate_rate([2, 0], 2), estimate_rate([0] * 6, 6)])
    assert (pooled.value, pooled.n) == (0.25, 8)


def test_rows_of_single_policies_show_no_bootstrap_of_their_episodes():
    metrics, rows = make_metrics([50.0], [3])
    metrics |= summarize_runs(metrics, rows)
    shown = {"qp": ("PPO", "all"), "qp_0": ("PPO", "0")}
    table = Table("it", "", shown, under_shield.COLUMNS, ("learner", "seed"), trained=["qp_0"])
    *_, summary, single = (
        line for line in table.to_markdown(metrics).splitlines() if line.startswith("| PPO")
    )
    assert "| 50.0 | 3 of 2000 |" in single
    assert "0.5 (0.1 to 1.6)" in single, "contacts an hour keep their exact interval"
    assert "Rows of a single trained policy" in table.to_markdown(metrics)
    assert "3 of 2000" in summary


def test_each_learner_has_five_seeds_and_is_evaluated_as_it_learnt(tmp_path, monkeypatch):
    trainings = make_trainings(UnderShieldArguments(tmp_path))
    assert len(trainings) == 5 * len(LEARNERS)
    assert len({training.folder for training in trainings.values()}) == len(trainings)
    for name, arm in ARMS.items():
        observes = "observe-shield" in LEARNERS[arm.learner]
        assert arm.env["config"].get("observe_shield", False) is observes, name
        assert arm.env["config"]["worker"] == "any"
        if observes:
            assert arm.shield is not None
    assert make_study(trainings).rows == {}, "nothing is trained yet"
    with pytest.raises(ConfigError, match="learner"):
        UnderShieldArguments(tmp_path, learners=("qq",))
    assert COMMANDS["under_shield"].is_release
    assert len(limited.LimitedArguments().seeds) >= 5


def test_a_training_takes_options_with_several_values(tmp_path, monkeypatch):
    called = []
    monkeypatch.setattr(learning.subprocess, "run", lambda words, **_: called.append(words))
    Training(Path(tmp_path / "run"), LEARNERS["qp"]).run()
    text = " ".join(called[0])
    assert "--forecast-s 0.2 0.4 --shield-change 0.5" in text
    assert "--shield qp --observe-shield True" in text
