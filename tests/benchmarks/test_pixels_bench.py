"""The benchmark of the detector's settings: ratios are of the same episodes."""

import json

import numpy as np

from benchmarks.speed import pixels


def played(scale: float) -> pixels.Played:
    rng = np.random.default_rng(0)
    return pixels.Played(
        step_ms=[10.0 * scale, 20.0 * scale],
        errors_mm=[scale * rng.uniform(10, 30, 50) for _ in range(2)],
        within=[np.arange(50) < 45, np.arange(50) < 50],
        tracked=[np.ones(10, bool), np.arange(10) < 5],
    )


def test_ratios_are_of_the_same_episodes():
    found = pixels.compute_metrics({"litert": played(1.0), "litert_2": played(0.5)})
    assert found["litert_2.time_ratio"].value == found["litert_2.time_ratio"].high == 0.5
    assert found["litert_2.error_ratio"].value == 0.5
    assert found["litert.coverage"].value == 0.95
    assert found["litert.tracked"].value == 0.75
    assert found["litert.error_mm"].n == 2


def test_a_short_run_writes_its_numbers(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(pixels, "is_available", lambda each: not each)
    assert pixels.main(pixels.Arguments(tmp_path, episodes=1, steps=pixels.SETTLED + 2)) == 0
    written = json.loads((tmp_path / "results.json").read_text())
    assert written["metrics"].keys() == {
        f"litert.{name}" for name in ("step_ms", "time_ratio", "error_mm", "error_ratio", "p95_mm",
                                      "coverage", "tracked")
    }  # fmt: skip
    assert written["metrics"]["litert.step_ms"]["value"] > 0
    said = capsys.readouterr().out
    assert "| every image, LiteRT |" in said.replace("  ", "")
    assert "OpenVINO is not installed" in said
