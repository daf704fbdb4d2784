"""The learners' command, at one task and a policy that has hardly learnt."""

import json
from types import SimpleNamespace

import pytest

from benchmarks import learners

pytestmark = pytest.mark.slow  # a study is played


def test_a_task_is_learnt_and_judged_and_goes_on(tmp_path, monkeypatch):
    arguments = learners.Arguments(tmp_path, ids=("HRCReach-v0",), quick=True)
    learners.main(arguments)
    made = json.loads((tmp_path / "results.json").read_text())["metrics"]
    assert made["HRCReach-v0.scripted.success"]["value"] > 0.8
    assert made["HRCReach-v0.learnt.success"]["value"] < 0.8
    share = made["HRCReach-v0.share_of_expert"]["value"]
    learnt, scripted = (
        made[f"HRCReach-v0.{who}.success"]["value"] for who in ("learnt", "scripted")
    )
    assert share == pytest.approx(learnt / scripted)
    monkeypatch.setattr(learners, "play_episodes", lambda *of, **_: pytest.fail("played again"))
    again = SimpleNamespace(run=lambda *of, **_: pytest.fail("learnt again"))
    monkeypatch.setattr(learners, "subprocess", again)
    learners.main(arguments)
