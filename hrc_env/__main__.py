"""Command-line interface `python -m hrc_env` for setup, playing, training and evaluation.

The module of a command is imported only when the command is called, which keeps the start fast.
"""

import platform
import sys
import textwrap
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version

from hrc_env import __version__
from hrc_env.cli.entry import import_first, run_command, show_errors
from hrc_env.core.errors import ConfigError, make_unknown_name_error

PROGRAM = "python -m hrc_env"
COMMANDS: dict[str, tuple[str, str, str]] = {
    "setup": (
        "hrc_env.cli.setup", "Setup",
        "Download the weights of the pose network, compile the kernels and check headless OpenGL.",
    ),
    "demo": (
        "hrc_env.cli.play", "Demo",
        "Film a scripted robot that detects a person in rendered images and slows down near them.",
    ),
    "check": (
        "hrc_env.cli.check", "Check",
        "Check versions, machine, OpenGL, kernels, weights and one step of an environment.",
    ),
    "list": (
        "hrc_env.cli.listing", "List",
        "List the valid names for arguments: tasks, perception levels, robots, agents and others.",
    ),
    "play": (
        "hrc_env.cli.play", "Play",
        "Play episodes of an environment with an agent and print their scores.",
    ),
    "evaluate": (
        "hrc_env.cli.evaluate", "Evaluate",
        "Evaluate an agent over whole episodes with fixed seeds: goals, contacts and cost.",
    ),
    "train": (
        "hrc_env.cli.train", "Train",
        "Train a policy, evaluate it on fixed seeds, plot its learning curve and record a video.",
    ),
    "export": (
        "hrc_env.cli.export", "Export",
        "Export a run's policy and a model card with its scores; loading the file executes no "
        "code.",
    ),
    "record": (
        "hrc_env.cli.record", "Record",
        "Record an agent's episodes as a Minari data set or in a folder.",
    ),
    "experiment": (
        "hrc_env.cli.experiment", "Experiment",
        "Run an experiment of the paper or an additional one.",
    ),
    "benchmark": (
        "hrc_env.cli.benchmark", "Benchmark",
        "Evaluate a policy on fixed seeds in the setups of the benchmark.",
    ),
    "judge": (
        "hrc_env.cli.benchmark", "Judge",
        "Judge an entry of the leaderboard on fresh seeds.",
    ),
    "import-motion": (
        "hrc_env.cli.import_motion", "ImportMotion",
        "Convert a motion-capture recording (BVH, ASF/AMC or npz) into a clip that workers play.",
    ),
}  # fmt: skip
"""Module and class of each command, and the first sentence of the class's docstring, by name."""
MOVED = {
    "bench": "python -m benchmarks",
    "gallery": "python -m benchmarks gallery",
    "calibrate-keypoints": "python -m assets.emulator.calibrate",
}
"""Replacements of former commands, by former name. They require a clone of the repository."""


def main(words: Sequence[str] | None = None) -> int:
    """Run a command, and show errors of the package without a traceback.

    Args:
        words: the command and its options; None for the arguments of this process.

    Returns:
        The exit status: 2 for a wrong command or option, 130 after Ctrl-C.
    """
    given = list(sys.argv[1:] if words is None else words)
    return show_errors(lambda: _answer(given))


def overview() -> str:
    """Return the help text of the program, which lists its commands."""
    commands = "\n".join(
        textwrap.fill(f"  {name:21s}{purpose}", 80, subsequent_indent=" " * 23)
        for name, (_, _, purpose) in COMMANDS.items()
    )
    return f"""usage: {PROGRAM} [--help] [--version] COMMAND ...

Reinforcement learning of robots that observe people only through cameras.

{commands}

{PROGRAM} COMMAND --help lists the options of a command. Every command also
takes --import FILE, a Python file that registers custom parts."""


def versions() -> str:
    """Return the installed versions of the package and its main libraries."""
    named = {"hrc_env": __version__, "Python": platform.python_version()}
    named |= {package: version(package) for package in ("mujoco", "gymnasium")}
    return ", ".join(f"{name} {number}" for name, number in named.items())


def _answer(given: Sequence[str]) -> int:
    """Print help or versions, or run a command; return the exit status."""
    if not given or given[0] in ("-h", "--help"):
        print(overview())
        return 0 if given else 2
    if given[0] == "--version":
        print(versions())
        return 0
    return _run(*import_first(given, PROGRAM))


def _run(name: str, *words: str) -> int:
    if name in MOVED:
        raise ConfigError(f"{name} is, in a clone of the repository: {MOVED[name]}")
    if name not in COMMANDS:
        raise make_unknown_name_error("command", name, COMMANDS)
    module, command, _ = COMMANDS[name]
    return run_command(getattr(import_module(module), command), words, f"{PROGRAM} {name}")


if __name__ == "__main__":
    sys.exit(main())
