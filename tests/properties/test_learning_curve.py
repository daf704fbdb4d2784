"""PPO learns the reach task on the emulator, by the command that the documentation names."""

import json

import pytest
from figures import Figure

from hrc_env.core.results import Metric

SEEDS = (49, 50)
"""Bounds come from seeds 0 to 2, which reached the share after 70,000 to 74,000 steps."""
GOOD = 0.8
"""Share of the goals of the last 64 episodes, with the noisy actions of learning."""
TIMESTEPS = 150_000


@pytest.mark.long
@pytest.mark.parametrize("seed", SEEDS)
def test_most_goals_are_reached_after_few_steps(seed, process, tmp_path, figures):
    done = process("-m", "hrc_env", "train", "--no-film", "--seed", seed, "--out", tmp_path / "run",
                   "--timesteps", TIMESTEPS, "--episodes", 64)  # fmt: skip
    assert done.returncode == 0, done.stderr
    curve = json.loads((tmp_path / "run" / "curve.json").read_text())
    steps = [point["steps"] for point in curve if point["success_rate"] >= GOOD]
    first = float(min(steps, default=float("inf")))
    figures.hold(Figure(f"learning.{seed}.steps_to_80_percent",
                        Metric(first, first, first, "steps", 1), most=120_000))  # fmt: skip
