"""The benchmark of policies: conditions, numbers, and what is refused."""

import json
from dataclasses import replace

import pytest

from hrc_env.__main__ import main
from hrc_env.agents.separate import SeparateProcess
from hrc_env.experiments.entries import read_entry
from hrc_env.experiments.leaderboard import CONDITIONS, MAIN, SEED, draw_first_seed, make_plan
from hrc_env.safety.incidents import KINDS

pytestmark = pytest.mark.slow  # an experiment is played

KEY = "HRCReach-v0.unaware.keypoints.none"


POLICY = """
import numpy as np


class Still:
    def __init__(self, env_info):
        self.n = env_info.n_actions

    def act(self, observation):
        return np.zeros((*observation.shape[:-1], self.n), np.float32)


def nobody(env_info):
    return None
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """The working directory, with a policy."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "still.py").write_text(POLICY)


def test_conditions_are_twelve_each_without_and_with_a_shield():
    assert len(CONDITIONS) == 12
    assert set(MAIN) <= set(CONDITIONS)
    rows = make_plan("scripted").make_study().rows
    one = rows["HRCReach-v0.unaware.one.qp"].keywords()
    assert len(one) == 4
    assert {turn["shield"] for turn in one} == {"qp"}
    assert len({turn["faults"][0].cameras for turn in one}) == 4
    (late,) = rows["HRCDelivery-v0.unaware.late.none"].keywords()
    assert {camera.latency_s for camera in late["cameras"]} == {0.2}


def test_numbers_are_counted_over_the_time_that_was_played():
    study = make_plan("scripted", ["HRCReach-v0"]).make_study()
    contacts = {f"contacts_{kind}": 0.0 for kind in KINDS}
    one = {"seconds": 30.0, "goals_reached": 3.0, "goals_missed": 1.0, "cost": 5.0, **contacts}
    two = {**one, "goals_reached": 1.0, "contacts_towards": 1.0, "contacts_standing": 2.0}
    found = study.metrics({row: [one, two] for row in study.rows})
    assert found[f"{KEY}.goals_per_minute"].value == 4.0
    assert found[f"{KEY}.success"].value == pytest.approx(4 / 6)
    per_hour = [found[f"{KEY}.{what}_per_hour"].value for what in ("towards", "contacts")]
    assert per_hour == [60.0, 180.0]


def test_seeds_follow_from_the_digest_and_the_salt():
    plan = make_plan("scripted")
    assert plan.make_study().first_seed == SEED
    salted = replace(plan, salt="drawn later").make_study()
    assert salted.first_seed == draw_first_seed(plan.submission.sha256, "drawn later")
    agents = [row.agent for row in salted.rows.values()]
    assert all(isinstance(each, SeparateProcess) and each.must_confine for each in agents)
    seeds = {draw_first_seed(sha, salt) for sha in ("a", "b") for salt in ("c", "d")}
    assert len(seeds) == 4
    assert max(seeds) > 10**9  # too many to try all


def test_a_policy_is_judged_and_entered_and_goes_on(tmp_path, monkeypatch):
    words = ["benchmark", "--policy", "still:Still", "--ids", "HRCReach-v0", "--seeds", "4"]
    words += ["--out", str(tmp_path / "out"), "--enter", str(tmp_path / "mine.json")]
    assert main(words) == 0
    made = json.loads((tmp_path / "out" / "results.json").read_text())["metrics"]
    assert made[f"{KEY}.goals_per_minute"]["value"] == 0.0
    assert len(made) == 12 * 7
    assert read_entry(tmp_path / "mine.json").policy == "still:Still"
    monkeypatch.setattr(
        "hrc_env.experiments.study.play_episodes", lambda *of, **_: pytest.fail("again")
    )
    assert main(words) == 0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--policy", "hrc_env.agents.nowhere:make"], "must be MODULE:FUNCTION"),
        (["--policy", "nowhere:make"], "must be MODULE:FUNCTION"),
        (["--policy", "still:nobody"], "which has no act"),
        (["--policy", "scriptd"], "Did you mean 'scripted'"),
        (["--policy", "scripted", "--ids", "HRCReach-v1"], "Did you mean 'HRCReach-v0'"),
        (["--policy", "scripted", "--seeds", "0"], "--seeds must be 1 or more"),
        (["--policy", "scripted", "--enter", "mine"], "--enter must end in .json"),
    ],
)
def test_what_cannot_be_judged_is_refused_in_words(words, says, tmp_path, capsys):
    assert main(["benchmark", *words, "--out", str(tmp_path / "out")]) == 2
    assert says in " ".join(capsys.readouterr().err.split())


def test_a_folder_of_another_version_is_left_alone(tmp_path, capsys):
    (tmp_path / "experiment.json").write_text('{"experiment": "benchmark, version 0"}')
    assert main(["benchmark", "--policy", "random", "--out", str(tmp_path)]) == 2
    assert "holds the results of 'benchmark, version 0'" in capsys.readouterr().err
