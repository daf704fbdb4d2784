"""The benchmark: conditions, numbers, entries, what is refused."""

import json

import numpy as np
import pytest

from hrc_env.__main__ import main
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.experiments.benchmark import entries as rows
from hrc_env.experiments.benchmark.conditions import CONDITIONS, MAIN, VERSION, Condition
from hrc_env.experiments.benchmark.experiment import worth
from hrc_env.safety.incidents import KINDS

pytestmark = pytest.mark.slow  # an experiment is played

KEY = "HRCReach-v0.unaware.keypoints.none"


class Still:
    """Does nothing."""

    def __init__(self, env_info) -> None:
        self.n = env_info.n_actions

    def act(self, observation):
        return np.zeros((*observation.shape[:-1], self.n), np.float32)


def nobody(env_info):
    return None


def entry(name: str, goals: float, towards: float) -> rows.Entry:
    found = {f"{KEY}.goals_per_minute": goals, f"{KEY}.towards_per_hour": towards}
    scores = {key: Metric(value, value, value, "", 4) for key, value in found.items()}
    return rows.Entry(name, "scripted", "abc", "2026-11-26", scores)


def test_conditions_are_twelve_each_without_and_with_a_shield():
    assert len(CONDITIONS) == 12
    assert set(MAIN) <= set(CONDITIONS)
    one = Condition(eyes="one", shield="qp").keywords("HRCReach-v0")
    assert len(one) == 4
    assert {turn["shield"] for turn in one} == {"qp"}
    assert len({turn["faults"][0].cameras for turn in one}) == 4
    (late,) = Condition(eyes="late").keywords("HRCDelivery-v0")
    assert {camera.latency_s for camera in late["cameras"]} == {0.2}


def test_numbers_are_counted_over_the_time_that_was_played():
    contacts = {f"contacts_{kind}": 0.0 for kind in KINDS}
    one = {"seconds": 30.0, "goals_reached": 3.0, "goals_missed": 1.0, "cost": 5.0, **contacts}
    two = {**one, "goals_reached": 1.0, "contacts_towards": 1.0, "contacts_standing": 2.0}
    found = {name: metric.value for name, metric in worth([one, two]).items()}
    assert found["goals_per_minute"] == 4.0
    assert found["success"] == pytest.approx(4 / 6)
    assert (found["towards_per_hour"], found["contacts_per_hour"]) == (60.0, 180.0)


def test_regret_is_to_the_best_of_those_who_are_no_more_dangerous():
    safe, reckless = entry("safe", 30.0, 1.0), entry("reckless", 60.0, 90.0)
    own = entry("own", 20.0, 2.0).scores
    assert rows.regret(KEY, own, [safe, reckless]) == 10.0
    assert rows.regret(KEY, own, [reckless]) == 0.0
    assert rows.regret(KEY, entry("wild", 20.0, 100.0).scores, [safe, reckless]) == 40.0


def test_entries_are_written_and_read(tmp_path):
    path = rows.enter(entry("mine", 12.345678, 0.5), tmp_path)
    (read,) = rows.entries(tmp_path)
    assert read.scores[f"{KEY}.goals_per_minute"] == Metric(12.346, 12.346, 12.346, "", 4)
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"version": VERSION + 1}))
    with pytest.raises(ConfigError, match=r"version 2 .* Run it again"):
        rows.entries(tmp_path)
    path.write_text("{}")
    with pytest.raises(ConfigError, match="no entry of the benchmark"):
        rows.entries(tmp_path)


def test_a_policy_is_judged_and_entered_and_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(rows, "FOLDER", tmp_path / "entries")
    words = ["benchmark", "--policy", f"{__name__}:Still", "--ids", "HRCReach-v0", "--seeds", "4"]
    words += ["--out", str(tmp_path / "out")]
    assert main(words) == 0
    made = json.loads((tmp_path / "out" / "results.json").read_text())["metrics"]
    assert made[f"{KEY}.goals_per_minute"]["value"] == 0.0
    assert len(made) == 12 * 8
    monkeypatch.setattr(
        "hrc_env.experiments.benchmark.experiment.play_episodes",
        lambda *of, **_: pytest.fail("again"),
    )
    assert main(words) == 0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--policy", "hrc_env.agents.nowhere:make"], "must be MODULE:FUNCTION"),
        (["--policy", f"{__name__}:nobody"], "which has no act"),
        (["--policy", "scriptd"], "Did you mean 'scripted'"),
        (["--policy", "scripted", "--ids", "HRCReach-v1"], "Did you mean 'HRCReach-v0'"),
        (["--policy", "scripted", "--seeds", "0"], "--seeds must be 1 or more"),
    ],
)
def test_what_cannot_be_judged_is_refused_in_words(words, says, tmp_path, capsys):
    assert main(["benchmark", *words, "--out", str(tmp_path / "out")]) == 2
    assert says in " ".join(capsys.readouterr().err.split())


def test_a_folder_of_another_version_is_left_alone(tmp_path, capsys):
    (tmp_path / "experiment.json").write_text('{"experiment": "benchmark, version 0"}')
    assert main(["benchmark", "--policy", "random", "--out", str(tmp_path)]) == 2
    assert "holds the results of 'benchmark, version 0'" in capsys.readouterr().err
