"""The baselines' command, at one level, with policies that have hardly learnt."""

import json
from types import SimpleNamespace

import pytest

from benchmarks import baselines
from docs import tables
from hrc_env.core.results import Metric
from hrc_env.evaluation.episodes import measure

pytestmark = pytest.mark.slow  # a study is played


def episode(**changes: float) -> dict[str, float]:
    return {"r": 1.0, "seconds": 10.0, "goals_reached": 2.0, "cost": 0.0, "contacts": 0.0} | changes


def test_what_an_agent_is_worth_comes_from_its_episodes():
    done = [episode(), episode(r=4.0, cost=6.0, contacts=2.0), episode(r=1.0, goals_reached=5.0)]
    worth = measure(done)
    assert {name: each.value for name, each in worth.items()} == pytest.approx(
        {
            "return": 2.0,
            "goals_per_minute": 9 / 0.5,
            "cost_per_episode": 2.0,
            "contacts_per_episode": 2 / 3,
        }
    )
    assert worth["return"].low < 2.0 < worth["return"].high
    assert isinstance(worth["return"], Metric)


@pytest.fixture(scope="module")
def end_to_end(tmp_path_factory):
    """One level, two episodes; the folder, what was written, and what a second run trains."""
    out = tmp_path_factory.mktemp("baselines")
    arguments = baselines.Arguments(out=out, episodes=2, timesteps=256, threads=1)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(baselines, "ORDER", ("truth",))
        baselines.main(arguments)
        first = (out / "results.json").read_text()
        trained: list[object] = []
        no_process = SimpleNamespace(run=lambda *words, **_: trained.append(words))
        patched.setattr(baselines, "subprocess", no_process)
        patched.setattr(baselines, "play_episodes", lambda *words, **_: trained.append(words))
        baselines.main(arguments)
    return out, json.loads(first), trained


def test_every_agent_gets_a_row_with_intervals_and_where_it_came_from(end_to_end):
    out, results, _ = end_to_end
    for agent in ("random", "scripted", "scripted_slowed", "ppo", "ppo_safety"):
        for key in ("return", "goals_per_minute", "cost_per_episode", "contacts_per_episode"):
            metric = results["metrics"][f"truth.{agent}.{key}"]
            assert metric["low"] <= metric["value"] <= metric["high"]
            assert metric["n"] == 2
    asked = tables.asked(tables.read("baselines"))
    assert {name for name in asked if name.startswith("truth.")} <= results["metrics"].keys()
    assert results["config"]["timesteps"] == 256
    assert results["versions"]["mujoco"].startswith("4")
    assert (out / "report.md").read_text().count("| `truth`, ") == 5


def test_scripted_reaches_more_goals_than_chance(end_to_end):
    metrics = end_to_end[1]["metrics"]
    scripted, chance = (metrics[f"truth.{name}.return"] for name in ("scripted", "random"))
    assert scripted["value"] > chance["value"]


def test_what_is_there_is_neither_learnt_nor_played_again(end_to_end):
    out, results, trained = end_to_end
    assert trained == []
    assert json.loads((out / "results.json").read_text())["metrics"] == results["metrics"]
