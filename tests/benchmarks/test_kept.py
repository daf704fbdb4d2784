"""What kept policies are worth, at one of them."""

import json

import pytest

import hrc_env
from benchmarks import kept
from hrc_env.agents import policies
from hrc_env.evaluation.sums import ACHIEVED, FAILED

pytestmark = pytest.mark.slow  # a study is played


def test_every_policy_of_the_package_is_judged_with_and_without_a_shield():
    found = {(row.address, row.shield) for row in kept.rows()}
    assert found == {(name, shield) for name in policies.names() for shield in (None, "qp")}
    assert {address.split("/")[2] for address, _ in found} == set(hrc_env.IDS)


def test_scores_are_shares_of_all_tries_and_rates():
    one = {"seconds": 30.0, "cost": 4.0, "contacts": 1.0, "contacts_towards": 1.0, ACHIEVED: 3.0}
    two = {"seconds": 30.0, "cost": 0.0, "contacts": 0.0, "contacts_towards": 0.0, ACHIEVED: 0.0}
    found = kept.score([one | {FAILED: 0.0}, two | {FAILED: 1.0}])
    values = {name: each.value for name, each in found.items()}
    assert values == pytest.approx({
        "success": 0.75, "goals_per_minute": 3.0, "cost": 2.0, "contacts": 0.5, "towards": 500.0,
    })  # fmt: skip


def test_a_run_that_was_stopped_goes_on(tmp_path, monkeypatch):
    rows = [row for row in kept.rows() if "HRCReach-v0" in row.address][:2]
    monkeypatch.setattr(kept, "rows", lambda: rows)
    arguments = kept.Arguments(tmp_path, quick=True, threads=1)
    kept.main(arguments)
    made = json.loads((tmp_path / "results.json").read_text())["metrics"]
    assert made[f"{rows[0].name}.goals_per_minute"]["value"] > 20
    monkeypatch.setattr(kept, "play_episodes", lambda *words, **_: pytest.fail("played again"))
    kept.main(arguments)
    assert json.loads((tmp_path / "results.json").read_text())["metrics"] == made
