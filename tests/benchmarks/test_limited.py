"""The bench of learning with a limit, at policies that have hardly learnt."""

import json

import numpy as np
import pytest

from benchmarks import limited

pytestmark = pytest.mark.slow  # a study is played


def points(costs: list[float]) -> list[dict[str, float]]:
    """A curve of a rollout every 50,000 steps; the limit is whole from the fourth on."""
    return [
        {"steps": 5e4 * k, "cost": cost, "goals_per_minute": 30.0, "safety_share": min(k / 4, 1.0)}
        for k, cost in enumerate(costs, 1)
    ]


def test_when_a_limit_was_reached_and_how_well_it_was_held():
    found = limited.held(points([20, 20, 20, 60, 50, 32.0] + [27.0] * 5 + [33.0] * 5), 30.0, 2)
    assert found["reached_at_steps"].value == 3e5
    assert (found["cost"].low, found["cost"].high) == (27.0, 33.0)
    assert found["furthest"].value == pytest.approx(0.1)
    assert limited.held(points([60.0] * 10), 30.0, 1)["reached_at_steps"].value == np.inf


def test_both_ways_are_learnt_and_judged_and_go_on(tmp_path, monkeypatch):
    arguments = limited.Arguments(
        tmp_path, seeds=(0,), timesteps=8192, fast_timesteps=4096, shields=(), episodes=2
    )
    limited.main(arguments)
    made = json.loads((tmp_path / "results.json").read_text())["metrics"]
    assert made["fast_0.none.cost_per_episode"]["n"] == 2
    assert made["limited_0.goals_per_minute"]["value"] >= 0
    assert made["seed_0.furthest"]["n"] == 1
    monkeypatch.setattr(limited, "subprocess", None)
    limited.main(arguments)
