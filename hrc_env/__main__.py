"""python -m hrc_env: set up, look, play, learn, measure.

A command's own file is imported when it is called, so that this one answers at once.
"""

import os
import platform
import sys
import textwrap
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from hrc_env import __version__
from hrc_env.core.checkout import module_of
from hrc_env.core.errors import ConfigError, HRCError, unknown
from hrc_env.registration import IMPORT, import_files

PROGRAM = "python -m hrc_env"
COMMANDS: dict[str, tuple[str, str, str]] = {
    "setup": (
        "hrc_env.cli.setup", "Setup",
        "Fetch the pose network's weights (once, checked), compile the kernels for this machine, "
        "and see that headless OpenGL works.",
    ),
    "demo": (
        "hrc_env.cli.play", "Demo",
        "Film the scripted reacher, slowed by the separation that it estimates from pixels.",
    ),
    "check": (
        "hrc_env.cli.check", "Check",
        "Versions, machine, OpenGL, kernels, weights, one step: each line ok, or what to do.",
    ),
    "list": (
        "hrc_env.cli.listing", "List",
        "Environments, perception levels, estimators, scenes, cameras and agents by name.",
    ),
    "play": (
        "hrc_env.cli.play", "Play",
        "Play episodes of an environment with an agent; say how they went.",
    ),
    "train": (
        "hrc_env.cli.train", "Train",
        "Train a policy, evaluate it on fixed seeds, draw its curve, film it.",
    ),
    "export": (
        "hrc_env.cli.export", "Export",
        "Make of a run's policy a file that executes nothing, and a card of what it is worth.",
    ),
    "record": (
        "hrc_env.cli.record", "Record",
        "Record an agent's episodes as a Minari data set.",
    ),
    "bench": (
        "benchmarks.commands", "Bench",
        "Measure the estimators (tracking), the detector (perception), the environment (speed) or "
        "the workers (motion).",
    ),
    "experiment": (
        "hrc_env.cli.experiment", "Experiment",
        "The paper's two experiments (site, lab), what perception is worth in safety (impact), "
        "what sight costs at one rate of contacts (price), ablations of rigs and estimators "
        "(ablations).",
    ),
    "benchmark": (
        "hrc_env.cli.benchmark", "Benchmark",
        "Judge a policy on fixed seeds: beside unaware, hurried and attentive people, with four "
        "cameras, late ones, one, and the truth, without and with a shield.",
    ),
    "gallery": (
        "benchmarks.commands", "Gallery",
        "Draw every worker, a film strip of every motion, and both scenes from all cameras.",
    ),
    "import-motion": (
        "hrc_env.cli.import_motion", "ImportMotion",
        "Bring your own motion capture: a BVH, ASF/AMC or npz recording becomes a clip.",
    ),
    "calibrate-keypoints": (
        "assets.emulator.calibrate", "CalibrateKeypoints",
        "Fit the emulator of keypoints to what the pose network says of rendered workers.",
    ),
}  # fmt: skip
"""Each command: its module, its class, and the class's first sentence."""


def main(words: Sequence[str] | None = None) -> int:
    """Run a command, of the process's words if none are given; errors that explain themselves are
    shown without a traceback. Returns the exit status: 2 for what was asked wrongly, 130 for what
    was stopped by Ctrl-C."""
    given = list(sys.argv[1:] if words is None else words)
    if not given or given[0] in ("-h", "--help"):
        print(overview())
        return 0 if given else 2
    if given[0] == "--version":
        print(versions())
        return 0
    try:
        given = _imported(given)
        return _run(given[0], given[1:])
    except HRCError as error:
        from rich.console import Console
        from rich.markup import escape

        name = type(error).__name__
        said = f"[bold red]{name}[/]: {escape(str(error))}"
        Console(stderr=True).print(said, highlight=False, soft_wrap=True)
        return 2
    except KeyboardInterrupt:
        print("Stopped.", file=sys.stderr)
        return 130


def overview() -> str:
    """What there is to call."""
    commands = "\n".join(
        textwrap.fill(f"  {name:21s}{says}", 80, subsequent_indent=" " * 23)
        for name, (_, _, says) in COMMANDS.items()
    )
    return f"""usage: {PROGRAM} [--help] [--version] COMMAND ...

A robot, a worker, and the cameras between them.

{commands}

{PROGRAM} COMMAND --help says what a command takes. Every command takes
--import FILE, too: a Python file that registers a task, an estimator or more."""


def versions() -> str:
    """Which versions of what matters are installed."""
    named = {"hrc_env": __version__, "Python": platform.python_version()}
    named |= {package: version(package) for package in ("mujoco", "gymnasium")}
    return ", ".join(f"{name} {number}" for name, number in named.items())


def _imported(words: list[str]) -> list[str]:
    """The words without `--import FILE`, here or in a process that this one starts imported."""
    while "--import" in words:
        at = words.index("--import")
        if at + 1 == len(words):
            raise ConfigError("--import wants a Python file, as in --import my_task.py.")
        known, file = os.environ.get(IMPORT, ""), str(Path(words[at + 1]).resolve())
        os.environ[IMPORT] = os.pathsep.join(filter(None, (known, file)))
        words = words[:at] + words[at + 2 :]
    import_files()
    if not words:
        raise ConfigError(f"--import goes with a command; {PROGRAM} --help names them.")
    return words


def _run(name: str, words: list[str]) -> int:
    if name not in COMMANDS:
        raise unknown("command", name, COMMANDS)
    import tyro

    module, kind, _ = COMMANDS[name]
    command = tyro.cli(
        getattr(module_of(module), kind),
        prog=f"{PROGRAM} {name}",
        args=words,
        config=(tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes),
    )
    return command.run()


if __name__ == "__main__":
    sys.exit(main())
