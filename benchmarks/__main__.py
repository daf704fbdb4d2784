"""The command `python -m benchmarks`.

It runs the benchmarks of the estimators, the detector, the speed (also beside other environments),
the motion of workers, rare contacts, people searched for contacts and the cost, and renders a
gallery.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
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
    """Arguments common to all benchmarks.

    An interrupted run is continued if it is started again with the same folder. Benchmarks that
    measure time always run in this process, one part after the other.
    """

    out: Path
    """Folder for report.html, results.json, figures and cached results of completed parts."""
    quick: bool = False
    """Compute all numbers from less data, in minutes instead of hours."""

    def show(self, experiment: Experiment[Any]) -> int:
        """Run an experiment and print its tables; return the exit status."""
        return show(
            partial(run_experiment, experiment, engine=self.choose_engine()), self.out, "bench"
        )


@dataclass(frozen=True)
class TrackingArguments(BenchArguments):
    """Run every estimator on the same simulated sequences."""

    out: Path = Path("out/bench_tracking")
    """Folder for the results; --real and --baselines append _real and _baselines to the default."""
    seeds: int | None = None
    """Number of sequences per rig and condition (default: 70, quick: 8)."""
    real: bool = False
    """Use recorded videos of four calibrated cameras instead; they are downloaded once (51 MB)."""
    estimators: tuple[str, ...] = ()
    """Estimators to run in addition to particle: names (including dlt, smoother, and those
    registered by --import), or MODULE:FUNCTION, a function of (P, ctrl_dt, config).
    """
    sequences: tuple[str, ...] = ()
    """Sequences to run: a rig (lab, site, env), a condition (clean, occluded, hard, ...), or both,
    e.g. lab.hard."""
    baselines: bool = False
    """Run the other installed libraries instead, on the same sequences (5 per rig and condition,
    quick: 1).
    """

    def run(self) -> int:
        """Run the benchmark and print its tables; return the exit status."""
        check_at_least("--seeds", self.seeds, 1)
        if self.real and self.baselines:
            raise ConfigError("--real and --baselines are separate benchmarks; choose one of them.")
        if (self.real or self.baselines) and (self.estimators or self.sequences):
            raise ConfigError(
                "--estimators and --sequences select simulated sequences, which --real and "
                "--baselines do not use: leave out one of them."
            )
        if self.baselines:
            from benchmarks.tracking.baselines.bench import N_QUICK, BaselinesBench

            n_seeds = self.seeds or (N_QUICK if self.quick else 5)
            return self._change_folder("_baselines").show(BaselinesBench(n_seeds))
        if self.real:
            from benchmarks.recorded.bench import RecordedBench

            return self._change_folder("_real").show(RecordedBench())
        from benchmarks.tracking.bench import QUICK, TrackingBench

        config = QUICK if self.quick else TrackingBench()
        names = resolve_estimators(self.estimators)
        sequences = tuple(dict.fromkeys(self.sequences))
        config = override(config, n_seeds=self.seeds)
        return self.show(override(config, estimators=names, sequences=sequences))

    def _change_folder(self, ending: str) -> BenchArguments:
        """Return the arguments with a suffix appended to the folder if it is the default one."""
        is_usual = self.out == TrackingArguments.out
        out = Path(f"{self.out}{ending}") if is_usual else self.out
        return BenchArguments(out, engine=self.engine, workers=self.workers, address=self.address)


@dataclass(frozen=True)
class SpeedArguments(BenchArguments):
    """Measure steps per second, the time of each part of a step, and the time of resets.

    All environments and Gymnasium's Reacher are measured. Nothing else should run on the machine.
    """

    stays = "it measures time, which other processes would disturb"
    out: Path = Path("out/bench_speed")
    task: str | None = None
    """Id of the only environment to measure (default: HRCReach-v0 in detail, and all others);
    "every" measures only the steps per second of each id.
    """
    shield: str | None = None
    """Shield that filters commands: qp, ssm, pfl, or a registered one (--import)."""
    rounds: int | None = None
    """Number of rounds, of which the median is reported (default: 6, quick: 1)."""

    def run(self) -> int:
        """Run the benchmark and print its tables; return the exit status."""
        check_at_least("--rounds", self.rounds, 1)
        from benchmarks.speed.bench import QUICK, SpeedBench

        config = QUICK if self.quick else SpeedBench()
        return self.show(override(config, n_rounds=self.rounds, task=self.task, shield=self.shield))


@dataclass(frozen=True)
class PeersArguments(BenchArguments):
    """Measure steps per second of processor time beside other environments, and the first start.

    EnvPool is measured if it is installed (the extra "peers").
    """

    stays = "it measures time, which other processes would disturb"
    out: Path = Path("out/bench_peers")
    rounds: int | None = None
    """Number of rounds, of which the median is reported (default: 7, quick: 1)."""

    def run(self) -> int:
        """Run the benchmark and print its tables; return the exit status."""
        check_at_least("--rounds", self.rounds, 1)
        from benchmarks.speed.peers import QUICK, PeersBench

        config = QUICK if self.quick else PeersBench()
        return self.show(override(config, n_rounds=self.rounds))


@dataclass(frozen=True)
class MotionArguments(BenchArguments):
    """Simulate all motions of workers, and compare their statistics with measurements of people."""

    stays = "it has no independent parts"
    out: Path = Path("out/bench_motion")
    seeds: int | None = None
    """Number of episodes per worker and scene (default: 12, quick: 2)."""

    def run(self) -> int:
        """Run the benchmark and print its tables; return the exit status."""
        check_at_least("--seeds", self.seeds, 1)
        from benchmarks.motion.bench import QUICK, MotionBench

        config = QUICK if self.quick else MotionBench()
        return self.show(override(config, n_seeds=self.seeds))


@dataclass(frozen=True)
class PerceptionArguments(BenchArguments):
    """Measure the perception level `pixels`: speed, accuracy, and effects of camera faults.

    Accuracy is measured by pose, distance, view angle and lens.
    """

    out: Path = Path("out/bench_perception")

    def run(self) -> int:
        """Run the benchmark and print its tables; return the exit status."""
        from benchmarks.perception.bench import QUICK, PerceptionBench

        return self.show(QUICK if self.quick else PerceptionBench())


@dataclass(frozen=True)
class RareArguments(BenchArguments):
    """Estimate how often shielded robots touch a worker while they move towards them.

    Multilevel splitting is compared with counted contacts for the shipped shield.
    """

    out: Path = Path("out/bench_rare")
    replications: int | None = None
    """Number of independent replications of the splitting (default: 8, quick: 2)."""
    starts: int | None = None
    """Number of futures that start at each level (default: 200, quick: 20)."""
    episodes: int | None = None
    """Number of whole episodes in which contacts are counted (default: 4000, quick: 40)."""

    def run(self) -> int:
        """Run the benchmark and print its table; return the exit status."""
        check_at_least("--replications", self.replications, 2)
        check_at_least("--starts", self.starts, 1)
        check_at_least("--episodes", self.episodes, 1)
        from benchmarks.rare.bench import QUICK, RareBench

        config = override(QUICK if self.quick else RareBench(), n_starts=self.starts)
        return self.show(
            override(config, n_replications=self.replications, n_episodes=self.episodes)
        )


@dataclass(frozen=True)
class AdversaryArguments(BenchArguments):
    """Search for reaches of a worker that lead to contacts, and count contacts with them.

    A cross-entropy search finds times, places and speeds of reaches for the scripted robot with the
    shield qp and for one without a shield. On other seeds, such people are compared with those
    unaware of the robot. The reaches that were found are written to reaches.json in the folder.
    """

    out: Path = Path("out/bench_adversary")
    iterations: int | None = None
    """Number of iterations of each search (default: 10, quick: 2)."""
    samples: int | None = None
    """Number of scripts per iteration (default: 256, quick: 16)."""
    episodes: int | None = None
    """Number of episodes of each row of the table (default: 1000, quick: 16)."""
    film: bool = False
    """Afterwards, film the worst episode of each search, as worst_SHIELD.mp4 in the folder."""

    def run(self) -> int:
        """Run the benchmark, print its table and write films; return the exit status."""
        check_at_least("--iterations", self.iterations, 1)
        check_at_least("--samples", self.samples, 12)
        check_at_least("--episodes", self.episodes, 1)
        from benchmarks.adversary.bench import QUICK, AdversaryBench, film_worst

        config = override(
            QUICK if self.quick else AdversaryBench(),
            n_iterations=self.iterations,
            n_samples=self.samples,
            n_judged=self.episodes,
        )
        status = self.show(config)
        if self.film:
            film_worst(self.out, Console().print)
        return status


@dataclass(frozen=True)
class RanksArguments(BenchArguments):
    """Compare the rank order of twenty policies by cost with that by contacts and approaches."""

    out: Path = Path("out/bench_ranks")
    episodes: int | None = None
    """Number of episodes of each policy (default: 500, quick: 8)."""
    first_seed: int | None = None
    """Seed of the first episode (default: 18310000, quick: 18200000)."""
    threads: int | None = None
    """Number of threads that step the environments (default: all cores)."""

    def run(self) -> int:
        """Run the benchmark and print its tables; return the exit status."""
        for name in ("episodes", "threads"):
            check_at_least(f"--{name}", getattr(self, name), 1)
        check_at_least("--first-seed", self.first_seed, 0)
        from benchmarks.ranks import QUICK, RanksBench

        config = override(QUICK if self.quick else RanksBench(), n_episodes=self.episodes)
        return self.show(override(config, first_seed=self.first_seed, threads=self.threads))


@dataclass(frozen=True)
class BudgetsArguments(BenchArguments):
    """Measure the cost per episode of scripted and random agents in every task.

    The default cost limits of `train` were chosen from these numbers.
    """

    out: Path = Path("out/bench_budgets")
    only: tuple[str, ...] = ()
    """Rows to run, given by prefixes of their names, such as HRCReach-v0.random (default: all)."""
    threads: int | None = None
    """Number of threads that step the environments (default: all cores)."""

    def run(self) -> int:
        """Run the benchmark and print its table; return the exit status."""
        check_at_least("--threads", self.threads, 1)
        from benchmarks.budgets import make_study

        study = make_study()
        study = study.select(self.only) if self.only else study
        return self.show(replace(study.shorten() if self.quick else study, threads=self.threads))


@dataclass(frozen=True)
class Gallery:
    """Render all workers, a film strip of each motion, and both scenes from all cameras."""

    out: Path = Path("out/gallery")
    """Folder for the images (PNG) and `index.html`."""

    def run(self) -> int:
        """Render the images and print their folder; return the exit status."""
        check_writable_folder(self.out)
        from benchmarks.gallery.gallery import GalleryConfig, run

        console = Console()
        with progress_bar(console, "gallery") as say:
            exhibits = run(GalleryConfig(), self.out, say)
        console.print(f"{len(exhibits)} pictures; open [bold]{self.out / 'index.html'}[/]")
        return 0


@dataclass(frozen=True)
class Benchmarks:
    """Run a benchmark of estimators, detector, environment or workers, or render a gallery.

    The benchmarks are tracking, perception, speed, peers, motion, rare, adversary, ranks and
    budgets. Each takes --quick (minutes instead of hours) and --out DIR, a folder for report.html,
    results.json and figures. `tracking --help`, for example, describes the other options.
    """

    benchmark: (
        Annotated[TrackingArguments, tyro.conf.subcommand("tracking")]
        | Annotated[PerceptionArguments, tyro.conf.subcommand("perception")]
        | Annotated[SpeedArguments, tyro.conf.subcommand("speed")]
        | Annotated[PeersArguments, tyro.conf.subcommand("peers")]
        | Annotated[MotionArguments, tyro.conf.subcommand("motion")]
        | Annotated[RareArguments, tyro.conf.subcommand("rare")]
        | Annotated[AdversaryArguments, tyro.conf.subcommand("adversary")]
        | Annotated[RanksArguments, tyro.conf.subcommand("ranks")]
        | Annotated[BudgetsArguments, tyro.conf.subcommand("budgets")]
        | Annotated[Gallery, tyro.conf.subcommand("gallery")]
    )
    """Benchmark to run."""

    def run(self) -> int:
        """Run the benchmark; return the exit status."""
        return self.benchmark.run()


def main(words: Sequence[str] | None = None) -> int:
    """Run a benchmark with the given arguments, or those of the process; return the exit status."""
    given = list(sys.argv[1:] if words is None else words) or ["--help"]
    return show_errors(lambda: run_command(Benchmarks, import_first(given, PROGRAM), PROGRAM))


if __name__ == "__main__":
    sys.exit(main())
