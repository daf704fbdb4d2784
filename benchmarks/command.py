"""The command line of the studies in this folder.

It is `python -m benchmarks.NAME [--quick] [--out DIR]`.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import tyro

from hrc_env.cli.checks import check_at_least
from hrc_env.cli.engines import EngineArguments
from hrc_env.cli.entry import show_errors
from hrc_env.cli.options import normalize_words
from hrc_env.cli.show import show
from hrc_env.experiments.runner import run_experiment
from hrc_env.experiments.study import Study


@dataclass(frozen=True)
class Arguments(EngineArguments):
    """Arguments of all experiments; an interrupted run is continued if it uses the same folder."""

    out: Path
    """Folder for results.json, a report and cached results of completed parts."""
    quick: bool = False
    """Compute all numbers from a few episodes."""
    overwrite: bool = False
    """Delete results with other settings in the folder."""


@dataclass(frozen=True)
class StudyArguments(Arguments):
    """Arguments of all studies that simulate whole episodes."""

    only: tuple[str, ...] = ()
    """Rows to run, given by prefixes of their names (default: all)."""
    threads: int | None = None
    """Number of threads that step the environments (default: all cores)."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a number is invalid."""
        check_at_least("--threads", self.threads, 1)


def run_study(study: Study, arguments: StudyArguments) -> int:
    """Run a study with the given arguments and print its report; return the exit status."""
    study = study.select(arguments.only) if arguments.only else study
    study = replace(study.shorten() if arguments.quick else study, threads=arguments.threads)
    run = partial(
        run_experiment, study, overwrite=arguments.overwrite, engine=arguments.choose_engine()
    )
    return show(run, arguments.out, study.name)


def main(make: Callable[[], Study], about: str | None) -> int:
    """Run a study with the arguments of the process; return the exit status.

    Args:
        make: function that creates the study.
        about: docstring of the study's module, which `--help` prints.
    """

    def run() -> int:
        study = make()
        default = StudyArguments(Path("out") / study.name)
        words = normalize_words(StudyArguments, sys.argv[1:], f"python -m benchmarks.{study.name}")
        return run_study(
            study, tyro.cli(StudyArguments, args=words, default=default, description=about)
        )

    return show_errors(run)
