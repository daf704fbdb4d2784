"""python -m hrc_env experiment: the paper's experiments, what the eyes are worth, and beyond."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import tyro

from hrc_env.cli.checks import at_least
from hrc_env.cli.progress import show


@dataclass(frozen=True)
class AnyExperiment:
    """What every experiment is asked."""

    out: Path
    """Folder for report.html, results.json and figures; a run that was stopped goes on there."""
    quick: bool = False
    """Every number, from fewer seeds."""
    seeds: int | None = None
    """How many seeds."""
    overwrite: bool = False
    """Throw away the results of something else in the folder."""

    def shown(self, run: Callable[..., object]) -> int:
        """Run `run(folder, say, overwrite=...)`, show the tables."""
        at_least("--seeds", self.seeds, 1)
        written = "report.html, results.json, figures/"
        return show(partial(run, overwrite=self.overwrite), self.out, "experiment", written)


@dataclass(frozen=True)
class SiteExperiment(AnyExperiment):
    """The paper's simulation: a walk over the site, single cameras against four."""

    out: Path = Path("out/site")
    seeds: int | None = None
    """Walks, instead of 10 (2 if quick)."""
    estimator: tuple[str, ...] = ("particle", "paper")
    """Estimators: python -m hrc_env list."""

    def run(self) -> int:
        """Run, show the tables."""
        from hrc_env.experiments.site.experiment import config_for, run

        return self.shown(partial(run, config_for(self.quick, self.seeds, self.estimator)))


@dataclass(frozen=True)
class LabExperiment(AnyExperiment):
    """The paper's laboratory: all joints, five kinds of motion, one camera against four."""

    out: Path = Path("out/lab")
    seeds: int | None = None
    """Films of every motion, instead of 10 (2 if quick)."""
    folded: str = "full"
    """The landmark network for workers who are folded up: full, or heavy, which is fetched once
    with `python -m hrc_env setup --networks heavy`."""

    def run(self) -> int:
        """Run, show the tables."""
        from hrc_env.experiments.lab.experiment import config_for, run

        return self.shown(partial(run, config_for(self.quick, self.seeds, self.folded)))


@dataclass(frozen=True)
class ImpactExperiment(AnyExperiment):
    """What an estimator is worth in safety: the same robots and workers, other eyes."""

    out: Path = Path("out/impact")
    seeds: int | None = None
    """Episodes of every row, instead of 200 (8 if quick)."""
    estimator: tuple[str, ...] = ()
    """Compare these only, with the default one, the truth and nothing; all eyes if not given."""

    def run(self) -> int:
        """Run, show the tables."""
        from hrc_env.experiments.impact.experiment import config_for, run

        return self.shown(partial(run, config_for(self.quick, self.seeds, self.estimator)))


@dataclass(frozen=True)
class BeyondExperiment(AnyExperiment):
    """What the paper leaves open: cameras and places, N and M of Algorithm 1, latency,
    calibration, occlusion, several workers, what the parts of the default filter contribute."""

    out: Path = Path("out/beyond")
    seeds: int | None = None
    """Episodes of every setting, instead of 80 (4 if quick)."""
    studies: tuple[str, ...] | None = None
    """Which of cameras, algorithm1, latency, calibration, occlusion, workers, filter, kinematics;
    all if not given."""

    def run(self) -> int:
        """Run, show the tables."""
        from hrc_env.experiments.beyond.experiment import config_for, run

        return self.shown(partial(run, config_for(self.quick, self.seeds, self.studies)))


@dataclass(frozen=True)
class Experiment:
    """The paper's two experiments (site, lab), what the eyes are worth in safety (impact), and
    ablations of rigs and estimators (beyond).

    Each takes --quick (minutes) and --out DIR, where it writes report.html, results.json and
    figures; it keeps what is finished when it is stopped, and goes on there.
    """

    what: (
        Annotated[SiteExperiment, tyro.conf.subcommand("site")]
        | Annotated[LabExperiment, tyro.conf.subcommand("lab")]
        | Annotated[ImpactExperiment, tyro.conf.subcommand("impact")]
        | Annotated[BeyondExperiment, tyro.conf.subcommand("beyond")]
    )
    """Which experiment."""

    def run(self) -> int:
        """Run it."""
        return self.what.run()
