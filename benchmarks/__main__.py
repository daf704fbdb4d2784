"""python -m benchmarks: measure estimators, detector, speed, workers; draw workers and scenes."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

from hrc_env.cli.checks import check_at_least, check_writable_folder
from hrc_env.cli.engines import EngineArguments
from hrc_env.cli.entry import import_first, run_command, show_errors
from hrc_env.cli.estimators import resolve_estimators
from hrc_env.cli.show import show
from hrc_env.core.errors import ConfigError
from hrc_env.core.progress import progress_bar
from hrc_env.experiments.runner import Experiment, override, run_experiment

PROGRAM = "python -m benchmarks"


@dataclass(frozen=True)
class BenchArguments(EngineArguments):
    """What every bench is asked; one that was stopped goes on where it was in the same folder. What
    takes times is always run here, alone."""

    out: Path
    """Folder for report.html, results.json, figures and the parts that are done."""
    quick: bool = False
    """Every number, from less: minutes, not hours."""

    def show(self, experiment: Experiment[Any]) -> int:
        """Run an experiment, show its tables."""
        return show(
            partial(run_experiment, experiment, engine=self.choose_engine()), self.out, "bench"
        )


@dataclass(frozen=True)
class TrackingArguments(BenchArguments):
    """Run every estimator on the same simulated sequences; tables and results.json."""

    out: Path = Path("out/bench_tracking")
    """Folder; of --real and --baselines, which are parts of their own, with that word after it."""
    seeds: int | None = None
    """Sequences per rig and condition, instead of 70 (8 if quick)."""
    real: bool = False
    """On recorded films instead, which are fetched once (51 MB): four calibrated cameras."""
    estimators: tuple[str, ...] = ()
    """Run these only, beside particle: names (those of --import too, dlt, smoother), or
    MODULE:FUNCTION, which makes one of (P, ctrl_dt, config)."""
    sequences: tuple[str, ...] = ()
    """On these only: a rig (lab, site, env), a condition (clean, occluded, hard, ...) or one of a
    rig, as lab.hard."""
    baselines: bool = False
    """Other people's code instead, on the same sequences (5 per rig and condition, 1 if quick),
    as far as it is installed."""

    def run(self) -> int:
        """Run, show the tables."""
        check_at_least("--seeds", self.seeds, 1)
        if self.real and self.baselines:
            raise ConfigError("--real and --baselines are two parts of the bench; choose one.")
        if (self.real or self.baselines) and (self.estimators or self.sequences):
            raise ConfigError(
                "--estimators and --sequences choose of the simulated sequences, which --real and "
                "--baselines do not run: leave one of them out."
            )
        if self.baselines:
            from benchmarks.tracking.baselines.bench import N_QUICK, BaselinesBench

            n_seeds = self.seeds or (N_QUICK if self.quick else 5)
            return self._beside("_baselines").show(BaselinesBench(n_seeds))
        if self.real:
            from benchmarks.recorded.bench import RecordedBench

            return self._beside("_real").show(RecordedBench())
        from benchmarks.tracking.bench import QUICK, TrackingBench

        config = QUICK if self.quick else TrackingBench()
        names = resolve_estimators(self.estimators)
        sequences = tuple(dict.fromkeys(self.sequences))
        config = override(config, n_seeds=self.seeds)
        return self.show(override(config, estimators=names, sequences=sequences))

    def _beside(self, ending: str) -> BenchArguments:
        """The same in a folder of its own, unless one was given."""
        is_usual = self.out == TrackingArguments.out
        out = Path(f"{self.out}{ending}") if is_usual else self.out
        return BenchArguments(out, engine=self.engine, workers=self.workers, address=self.address)


@dataclass(frozen=True)
class SpeedArguments(BenchArguments):
    """Steps a second, what each organ takes of a step, and resets; beside Gymnasium's Reacher. Then
    those of every id, beside the first's.

    Everybody takes turns: nothing else should run on the machine.
    """

    stays = "it takes times, which other processes would disturb"
    out: Path = Path("out/bench_speed")
    task: str | None = None
    """Which environment, by its id, instead of the first; the other ids are then left out. Or
    "every": steps a second of each id, and nothing else."""
    shield: str | None = None
    """What may change commands: qp, ssm, pfl, or one that was registered (--import)."""
    rounds: int | None = None
    """In how many rounds everybody has a turn, instead of 6 (1 if quick); medians count."""

    def run(self) -> int:
        """Run, show the tables."""
        check_at_least("--rounds", self.rounds, 1)
        from benchmarks.speed.bench import QUICK, SpeedBench

        config = QUICK if self.quick else SpeedBench()
        return self.show(override(config, n_rounds=self.rounds, task=self.task, shield=self.shield))


@dataclass(frozen=True)
class MotionArguments(BenchArguments):
    """Play everything that workers can do; statistics beside those of people."""

    stays = "it has no parts that could be played apart"
    out: Path = Path("out/bench_motion")
    seeds: int | None = None
    """How often each worker plays a scene, instead of 12 (2 if quick)."""

    def run(self) -> int:
        """Run, show the tables."""
        check_at_least("--seeds", self.seeds, 1)
        from benchmarks.motion.bench import QUICK, MotionBench

        config = QUICK if self.quick else MotionBench()
        return self.show(override(config, n_seeds=self.seeds))


@dataclass(frozen=True)
class PerceptionArguments(BenchArguments):
    """Level `pixels`: steps a second and what takes them, how well workers are seen by pose,
    distance, view angle and lens, and what every fault of a camera costs."""

    out: Path = Path("out/bench_perception")

    def run(self) -> int:
        """Run, show the tables."""
        from benchmarks.perception.bench import QUICK, PerceptionBench

        return self.show(QUICK if self.quick else PerceptionBench())


@dataclass(frozen=True)
class Gallery:
    """Draw every worker, a film strip of every motion, and both scenes from all cameras."""

    out: Path = Path("out/gallery")
    """Folder for the pictures (PNG) and `index.html`."""

    def run(self) -> int:
        """Draw, tell where."""
        check_writable_folder(self.out)
        from benchmarks.gallery.gallery import GalleryConfig, run

        console = Console()
        with progress_bar(console, "gallery") as say:
            exhibits = run(GalleryConfig(), self.out, say)
        console.print(f"{len(exhibits)} pictures; open [bold]{self.out / 'index.html'}[/]")
        return 0


@dataclass(frozen=True)
class Benchmarks:
    """Measure the estimators (tracking), the detector (perception), the environment (speed) or the
    workers (motion); draw workers, motions and scenes (gallery).

    Each bench takes --quick (minutes, not hours) and --out DIR, where it writes report.html,
    results.json and figures; `tracking --help` and so on say the rest.
    """

    what: (
        Annotated[TrackingArguments, tyro.conf.subcommand("tracking")]
        | Annotated[PerceptionArguments, tyro.conf.subcommand("perception")]
        | Annotated[SpeedArguments, tyro.conf.subcommand("speed")]
        | Annotated[MotionArguments, tyro.conf.subcommand("motion")]
        | Annotated[Gallery, tyro.conf.subcommand("gallery")]
    )
    """Which one."""

    def run(self) -> int:
        """Run it."""
        return self.what.run()


def main(words: Sequence[str] | None = None) -> int:
    """Run a bench, of the process's words if none are given; return the exit status."""
    given = list(sys.argv[1:] if words is None else words) or ["--help"]
    return show_errors(lambda: run_command(Benchmarks, import_first(given, PROGRAM), PROGRAM))


if __name__ == "__main__":
    sys.exit(main())
