"""python -m hrc_env experiment: the paper's experiments, and what the eyes are worth."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import tyro

from hrc_env.cli.bench import show


@dataclass(frozen=True)
class SiteExperiment:
    """The paper's simulation: a walk over the site, single cameras against four."""

    out: Path = Path("out/site")
    """Folder for report.html, results.json and figures; a run that was stopped goes on there."""
    quick: bool = False
    """Every number, from fewer seeds."""
    seeds: int | None = None
    """Walks, instead of 10 (2 if quick)."""
    estimator: tuple[str, ...] = ("particle", "paper")
    """Estimators: python -m hrc_env list."""
    overwrite: bool = False
    """Throw away the results of something else in the folder."""

    def run(self) -> int:
        """Run, show the tables."""
        from hrc_env.experiments.site.experiment import config_for, run

        config = config_for(self.quick, self.seeds, self.estimator)
        written = "report.html, results.json, figures/"
        return show(partial(run, config, overwrite=self.overwrite), self.out, "report.md", written)


@dataclass(frozen=True)
class LabExperiment:
    """The paper's laboratory: all joints, five kinds of motion, one camera against four."""

    out: Path = Path("out/lab")
    """Folder for report.html, results.json and figures; a run that was stopped goes on there."""
    quick: bool = False
    """Every number, from fewer seeds."""
    seeds: int | None = None
    """Films of every motion, instead of 10 (2 if quick)."""
    overwrite: bool = False
    """Throw away the results of something else in the folder."""

    def run(self) -> int:
        """Run, show the tables."""
        from hrc_env.experiments.lab.experiment import config_for, run

        config = config_for(self.quick, self.seeds)
        written = "report.html, results.json, figures/"
        return show(partial(run, config, overwrite=self.overwrite), self.out, "report.md", written)


@dataclass(frozen=True)
class ImpactExperiment:
    """What an estimator is worth in safety: the same robots and workers, other eyes."""

    out: Path = Path("out/impact")
    """Folder for report.html, results.json and figures; a run that was stopped goes on there."""
    quick: bool = False
    """Every number, from fewer episodes."""
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
class Experiment:
    """The paper's two experiments (site, lab), and what the eyes are worth in safety (impact).

    Each takes --quick (minutes) and --out DIR, where it writes report.html, results.json and
    figures; it keeps what is finished when it is stopped, and goes on there.
    """

    what: (
        Annotated[SiteExperiment, tyro.conf.subcommand("site")]
        | Annotated[LabExperiment, tyro.conf.subcommand("lab")]
        | Annotated[ImpactExperiment, tyro.conf.subcommand("impact")]
    )
    """Which experiment."""

    def run(self) -> int:
        """Run it."""
        return self.what.run()
