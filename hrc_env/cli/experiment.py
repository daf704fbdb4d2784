"""python -m hrc_env experiment: what the eyes are worth."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import tyro

from hrc_env.cli.bench import show


@dataclass(frozen=True)
class ImpactExperiment:
    """What an estimator is worth in safety: the same robots and workers, other eyes."""

    out: Path = Path("out/impact")
    """Folder for report.html, results.json and figures; a run that was stopped goes on there."""
    quick: bool = False
    """Every number, from fewer episodes, in less than four minutes."""
    seeds: int | None = None
    """Episodes of every row, instead of 200 (16 if quick)."""
    overwrite: bool = False
    """Throw away the results of something else in the folder."""

    def run(self) -> int:
        """Run, show the tables."""
        from hrc_env.experiments.impact.experiment import config_for, run

        config = config_for(self.quick, self.seeds)
        written = "report.html, results.json, figures/"
        return show(partial(run, config, overwrite=self.overwrite), self.out, "report.md", written)


@dataclass(frozen=True)
class Experiment(ImpactExperiment):
    """What the eyes are worth in safety (impact): report.html, results.json and figures.

    What is finished is kept when it is stopped, and it goes on there.
    """

    what: tyro.conf.Positional[Literal["impact"]] = "impact"
    """Which experiment."""
