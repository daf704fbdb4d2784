"""Runs of `train --engine ray` through the command line: as others, and gone on with by both."""

import json
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from commands import ROOT, called

import hrc_env
from hrc_env.__main__ import main
from hrc_env.agents.requests import TrainingRequest
from hrc_env.agents.rllib.runner_env import make_envs
from hrc_env.sb3 import HRCVecEnv

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
    assert "--engine" not in card_of(run, tmp_path / "by_both")["command"]
    both = steps_of(run)
    assert both[: len(learnt)] == learnt
    assert both[-1] >= 800
    last = train("--engine", "ray", "--workers", "1", "--timesteps", 1200, "--resume", run)
    assert last.returncode == 0, last.stderr
    assert steps_of(run)[-1] >= 1200
    assert not (tmp_path / "run-2").exists()
    card = card_of(run, tmp_path / "by_ray")
    assert "--num-envs 4 --engine ray --workers 1" in card["command"]
    assert card["timesteps"] == steps_of(run)[-1]
    assert card["worth"][0]["episodes"] == 2


def test_a_policy_of_level_pixels_is_judged_there(weights):
    asked = TrainingRequest(perception="pixels", engine="ray")
    assert hrc_env.evaluate("random", 1, max_episode_steps=2, **asked.keywords()).episodes == 1
    with closing(HRCVecEnv(1, **asked.batched_keywords())) as env:
        spaces = env.observation_space, env.action_space
    with closing(make_envs(1, asked.keywords())) as env:
        assert (env.single_observation_space, env.single_action_space) == spaces


def steps_of(run: Path) -> list[float]:
    """Steps at the points of the curve."""
    return [point["steps"] for point in json.loads((run / "curve.json").read_text())]


def card_of(run: Path, out: Path) -> dict[str, Any]:
    """The card of a run's policy, as `export` writes it."""
    assert main(["export", str(run), "--name", "mine", "--episodes", "2", "--out", str(out)]) == 0
    path = out / "HRCReach-v0" / "mine.safetensors"
    assert hrc_env.evaluate(str(path), 1, perception="truth").episodes == 1
    return json.loads(path.with_suffix(".json").read_text())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--engine", "ray", "--algorithm", "sac"], "--engine ray supports only ppo"),
        (
            ["--engine", "ray", "--cost-limit", "3", "--algorithm", "ppo_lagrangian"],
            "supports only ppo",
        ),
        (["--engine", "ray", "--workers", "0"], "--workers must be 1 or more"),
        (["--engine", "ry"], "Did you mean 'ray'"),
        (["--workers", "2"], "--workers requires --engine ray"),
        (["--address", "auto"], "--address requires --engine ray"),
        (["--perception", "pixels"], "or use --engine ray"),
        (["--engine", "ray", "--address", "nowhere"], "must be auto, HOST:PORT"),
    ],
)
def test_what_the_engine_cannot_do_is_said(words, said, tmp_path, capsys):
    assert main(["train", *words, "--no-film", "--out", str(tmp_path / "run")]) == 2
    assert said in " ".join(capsys.readouterr().err.split())
