"""`python -m hrc_env` itself: what it says of its commands, and how it refuses."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from hrc_env import __version__
from hrc_env.__main__ import COMMANDS, MOVED, main
from hrc_env.cli.entry import show_errors


def test_the_overview_names_every_command_and_imports_none(process):
    done = process(
        "-c",
        "import sys\n"
        "from hrc_env.__main__ import main\n"
        "assert main(['--help']) == 0 and main(['--version']) == 0\n"
        "heavy = {'tyro', 'rich', 'mujoco', 'numba', 'torch', 'hrc_env.cli.play'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n",
        HRC_ENV_REGISTERED=None,
    )
    assert done.returncode == 0, done.stderr
    for name in COMMANDS:
        assert f"\n  {name} " in done.stdout


def test_the_help_of_a_command_imports_no_simulator(process):
    done = process(
        "-c",
        "import sys\n"
        "from hrc_env.__main__ import COMMANDS, main\n"
        "for name in COMMANDS:\n"
        "    try:\n"
        "        main([name, '--help'])\n"
        "        raise AssertionError(name)\n"
        "    except SystemExit as end:\n"
        "        assert end.code == 0\n"
        "heavy = {'mujoco', 'numba', 'torch', 'stable_baselines3', 'cv2'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n",
        HRC_ENV_REGISTERED=None,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_the_overview_says_of_a_command_what_it_says_of_itself(name: str):
    module, kind, says = COMMANDS[name]
    doc = getattr(import_module(module), kind).__doc__ or ""
    assert " ".join(doc.split("\n\n")[0].split()) == says


def test_versions_are_named(capsys):
    assert main(["--version"]) == 0
    said = capsys.readouterr().out
    assert f"hrc_env {__version__}, Python 3." in said
    for name in ("mujoco 4", "gymnasium 1."):
        assert name in said


def test_a_word_that_is_no_command_is_answered_with_the_nearest(capsys):
    assert main(["plya"]) == 2
    assert "Did you mean 'play'?" in " ".join(capsys.readouterr().err.split())
    assert main([]) == 2
    assert "usage" in capsys.readouterr().out


def test_an_error_is_printed_as_it_is_written(capsys):
    """Square brackets are no markup: names in them would vanish."""
    assert main(["play", "[bold]"]) == 2
    assert "[bold]" in capsys.readouterr().err


WRITING = {
    "demo": ["demo", "--perception", "none", "--out", "{}/film.mp4"],
    "play": ["play", "--perception", "none", "--video", "{}/film.mp4"],
    "train": ["train", "--out", "{}/run"],
    "resume": ["train", "--resume", "{}/run"],
    "experiment": ["experiment", "site", "--quick", "--out", "{}/x"],
    "import-motion": ["import-motion", "walk.bvh", "--out", "{}/walk.npz"],
    "its picture": ["import-motion", "walk.bvh", "--out", "w.npz", "--picture", "{}/walk.png"],
}


@pytest.mark.parametrize("name", WRITING)
def test_a_place_that_cannot_be_written_is_refused_before_the_work(name, tmp_path: Path, capsys):
    blocked = tmp_path / "notes.txt"
    blocked.write_text("a file, and no folder")
    assert main([word.format(blocked) for word in WRITING[name]]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "cannot be written" in said
    assert "Choose another path with --" in said
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


NUMBERS = {
    "--timesteps": "-5", "--num-envs": "0", "--seed": "-1", "--proximity": "nan", "--ramp": "-1",
    "--threads": "0", "--episodes": "0",
}  # fmt: skip


@pytest.mark.parametrize("option", NUMBERS)
def test_training_refuses_numbers_that_mean_nothing(option, tmp_path: Path, capsys):
    words = ["train", "--perception", "truth", "--out", str(tmp_path / "run")]
    assert main([*words, option, NUMBERS[option]]) == 2
    assert f"ConfigError: {option} must be" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [
        ["play", "--episodes", "0"],
        ["play", "--seed", "-1"],
        ["demo", "--seconds", "0"],
        ["demo", "--seed", "-1"],
        ["experiment", "impact", "--seeds", "0"],
        ["train", "--perception", "pixels"],
    ],
)
def test_other_values_that_mean_nothing_are_refused(words, capsys):
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "ConfigError" in said
    assert "Traceback" not in said


@pytest.mark.parametrize(("name", "today"), MOVED.items())
def test_a_command_that_only_a_clone_has_says_how_it_is_called_there(name, today, capsys):
    assert main([name, "--help"]) == 2
    assert today in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("command", [["--help"], ["evaluate", "--help"]])
def test_a_reader_that_ends_early_gets_no_traceback(command: list[str]):
    """As with `python -m hrc_env evaluate --help | head -1`."""
    process = subprocess.Popen(
        [sys.executable, "-m", "hrc_env", *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.close()
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 141
    assert not errors


def test_another_broken_pipe_is_not_hidden():
    """As that of a process that has died."""

    def run() -> int:
        raise BrokenPipeError("the process has ended")

    with pytest.raises(BrokenPipeError, match="the process has ended"):
        show_errors(run)
