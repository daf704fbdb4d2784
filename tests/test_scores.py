"""What episodes come to: attempts beside successes, and the weight that a run has reached."""

import json

import numpy as np
import pytest

from hrc_env.evaluation.episodes import describe_contradiction, summarize
from hrc_env.evaluation.sums import STATISTICS

pytest.importorskip("torch")
from matplotlib.figure import Figure

from hrc_env.__main__ import main
from hrc_env.agents.callbacks import plot_curve
from hrc_env.agents.training import describe_weight


def episode(reached: float, missed: float, success: float) -> dict[str, float]:
    other = dict.fromkeys(STATISTICS, 0.0)
    counts = {"goals_reached": reached, "goals_missed": missed, "success": success}
    return {**other, **counts, "seconds": 10.0}


def test_attempts_and_successes_are_two_numbers():
    score = summarize([episode(3, 1, 0), episode(1, 0, 1)])
    assert (score.success_rate, score.is_success) == (0.8, 0.5)


def test_a_task_that_never_succeeded_is_told():
    """Which was reported as a success of 1."""
    never = summarize([episode(3, 0, 0), episode(2, 0, 0)])
    assert (never.success_rate, never.is_success) == (1.0, 0.0)
    assert "100% of the attempts were achieved" in describe_contradiction(never)
    assert describe_contradiction(summarize([episode(3, 0, 0), episode(2, 0, 1)])) == ""
    assert describe_contradiction(summarize([episode(0, 4, 0)])) == ""


def test_a_curve_says_the_weight_that_was_reached():
    assert describe_weight([{"proximity": 0.5}], 2.0) == (
        "proximity weight 0.5 of 2: the ramp was not finished"
    )
    assert describe_weight([{"proximity": 2.0}], 2.0) == "proximity weight 2"
    assert describe_weight([], 2.0) == "proximity weight 2"


def test_a_curve_shows_successes_beside_attempts(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    names = ("goals_per_minute", "contacts_per_episode", "close_steps_per_episode")
    points = [
        {"steps": 1e5 * k, "success_rate": 1.0, "is_success": 0.25, **dict.fromkeys(names, 1.0)}
        for k in (1, 2)
    ]
    plot_curve(points, tmp_path / "curve.png", "PPO")
    lines = [line.get_ydata() for line in drawn[0].axes[0].lines]
    np.testing.assert_array_equal(lines, [[1.0, 1.0], [0.25, 0.25]])


@pytest.mark.slow  # a learner is trained
def test_training_says_both_and_the_weight_in_force(tmp_path, capsys):
    words = ["--perception", "none", "--num-envs", "4", "--episodes", "2", "--film", "False"]
    out = tmp_path / "run"
    assert main(["train", *words, "--timesteps", "512", "--ramp", "1024", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "success_rate, of attempts" in said
    assert "is_success, of episodes" in said
    last = json.loads((out / "curve.json").read_text())[-1]
    assert last["proximity"] == 2.0 * 256 / 1024  # when the last rollout began
    assert 0 <= json.loads((out / "score.json").read_text())["is_success"] <= 1
