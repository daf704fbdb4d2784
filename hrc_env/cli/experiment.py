"""python -m hrc_env experiment: the paper's two, what perception is worth, ablations."""

from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, ClassVar

import tyro

from hrc_env.cli.checks import at_least
from hrc_env.cli.engines import EngineArguments
from hrc_env.cli.estimators import estimators_named
from hrc_env.cli.show import show
from hrc_env.tasks import DEFAULT


@dataclass(frozen=True)
class AnyExperiment(EngineArguments):
    """What every experiment is asked."""

    name: ClassVar[str]
    out: Path
    """Folder for report.html, results.json and figures; a run that was stopped goes on there."""
    quick: bool = False
    """Every number, from fewer seeds."""
    seeds: int | None = None
    """How many seeds."""
    overwrite: bool = False
    """Delete the results of something else, or with other settings, in the folder."""

    def run(self) -> int:
        """Run, show the tables."""
        at_least("--seeds", self.seeds, 1)
        experiment = import_module(f"hrc_env.experiments.{self.name}.experiment")
        runner = import_module("hrc_env.experiments.runner")
        asked, engine = self.without_engine(), self.chosen()
        out, overwrite = asked.pop("out"), asked.pop("overwrite")
        if "estimator" in asked:
            asked["estimator"] = estimators_named(asked["estimator"])
        made = experiment.make_experiment(**asked)
        run = partial(runner.run_experiment, made, overwrite=overwrite, engine=engine)
        return show(run, out, "experiment")


@dataclass(frozen=True)
class SiteExperiment(AnyExperiment):
    """The paper's simulation: a walk over the site, single cameras against four."""

    name = "site"
    out: Path = Path("out/site")
    seeds: int | None = None
    """Walks, instead of 9 (2 if quick)."""
    estimator: tuple[str, ...] = ("particle", "paper")
    """Estimators: python -m hrc_env list."""


@dataclass(frozen=True)
class LabExperiment(AnyExperiment):
    """The paper's laboratory: all joints, six kinds of motion, one camera against four."""

    name = "lab"
    out: Path = Path("out/lab")
    seeds: int | None = None
    """Films of every motion, instead of 7 (2 if quick)."""
    folded: str = "full"
    """The landmark network for workers who are folded up: full, or heavy, which is fetched once
    with `python -m hrc_env setup --networks heavy`."""


@dataclass(frozen=True)
class ImpactExperiment(AnyExperiment):
    """What perception is worth in safety: the same robots and workers, other detections."""

    name = "impact"
    out: Path = Path("out/impact")
    task: str = DEFAULT
    """What the robots do, by the environment's id."""
    shield: str | None = None
    """What may change their commands: qp, ssm, pfl, or one that was registered (--import)."""
    seeds: int | None = None
    """Episodes of every row, instead of 90 (8 if quick)."""
    estimator: tuple[str, ...] = ()
    """Compare these only, with the default one, the truth and nothing; all setups if not given.
    Names, or MODULE:FUNCTION, which makes one of (P, ctrl_dt, config)."""
    robots: tuple[str, ...] = ()
    """Who acts, instead of scripted, scripted_slowed and ppo, which is trained here first: some of
    these, random, hrc://ID/NAME, files (.zip, .safetensors) or MODULE:FUNCTION, as of play."""
    control: str | None = None
    """Control of policies whose files do not name one: joint, if not given, tool or twist."""
    trust: bool = False
    """Read pickles in their checkpoints, which run code of whoever made them; see play."""


@dataclass(frozen=True)
class PriceExperiment(AnyExperiment):
    """What sight costs at one rate of contacts: every pair of eyes has the margin that it needs."""

    name = "price"
    out: Path = Path("out/price")
    task: str = DEFAULT
    """What the robots do, by the environment's id."""
    seeds: int | None = None
    """Episodes of every step of a search, instead of 300; then 10 for 3 of these confirm it,
    instead of 1000 (600 if quick)."""
    eyes: tuple[str, ...] = ()
    """Compare these only, by name, as truth particle one_camera; quick: twelve."""
    robots: tuple[str, ...] = ()
    """Who acts, instead of scripted: one of random, scripted_slowed, hrc://ID/NAME, a file (.zip,
    .safetensors) or MODULE:FUNCTION, as of play. Other tasks are then left out."""
    control: str | None = None
    """Its control, if its file does not name one: joint, if not given, tool or twist."""
    trust: bool = False
    """Read pickles in its checkpoint, which run code of whoever made it; see play."""


@dataclass(frozen=True)
class AblationsExperiment(AnyExperiment):
    """What the paper leaves open: cameras and places, N and M of Algorithm 1, latency,
    calibration, occlusion, several workers, what the parts of the default filter contribute."""

    name = "ablations"
    out: Path = Path("out/ablations")
    seeds: int | None = None
    """Episodes of every setting, instead of 30 (4 if quick)."""
    studies: tuple[str, ...] | None = None
    """Which of cameras, algorithm1, latency, calibration, occlusion, workers, filter, kinematics;
    all if not given."""


@dataclass(frozen=True)
class Experiment:
    """The paper's two experiments (site, lab), what perception is worth in safety (impact), what
    sight costs at one rate of contacts (price), ablations of rigs and estimators (ablations).

    Each takes --quick (minutes) and --out DIR, where it writes report.html, results.json and
    figures; it keeps what is finished when it is stopped, and goes on there.
    """

    what: (
        Annotated[SiteExperiment, tyro.conf.subcommand("site")]
        | Annotated[LabExperiment, tyro.conf.subcommand("lab")]
        | Annotated[ImpactExperiment, tyro.conf.subcommand("impact")]
        | Annotated[PriceExperiment, tyro.conf.subcommand("price")]
        | Annotated[AblationsExperiment, tyro.conf.subcommand("ablations")]
    )
    """Which experiment."""

    def run(self) -> int:
        """Run it."""
        return self.what.run()
