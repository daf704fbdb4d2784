"""The arguments of an environment on the command line."""

import inspect
import json
from dataclasses import fields
from pathlib import Path

import gymnasium
import pytest

from hrc_env.__main__ import main
from hrc_env.cli.play import Demo, Play
from hrc_env.cli.train import Train
from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.env_words import EnvironmentArguments, read_cameras, read_config
from hrc_env.safety.config import ShieldConfig
from hrc_env.settings import resolve_settings

OF_RENDER = {"render_mode", "width", "height", "render_markers", "overlay"}
"""What only `render` reads, which no command calls: films have a form of their own."""


def test_commands_take_what_the_environment_takes():
    taken = set(inspect.signature(HRCEnv).parameters) - OF_RENDER
    assert {field.name for field in fields(EnvironmentArguments)} == taken
    for command in (Play, Demo, Train):
        assert issubclass(command, EnvironmentArguments)


def test_nothing_said_is_the_environments_own_default():
    parameters = inspect.signature(HRCEnv).parameters
    assert all(parameters[name].default == value for name, value in Play().keywords().items())


def test_everything_said_reaches_the_environment():
    arguments = EnvironmentArguments(
        perception="keypoints", estimator="kalman", cameras=("camera_2", "0"), scene="site",
        n_workers=("1", "2"), people="hurried", control="tool",
        faults=('{"kind": "late", "cameras": ["camera_2"], "amount": 0.2}',),
        config=("reward.proximity=0.5", "worker=any"), shield='{"kind": "ssm", "margin_m": 0.1}',
    )  # fmt: skip
    keywords = json.loads(json.dumps(arguments.keywords()))  # as a checkpoint keeps them
    env = gymnasium.make("HRCReach-v0", **keywords)
    inner = env.unwrapped
    assert isinstance(inner, HRCEnv)
    simulation, config = inner.simulation, inner.config
    assert [camera.name for camera in simulation.scene.cameras] == ["camera_2", "camera_1"]
    assert (simulation.perception, simulation.settings["estimator"]) == ("keypoints", "kalman")
    assert (simulation.scene.name, simulation.control) == ("site", "tool")
    assert list(simulation.settings["n_workers"]) == [1, 2]
    assert config.motion.people != resolve_settings().config.motion.people
    assert [(fault.kind, fault.max_amount) for fault in config.faults] == [("late", 0.2)]
    assert (config.reward.proximity, config.worker) == (0.5, "any")
    assert simulation.shield.keywords["config"] == ShieldConfig("ssm", margin_m=0.1)
    env.close()


def test_looks_and_clips_are_passed_on():
    keywords = EnvironmentArguments(appearance="varied", motions=(Path("a.npz"),)).keywords()
    assert (keywords["appearance"], keywords["motions"]) == ("varied", ["a.npz"])


def test_cameras_are_a_rig_a_file_or_names_and_numbers():
    assert read_cameras(["lab_gopro"]) == "lab_gopro"
    assert read_cameras(["rig.toml"]) == "rig.toml"
    assert read_cameras(["camera_1"]) == ["camera_1"]
    assert read_cameras(["0", "camera_4"]) == [0, "camera_4"]
    assert read_cameras([]) == []


def test_changes_come_from_words_and_files_and_later_ones_win(tmp_path: Path):
    (tmp_path / "a.toml").write_text("ctrl_dt = 0.08\n[reward]\nsmoothness = 1.0\neffort = 0.1\n")
    (tmp_path / "b.toml").write_text("reward.smoothness = 2.0\n")
    words = [str(tmp_path / "a.toml"), str(tmp_path / "b.toml"), "reward.effort=0.3", "worker=any"]
    config = read_config(words)
    assert config == {
        "ctrl_dt": 0.08,
        "reward": {"smoothness": 2.0, "effort": 0.3},
        "worker": "any",
    }
    assert resolve_settings(config=config).config.reward.smoothness == 2.0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["reward.proximity"], "FIELD=VALUE"),
        (["{}/mine.json"], "a .toml file"),
        (["nowhere.toml"], "cannot be read"),
        (["{}/broken.toml"], "is not valid TOML"),
    ],
)
def test_what_is_no_change_is_refused(words, says, tmp_path: Path):
    (tmp_path / "broken.toml").write_text("reward = [")
    with pytest.raises(ConfigError, match=says):
        read_config([word.format(tmp_path) for word in words])


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--scene", "sit"], "'site'"),
        (["--people", "hurrid"], "'hurried'"),
        (["--estimator", "kalmann"], "'kalman'"),
        (["--control", "tol"], "'tool'"),
        (["--cameras", "camera_9"], "'camera_1'"),
        (["--n-workers", "3", "1"], "(fewest, most)"),
        (["--config", "reward.proximty=0"], "'reward.proximity'"),
        (["--faults", "late"], "JSON objects"),
        (["--motions", "nowhere.npz"], "nowhere.npz"),
        (["--appearance", "varid"], "'varied'"),
        (["--shield", "qpp"], "'qp'"),
        (["--shield", '{"margins_m": 1}'], "'shield.margin_m'"),
    ],
)
def test_a_wrong_word_is_answered_with_what_would_do(words, says, capsys):
    assert main(["play", "--perception", "keypoints", *words]) == 2
    assert says in " ".join(capsys.readouterr().err.split())


def test_play_plays_what_it_was_asked(capsys):
    words = ["play", "--perception", "truth", "--scene", "site", "--n-workers", "2"]
    assert main([*words, "--config", "ctrl_dt=0.08", "--episodes", "2", "--seed", "3"]) == 0
    said = capsys.readouterr().out
    assert "seed 3: return" in said
    assert "seed 4: return" in said


def test_a_film_is_told_with_its_units(tmp_path: Path, monkeypatch, capsys):
    asked: list[dict[str, object]] = []

    def film_episode(make: object, path: Path, seed: int, **kwargs: object) -> dict[str, float]:
        asked.append({"path": path, "seed": seed, **kwargs})
        return {"median tracking error [mm]": 21.3}

    monkeypatch.setattr("hrc_env.evaluation.film.film_episode", film_episode)
    video = tmp_path / "site.mp4"
    words = ["play", "--perception", "none", "--scene", "site", "--control", "tool"]
    assert main([*words, "--config", "ctrl_dt=0.08", "--video", str(video)]) == 0
    assert [word for word in capsys.readouterr().out.split() if word.isalnum() or "." in word] == [
        "unit", "median", "tracking", "error", "21.3", "mm",
    ]  # fmt: skip
    (film,) = asked
    assert (film["path"], film["scene"], film["control"]) == (video, "site", "tool")
    assert film["config"] == {"ctrl_dt": 0.08}


def test_training_weighs_safety_as_config_says_where_both_say():
    assert Train(proximity=0.5).keywords()["config"] == {"reward": {"proximity": 0.5}}
    both = Train(proximity=0.5, config=("reward.proximity=1", "reward.effort=3")).keywords()
    assert both["config"] == {"reward": {"proximity": 1, "effort": 3}}
