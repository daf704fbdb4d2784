"""The scripted agents' command, at one task without and with pixels."""

import json

import pytest

from benchmarks import experts
from hrc_env.core.errors import ConfigError

pytestmark = pytest.mark.slow  # a study is played

TASK = "HRCReachGoal-v0"


def episode(**changes: float) -> dict[str, float]:
    return {"success": 1.0, "seconds": 10.0, "cost": 0.0, "contacts": 0.0} | changes


def test_what_an_agent_is_worth_comes_from_its_episodes():
    worth = experts.worth([episode(), episode(success=0.0, cost=6.0), episode(seconds=4.0)])
    found = {name: each.value for name, each in worth.items()}
    assert found == pytest.approx({"success": 2 / 3, "seconds": 8.0, "cost": 2.0, "contacts": 0.0})
    assert worth["success"].low < 0.5 < worth["success"].high < 1.0


def test_a_run_that_was_stopped_goes_on(tmp_path):
    arguments = experts.Arguments(tmp_path, quick=True, tasks=(TASK,), threads=1)
    experts.main(arguments)
    first = (tmp_path / "results.json").read_text()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experts, "play_episodes", lambda *words, **_: pytest.fail("played again"))
        experts.main(arguments)
    made = json.loads(first)["metrics"]
    assert json.loads((tmp_path / "results.json").read_text())["metrics"] == made
    assert made[f"{TASK}.alone.success"]["value"] == 1.0
    assert made[f"{TASK}.alone.cost"]["value"] == 0.0
    assert made[f"{TASK}.pixels.seconds"]["value"] == pytest.approx(0.4)


def test_nobody_hands_over_alone():
    assert ("HRCHandover-v0", "alone") not in experts.ROWS
    assert len(experts.ROWS) == 34


@pytest.mark.parametrize("words", [{"tasks": ("HRCReach",)}, {"ways": ("lidar",)}])
def test_unknown_names_are_refused(words, tmp_path):
    with pytest.raises(ConfigError, match=r"HRCReach-v0|keypoints"):
        experts.main(experts.Arguments(tmp_path, **words))
