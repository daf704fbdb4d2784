"""Training through the real command line: learn a little, resume, refuse what does not fit."""

import json
import shlex
import shutil
import signal
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from commands import ROOT, called
from matplotlib.figure import Figure

from hrc_env.__main__ import main
from hrc_env.agents import checkpoints
from hrc_env.agents.callbacks import Interrupt, Ramp, TrainingMonitor, plot_curve
from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.agents.requests import TrainingRequest
from hrc_env.agents.training import restore_arguments
from hrc_env.core.errors import CheckpointError, ConfigError
from hrc_env.env import HRCEnv
from hrc_env.evaluation.episodes import evaluate, play_episodes, play_one_by_one

pytestmark = pytest.mark.slow  # learners are trained

TINY = ["--perception", "truth", "--num-envs", "4", "--episodes", "2", "--no-film"]


def train(*words: object) -> subprocess.CompletedProcess[str]:
    return called(ROOT / "train.py", *TINY, *words)


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """A run of two rollouts: untrained, but everything written."""
    folder = tmp_path_factory.mktemp("run") / "tiny"
    done = train("--timesteps", 512, "--out", folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_a_run_leaves_policy_curve_score_and_where_they_came_from(run):
    names = {path.name for path in run.iterdir()}
    assert names >= {
        "policy.zip",
        "curve.json",
        "curve.png",
        "score.json",
        "run.json",
        "tensorboard",
    }
    assert not [name for name in names if "draft" in name]
    record = json.loads((run / "run.json").read_text())
    assert record["arguments"]["timesteps"] == 512
    assert record["versions"]["mujoco"].startswith("4")
    assert 0 <= json.loads((run / "score.json").read_text())["success_rate"] <= 1


def test_resuming_goes_on_where_it_stopped(run):
    before = checkpoints.describe(run / "policy.zip")["num_timesteps"]
    done = train("--timesteps", before + 256, "--resume", run)
    assert done.returncode == 0, done.stderr
    assert checkpoints.describe(run / "policy.zip")["num_timesteps"] == before + 256
    steps = [point["steps"] for point in json.loads((run / "curve.json").read_text())]
    assert steps == sorted(steps)


def test_a_resumed_run_keeps_the_environment_it_learnt_in(tmp_path):
    folder = tmp_path / "reckless"
    train("--timesteps", 256, "--out", folder, "--proximity", 0)
    done = train("--timesteps", 512, "--resume", folder)
    assert done.returncode == 0, done.stderr
    record = json.loads((folder / "run.json").read_text())
    assert record["arguments"]["proximity"] == 0
    assert record["config"]["reward"]["proximity"] == 0


def test_a_second_run_leaves_the_first_alone(run, tmp_path):
    first = tmp_path / "run"
    shutil.copytree(run, first)
    before = (first / "policy.zip").read_bytes()
    assert train("--timesteps", 256, "--out", first).returncode == 0
    assert (first / "policy.zip").read_bytes() == before
    assert (tmp_path / "run-2" / "policy.zip").exists()


def test_resuming_nothing_says_so_without_a_traceback(tmp_path):
    done = train("--resume", tmp_path / "nowhere")
    assert done.returncode == 2
    assert "contains no training run" in done.stderr
    assert "Traceback" not in done.stderr


def here(**kwargs):
    env = HRCEnv(perception="truth", **kwargs)
    return env_info(env.simulation)


def test_a_checkpoint_acts_the_same_every_time(run):
    agent = make_agent(str(run / "policy.zip"), here())
    observation = np.zeros((3, here().layout.low.size), np.float32)
    np.testing.assert_array_equal(agent.act(observation), agent.act(observation))
    assert agent.act(observation).shape == (3, 6)


def test_a_checkpoint_of_another_version_says_so(run, tmp_path):
    other = tmp_path / "old.zip"
    with zipfile.ZipFile(run / "policy.zip") as old, zipfile.ZipFile(other, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "hrc_env.json":
                content = json.dumps({**json.loads(content), "hrc_env": "0.0.9"}).encode()
            new.writestr(name, content)
    with pytest.raises(CheckpointError, match=r"made with hrc_env 0\.0\.9"):
        make_agent(str(other), here())


def test_a_checkpoint_for_another_environment_says_so(run):
    with pytest.raises(CheckpointError, match=r"n_workers, control, observe_images"):
        make_agent(str(run / "policy.zip"), here(n_workers=0))


def test_what_is_no_checkpoint_is_refused(tmp_path):
    junk = tmp_path / "junk.zip"
    junk.write_text("not a zip")
    with pytest.raises(CheckpointError, match="neither a checkpoint"):
        make_agent(str(junk), here())
    with pytest.raises(CheckpointError, match="No checkpoint"):
        make_agent(str(tmp_path / "missing.zip"), here())
    with pytest.raises(ConfigError, match="'scripted_slowed'"):
        make_agent("scriptd", here())


def test_the_scripted_reacher_reaches_without_a_worker():
    score = evaluate(lambda at: make_agent("scripted", at), 16, perception="none", n_workers=0)
    assert score.success_rate >= 0.95
    assert score.contacts_per_episode == 0


def test_yielding_touches_people_less_often():
    """On the same seeds, where people do not yield themselves.

    (It does not come less *near*: a robot that stands still near a worker is in their way, which
    only retreat would mend.)
    """
    reckless, yielding = (
        evaluate(
            lambda at, name=name: make_agent(name, at),
            24,
            perception="keypoints",
            people="unaware",
        )
        for name in ("scripted", "scripted_slowed")
    )
    assert yielding.contacts_per_episode < 0.8 * reckless.contacts_per_episode


def test_the_safety_term_grows_from_nothing_to_all_of_it(tmp_path):
    folder = tmp_path / "careful"
    done = train("--timesteps", 1024, "--out", folder, "--ramp", 512)
    assert done.returncode == 0, done.stderr
    points = json.loads((folder / "curve.json").read_text())
    share = {point["steps"]: point["safety_share"] for point in points}
    assert share[256] == 0.5
    assert share[512] == share[1024] == 1.0


def test_no_ramp_is_the_whole_weight_and_one_backwards_is_refused():
    assert Ramp(0).at(0) == 1.0
    with pytest.raises(ConfigError, match="0 or more"):
        Ramp(-1)


def test_ctrl_c_saves_and_says_how_to_go_on(tmp_path, monkeypatch, capsys):
    """The signal comes after the first rollout; the line that is printed then goes on."""
    folder, before = tmp_path / "stopped", signal.getsignal(signal.SIGINT)
    with monkeypatch.context() as patched:
        patched.setattr(
            TrainingMonitor, "_on_rollout_end", lambda self: signal.raise_signal(signal.SIGINT)
        )
        assert main(["train", *TINY, "--timesteps", "768", "--out", str(folder)]) == 130
    assert signal.getsignal(signal.SIGINT) is before
    said = capsys.readouterr().out.splitlines()[-1]
    assert said.startswith(
        "Stopped at 260 steps; the state is saved. To continue: python -m hrc_env"
    )
    words = shlex.split(said.split("python -m hrc_env ")[1])
    assert words == ["train", "--resume", str(folder), "--timesteps", "768"]
    assert checkpoints.describe(folder / "policy.zip")["num_timesteps"] == 260
    assert not (folder / "score.json").exists()
    assert main([*words, "--episodes", "2", "--no-film"]) == 0
    assert checkpoints.describe(folder / "policy.zip")["num_timesteps"] >= 768
    assert (folder / "score.json").exists()


def test_a_second_ctrl_c_stops_at_once():
    with Interrupt() as interrupt:
        interrupt.listen()
        signal.raise_signal(signal.SIGINT)
        assert interrupt.asked
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_a_run_of_an_older_version_resumes_with_defaults_for_what_it_lacks(run, tmp_path):
    old = tmp_path / "old"
    shutil.copytree(run, old)
    record = json.loads((old / "run.json").read_text())
    del record["arguments"]["scene"]
    record["arguments"]["n_workers"] = [1, 2]
    (old / "run.json").write_text(json.dumps(record))
    again = restore_arguments(TrainingRequest(scene="site", timesteps=10_000, resume=old), old)
    assert (again.scene, again.n_workers, again.perception) == (None, ("1", "2"), "truth")
    assert (again.timesteps, again.resume) == (10_000, old)


def test_a_run_that_has_learnt_enough_says_so(run, capsys):
    assert main(["train", *TINY, "--resume", str(run), "--timesteps", "256"]) == 2
    assert "set --timesteps to a larger number" in " ".join(capsys.readouterr().err.split())


def test_the_learning_curve_is_drawn_over_environment_steps(run, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    scores = dict.fromkeys(("success_rate", "goals_per_minute"), 0.5)
    scores |= dict.fromkeys(("contacts_per_episode", "close_steps_per_episode"), 1.0)
    steps = [100_000.0, 200_000.0]
    points = [{"steps": each, "wall_s": 7.0, "safety_share": 1.0, **scores} for each in steps]
    plot_curve(points, tmp_path / "curve.png", "PPO")
    (figure,) = drawn
    assert all(list(axis.lines[0].get_xdata()) == steps for axis in figure.axes)
    assert figure.axes[-1].get_xlabel() == "environment steps"


def test_one_by_one_or_all_at_once_episodes_are_the_same():
    """What pixels are judged by is what the vector environment counts."""
    alone = play_one_by_one(lambda at: make_agent("scripted", at), 3, 5, perception="truth")
    together = play_episodes(lambda at: make_agent("scripted", at), 3, 5, perception="truth")
    for one, other in zip(alone, together, strict=True):
        assert one == pytest.approx({name: other[name] for name in one}, abs=1e-9, nan_ok=True)
    assert sum(each["contacts"] for each in together) > 0
