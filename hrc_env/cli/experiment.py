"""Run an experiment of the paper, a study of perception and safety, or the ablations."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, ClassVar

import tyro

from hrc_env.cli.checks import check_at_least
from hrc_env.cli.engines import EngineArguments
from hrc_env.cli.estimators import resolve_estimators
from hrc_env.cli.show import show
from hrc_env.tasks import DEFAULT


@dataclass(frozen=True)
class AnyExperiment(EngineArguments):
    """Arguments of every experiment."""

    name: ClassVar[str]
    out: Path
    """Folder for report.html, results.json and figures. A stopped run resumes from its folder."""
    quick: bool = False
    """Reduce the number of seeds or episodes, for a preview of the results."""
    seeds: int | None = None
    """Number of seeds."""
    overwrite: bool = False
    """Delete results in the folder that belong to another run or to other settings."""

    def run(self) -> int:
        """Run the experiment and print its tables; return the exit status."""
        check_at_least("--seeds", self.seeds, 1)
        experiment = import_module(f"hrc_env.experiments.{self.name}.experiment")
        runner = import_module("hrc_env.experiments.runner")
        arguments, engine = self.exclude_engine(), self.choose_engine()
        out, overwrite = arguments.pop("out"), arguments.pop("overwrite")
        if "estimator" in arguments:
            arguments["estimator"] = resolve_estimators(arguments["estimator"])
        made = experiment.make_experiment(**arguments)
        run = partial(runner.run_experiment, made, overwrite=overwrite, engine=engine)
        return show(run, out, "experiment")


@dataclass(frozen=True)
class SiteExperiment(AnyExperiment):
    """Run the paper's simulation: a walk over the site, tracked by each camera and by all four."""

    name = "site"
    out: Path = Path("out/site")
    seeds: int | None = None
    """Number of walks (default: 9, quick: 2)."""
    estimator: tuple[str, ...] = ("particle", "paper")
    """Names of the estimators to compare; python -m hrc_env list shows them."""


@dataclass(frozen=True)
class LabExperiment(AnyExperiment):
    """Run the paper's laboratory experiment: all joints in six motions, one camera or four."""

    name = "lab"
    RENAMED: ClassVar[Mapping[str, str]] = {"folded": "folded-network"}
    out: Path = Path("out/lab")
    seeds: int | None = None
    """Number of films per motion (default: 7, quick: 2)."""
    folded_network: str = "full"
    """Landmark network for folded postures: full, or heavy, which `python -m hrc_env setup
    --networks heavy` fetches once."""


@dataclass(frozen=True)
class ImpactExperiment(AnyExperiment):
    """Measure the effect of perception on safety: only the perception differs between rows."""

    name = "impact"
    out: Path = Path("out/impact")
    task: str = DEFAULT
    """Id of the environment."""
    shield: str | None = None
    """Shield that may change the robots' commands: qp, ssm, pfl, or a registered one (--import)."""
    seeds: int | None = None
    """Number of episodes per row (default: 90, quick: 8)."""
    estimator: tuple[str, ...] = ()
    """Estimators to compare with the default one, the truth and no perception, by name or as
    MODULE:FUNCTION, a function of (P, ctrl_dt, config). Default: all perception setups."""
    robots: tuple[str, ...] = ()
    """Agents that control the robots (default: scripted, scripted_slowed and ppo, which is trained
    first): any of these, random, hrc://ID/NAME, files (.zip, .safetensors) or MODULE:FUNCTION, as
    in play."""
    control: str | None = None
    """Control mode of policies without one in their files: joint (default), tool or twist."""
    trust: bool = False
    """Allow pickles in the agents' checkpoints, which can run arbitrary code, to be loaded (see
    play)."""


@dataclass(frozen=True)
class PriceExperiment(AnyExperiment):
    """Measure the throughput that perception leaves at stated rates of contacts.

    For each perception setup, twelve settings of the shield are compared on some seeds, and the
    best are played on others. The whole study takes hours.
    """

    name = "price"
    RENAMED: ClassVar[Mapping[str, str]] = {"eyes": "setups"}
    out: Path = Path("out/price")
    task: str = DEFAULT
    """Id of the environment."""
    seeds: int | None = None
    """Number of episodes from which settings of the shield are chosen (default: 500, quick: 8). The
    chosen settings are played on 8 new episodes for each of these (quick: 2)."""
    setups: tuple[str, ...] = ()
    """Names of the perception setups to compare, for example true_capsules four_cameras one_camera
    (default: all eight; quick: four)."""
    robots: tuple[str, ...] = ()
    """Agent that controls the robots (default: scripted): random, scripted_slowed, hrc://ID/NAME, a
    file (.zip, .safetensors) or MODULE:FUNCTION, as in play."""
    control: str | None = None
    """Control mode of the agent if its file does not name one: joint (default), tool or twist."""
    trust: bool = False
    """Allow pickles in the agent's checkpoint, which can run arbitrary code, to be loaded (see
    play)."""


@dataclass(frozen=True)
class AblationsExperiment(AnyExperiment):
    """Study the settings that the paper leaves open.

    These are the number and positions of the cameras, N and M of Algorithm 1, latency, calibration,
    occlusion, the number of workers, and the parts of the default filter.
    """

    name = "ablations"
    out: Path = Path("out/ablations")
    seeds: int | None = None
    """Number of episodes per setting (default: 30, quick: 4)."""
    studies: tuple[str, ...] | None = None
    """Studies to run: cameras, algorithm1, latency, calibration, occlusion, workers, filter,
    kinematics (default: all)."""


@dataclass(frozen=True)
class Experiment:
    """Run an experiment of the paper or an additional one.

    The paper's two experiments are site and lab; impact measures the effect of perception on
    safety, price the throughput that perception leaves at stated rates of contacts, and ablations
    compares rigs and estimators. Each accepts --quick, which takes minutes, and --out DIR, the
    folder for report.html, results.json and figures. If a run is stopped, the same command resumes
    it from the cached results of its completed parts.
    """

    experiment: (
        Annotated[SiteExperiment, tyro.conf.subcommand("site")]
        | Annotated[LabExperiment, tyro.conf.subcommand("lab")]
        | Annotated[ImpactExperiment, tyro.conf.subcommand("impact")]
        | Annotated[PriceExperiment, tyro.conf.subcommand("price")]
        | Annotated[AblationsExperiment, tyro.conf.subcommand("ablations")]
    )
    """Experiment to run."""

    def run(self) -> int:
        """Run the experiment; return the exit status."""
        return self.experiment.run()
