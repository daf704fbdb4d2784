"""Studies of episodes behind the documentation: what they declare, and that they go on."""

import json
from dataclasses import replace

import numpy as np
import pytest

import hrc_env
from benchmarks import baselines, experts, kept, learners, limited, shielded
from benchmarks.command import StudyArguments, run_study
from benchmarks.learning import Training
from benchmarks.studies import COMMANDS
from docs import tables
from hrc_env.agents import policies
from hrc_env.agents.interface import Interface
from hrc_env.core.errors import ConfigError
from hrc_env.experiments import study
from hrc_env.experiments.runner import run_experiment
from hrc_env.experiments.study import split_row
from hrc_env.pipeline.levels import LEVELS

STUDIES = {"shielded": shielded.STUDY, "experts": experts.STUDY, "kept": kept.make_study()}


@pytest.mark.parametrize("name", STUDIES)
def test_every_recorded_part_is_one_that_the_study_makes(name):
    """With the key of its row, seeds and versions: `benchmarks.verify` finds it."""
    from benchmarks import records

    study, recorded = STUDIES[name], records.read(name).parts
    labels = {
        f"{row.replace('/', '.')}.{first}"
        for row, each in study.rows.items()
        for first, _ in split_row(each, study.first_seed)
    }
    assert recorded.keys() == labels


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_makes_every_number_of_its_table(name):
    study = STUDIES[name]
    made = {c.metric.format(row) for row in study.rows for c in study.columns if c.measure}
    assert tables.asked(name) <= made


def test_every_policy_of_the_package_is_judged_with_and_without_a_shield():
    found = {(row.agent, row.env["shield"]) for row in STUDIES["kept"].rows.values()}
    assert found == {(name, shield) for name in policies.list_names() for shield in (None, "qp")}
    assert {agent.split("/")[2] for agent, _ in found} == set(hrc_env.IDS)


def test_nobody_hands_over_alone():
    assert "HRCHandover-v0.alone" not in experts.STUDY.rows
    assert len(experts.STUDY.rows) == 34


def test_a_policy_is_judged_at_the_level_it_learnt_at_but_at_pixels(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "find_interface", lambda agent: Interface())  # no file is read
    trainings = baselines.make_trainings(baselines.BaselinesArguments(tmp_path))
    assert trainings["pixels", "ppo"] == trainings["keypoints", "ppo"]
    assert trainings["none", "ppo"] == trainings["none", "ppo_safety"]
    assert len({each.folder for each in trainings.values()}) == 5
    without = baselines.make_study(trainings)  # before anything has learnt
    assert len(without.rows) == 3 * len(LEVELS)
    assert len(without.shown_tables()[0].rows) == 5 * len(LEVELS)
    trainings["truth", "ppo"].policy.parent.mkdir(parents=True)
    trainings["truth", "ppo"].policy.write_bytes(b"policy")
    assert "truth.ppo" in baselines.make_study(trainings).rows


def points(costs: list[float]) -> list[dict[str, float]]:
    """A curve of a rollout every 50,000 steps; the limit is whole from the fourth on."""
    return [
        {"steps": 5e4 * k, "cost": cost, "goals_per_minute": 30.0, "safety_share": min(k / 4, 1.0)}
        for k, cost in enumerate(costs, 1)
    ]


def test_when_a_limit_was_reached_and_how_well_it_was_held():
    curve = points([20, 20, 20, 60, 50, 32.0] + [27.0] * 5 + [33.0] * 5)
    found = limited.judge_curve(curve, 30.0)
    assert found["learning.reached_at_steps"].value == 3e5
    cost = found["learning.cost"]
    assert (cost.low, cost.high) == (27.0, 33.0)
    assert found["learning.furthest"].value == pytest.approx(0.1)
    never = limited.judge_curve(points([60.0] * 10), 30.0, 1)
    assert never["learning.reached_at_steps"].value == np.inf


def test_an_unknown_task_or_row_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="Did you mean 'HRCReach-v0'"):
        learners.LearnersArguments(tmp_path, ids=("HRCReach",))
    with pytest.raises(ConfigError, match="Unknown row of 'experts'"):
        run_study(experts.STUDY, StudyArguments(tmp_path, only=("HRCReach-v1",)))


@pytest.mark.slow
def test_a_study_goes_on_where_it_was_stopped(tmp_path, monkeypatch):
    asked = StudyArguments(tmp_path, quick=True, only=("HRCReachGoal-v0",), threads=1)
    assert run_study(experts.STUDY, asked) == 0
    made = json.loads((tmp_path / "results.json").read_text())["metrics"]
    assert made["HRCReachGoal-v0.alone.success"]["value"] == 1.0
    assert made["HRCReachGoal-v0.alone.cost"]["value"] == 0.0
    assert made["HRCReachGoal-v0.pixels.seconds"]["value"] == pytest.approx(0.4)
    played = "hrc_env.experiments.study.play_episodes"
    monkeypatch.setattr(played, lambda *of, **_: pytest.fail("played again"))
    run_study(experts.STUDY, asked)
    assert json.loads((tmp_path / "results.json").read_text())["metrics"] == made


@pytest.mark.slow
def test_what_is_learnt_is_judged_and_not_learnt_again(tmp_path, monkeypatch):
    folder = tmp_path / "policy"
    options = {"timesteps": 256, "num-envs": 8, "demonstrations": 0, "task": "HRCReach-v0"}
    training = Training(folder, options)
    training.run()
    monkeypatch.setattr("benchmarks.learning.subprocess", None)
    training.run()
    assert training.score["processor_s"] > 0
    study = learners.make_study({"HRCReach-v0": [training]})
    found = run_experiment(replace(study, n_quick=2).shorten(), tmp_path / "out")
    assert found["HRCReach-v0.scripted.success"].value > 0.8
    learnt = found["HRCReach-v0.learnt.success"].value
    share = learnt / found["HRCReach-v0.scripted.success"].value
    assert found["HRCReach-v0.share_of_expert"].value == pytest.approx(share)
    assert "HRCReach-v0.minutes" in found
    assert COMMANDS["learners"].is_release
