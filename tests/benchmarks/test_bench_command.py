"""`python -m benchmarks` as people call it."""

from pathlib import Path

import pytest
from commands import ROOT, called

BENCHMARKS, CALIBRATE = ROOT / "benchmarks" / "__main__.py", ROOT / "assets/emulator/calibrate.py"


def test_help_says_what_it_writes_and_how_long_it_takes():
    done = called(BENCHMARKS, "--help")
    assert done.returncode == 0
    for word in ("tracking", "gallery", "--quick", "--out", "minutes", "results.json"):
        assert word in done.stdout


def test_an_unknown_bench_is_answered_with_the_known_ones():
    done = called(BENCHMARKS, "trakcing")
    assert done.returncode == 2
    assert "tracking" in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("script", "words"),
    [
        (BENCHMARKS, ["tracking", "--quick", "--out", "{}"]),
        (BENCHMARKS, ["perception", "--quick", "--out", "{}"]),
        (BENCHMARKS, ["speed", "--quick", "--out", "{}"]),
        (BENCHMARKS, ["peers", "--quick", "--out", "{}"]),
        (BENCHMARKS, ["motion", "--quick", "--out", "{}/x/y"]),
        (BENCHMARKS, ["gallery", "--out", "{}"]),
        (CALIBRATE, ["--quick", "--out", "{}/keypoints.json"]),
    ],
)
def test_a_place_that_cannot_be_written_is_refused_before_the_work(script, words, tmp_path: Path):
    blocked = tmp_path / "notes.txt"
    blocked.write_text("a file, and no folder")
    done = called(script, *(word.format(blocked) for word in words))
    assert done.returncode == 2
    assert "cannot be written" in " ".join(done.stderr.split())
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("script", "words"),
    [
        (BENCHMARKS, ["motion", "--seeds", "0"]),
        (BENCHMARKS, ["tracking", "--engine", "processes", "--workers", "0"]),
        (BENCHMARKS, ["speed", "--rounds", "0"]),
        (BENCHMARKS, ["peers", "--rounds", "0"]),
        (CALIBRATE, ["--rounds", "-1"]),
    ],
)
def test_values_that_mean_nothing_are_refused(script, words):
    done = called(script, *words)
    assert done.returncode == 2
    assert "ConfigError" in done.stderr
    assert "Traceback" not in done.stderr
