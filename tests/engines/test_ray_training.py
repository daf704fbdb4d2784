"""Runs of `train --engine ray` through the command line: as others, and gone on with by both."""

import json
from pathlib import Path

import pytest
from commands import ROOT, called

from hrc_env.__main__ import main

pytestmark = pytest.mark.slow

TINY = ["--num-envs", "4", "--episodes", "2", "--no-film"]


def train(*words: object):
    return called(ROOT / "train.py", *TINY, *words)


def test_a_run_is_gone_on_with_by_both_libraries(tmp_path):
    run = tmp_path / "run"
    done = train("--engine", "ray", "--workers", "1", "--timesteps", 400, "--out", run)
    assert done.returncode == 0, done.stderr
    assert {"policy.zip", "curve.json", "score.json", "run.json", "tensorboard"} <= {
        path.name for path in run.iterdir()
    }
    learnt = steps_of(run)
    assert learnt[-1] >= 400
    again = train("--timesteps", 800, "--resume", run)
    assert again.returncode == 0, again.stderr
    both = steps_of(run)
    assert both[: len(learnt)] == learnt
    assert both[-1] >= 800
    last = train("--engine", "ray", "--timesteps", 1200, "--resume", run)
    assert last.returncode == 0, last.stderr
    assert steps_of(run)[-1] >= 1200
    assert not (tmp_path / "run-2").exists()


def steps_of(run: Path) -> list[float]:
    """Steps at the points of the curve."""
    return [point["steps"] for point in json.loads((run / "curve.json").read_text())]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--engine", "ray", "--algorithm", "sac"], "--engine ray trains with ppo only"),
        (
            ["--engine", "ray", "--cost-limit", "3", "--algorithm", "ppo_lagrangian"],
            "trains with ppo only",
        ),
        (["--engine", "ray", "--workers", "0"], "--workers must be 1 or more"),
        (["--engine", "ry"], "Did you mean 'ray'"),
        (["--workers", "2"], "--workers needs --engine ray"),
        (["--address", "auto"], "--address needs --engine ray"),
        (["--perception", "pixels"], "or --engine ray"),
        (["--engine", "ray", "--address", "nowhere"], "must be auto, HOST:PORT"),
    ],
)
def test_what_the_engine_cannot_do_is_said(words, said, tmp_path, capsys):
    assert main(["train", *words, "--no-film", "--out", str(tmp_path / "run")]) == 2
    assert said in " ".join(capsys.readouterr().err.split())
