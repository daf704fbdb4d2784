"""The bench of the shield, at two of its rows."""

import json

import pytest

from benchmarks import shielded
from hrc_env.safety.incidents import KINDS

pytestmark = pytest.mark.slow  # a study is played

KEPT = ("bare", "one")


def episode(**changes: float) -> dict[str, float]:
    kinds = {f"contacts_{kind}": 0.0 for kind in KINDS}
    return {"seconds": 10.0, "cost": 0.0, "goals_reached": 4.0, **kinds} | changes


def test_rates_and_shares_come_from_the_same_episodes():
    bare = [episode(goals_reached=8.0), episode(goals_reached=8.0), episode(goals_reached=99.0)]
    own = [episode(contacts_towards=1.0, cost=6.0), episode(contacts_standing=1.0)]
    found = {name: each.value for name, each in shielded.counts(own, bare).items()}
    assert found == pytest.approx({
        "share": 0.5, "goals_per_minute": 24.0, "towards": 500.0, "standing": 500.0,
        "fleeing": 0.0, "all": 1000.0, "cost": 3.0,
    })  # fmt: skip


def test_a_row_is_a_share_of_one_before_it():
    names = list(shielded.ROWS)
    for name, row in shielded.ROWS.items():
        assert names.index(row.of) <= names.index(name)
        assert row.n_episodes <= shielded.ROWS[row.of].n_episodes
        assert row.n_episodes % shielded.TOGETHER == 0


def test_a_run_that_was_stopped_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(shielded, "ROWS", {name: shielded.ROWS[name] for name in KEPT})
    arguments = shielded.Arguments(tmp_path, quick=True, threads=1)
    shielded.main(arguments)
    made = json.loads((tmp_path / "results.json").read_text())["metrics"]
    assert made["bare.share"]["value"] == 1.0
    assert made["one.share"]["value"] < 1.0
    monkeypatch.setattr(shielded, "play_episodes", lambda *words, **_: pytest.fail("played again"))
    shielded.main(arguments)
    assert json.loads((tmp_path / "results.json").read_text())["metrics"] == made
