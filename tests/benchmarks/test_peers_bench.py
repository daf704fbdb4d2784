"""The benchmark of peers: every row has its numbers, and a start is measured with its children."""

import sys
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.speed import peers
from hrc_env.core.errors import HRCError
from hrc_env.experiments.runner import run_experiment

TINY = peers.PeersBench(n_rounds=2, least_steps=1, pixel_episodes=0, n_starts=0)


def test_every_row_has_its_numbers(tmp_path):
    metrics = run_experiment(TINY, tmp_path, lambda share, label: None)
    without = {"pixels"} | ({"panda"} if find_spec("envpool") is None else set())
    for name in peers.ROWS.keys() - without:
        assert metrics[f"steps_per_cpu_s.{name}"].value > 0
        assert metrics[f"of_reacher.{name}"].n == 2
    assert metrics["of_reacher.reacher"].value == 1.0
    said = (tmp_path / "report.md").read_text()
    assert "Pusher-v5 | one" in said
    assert "Quick run, 2 rounds" in said
    assert "First start" not in said


def test_ratios_are_of_the_same_round():
    found = peers.compute_metrics(
        {"steps_per_cpu_s.reacher": [100.0, 50.0], "steps_per_cpu_s.truth": [50.0, 50.0]}
    )
    ratio = found["of_reacher.truth"]
    assert (ratio.low, ratio.high) == (0.5, 1.0)


def test_a_step_that_resets_an_environment_of_envpool_is_no_step(monkeypatch):
    """Which stands in for EnvPool: four environments whose episodes end in every second step."""
    steps = iter(range(100))
    ends = lambda: np.full(4, next(steps) % 2 == 1)  # noqa: E731
    pool = SimpleNamespace(
        action_space=SimpleNamespace(shape=(8,)),
        reset=lambda: None,
        step=lambda action: (None, None, ends(), np.zeros(4, bool), {"a": action}),
    )
    made = SimpleNamespace(make=lambda *_, **__: pool)
    monkeypatch.setitem(sys.modules, "envpool", made)
    assert peers.Pool("PandaPickCube-v1", 4, 1).run_steps(6).env_steps == 4 * (6 - 2)


def test_a_start_is_measured_with_its_children(monkeypatch, tmp_path):
    burn = "sum(range(30_000_000))"
    start = peers.START.splitlines()[1:]
    program = "\n".join([
        start[0] + ", subprocess, sys", f"subprocess.run([sys.executable, '-c', '{burn}'])",
        *start[-2:],
    ])  # fmt: skip
    monkeypatch.setattr(peers, "START", program)
    assert peers.measure_start(tmp_path) > 0.2
    monkeypatch.setattr(peers, "START", "import sys; sys.exit('no display')")
    with pytest.raises(HRCError, match="no display"):
        peers.measure_start(tmp_path)
