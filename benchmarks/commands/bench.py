"""python -m hrc_env bench: how good estimators and eyes, how fast all, how human workers are."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.markdown import Markdown

from hrc_env.cli.checks import at_least, writable_folder
from hrc_env.cli.progress import progress_bar
from hrc_env.core.errors import ConfigError
from hrc_env.core.machine import n_cores

Say = Callable[[float, str], None]
"""Told by how much the share that is done grew, and what is being done."""


@dataclass(frozen=True)
class TrackingBench:
    """Run every estimator on the same simulated sequences; a table, plots and results.json.

    A bench that was stopped goes on where it was when it is started with the same folder.
    """

    out: Path | None = None
    """Folder for results.json, tables, pictures and the parts that are done; one for each of
    the three parts of the bench. Default: out/bench_tracking, the same with _real or _peers."""
    quick: bool = False
    """Fewer sequences: every number, with wider intervals, in less than four minutes."""
    seeds: int | None = None
    """Sequences per rig and condition, instead of 100 (8 if quick)."""
    processes: int | None = None
    """Conditions that are run at once; as many as there are cores if not given. Times are taken
    alone, at the end."""
    real: bool = False
    """On real footage instead, which is fetched once (51 MB): four calibrated cameras."""

    peers: bool = False
    """Other people's code instead, on the same sequences (5 per rig and condition, 1 if quick),
    as far as it is installed."""

    def run(self) -> int:
        """Run, show the table."""
        at_least("--seeds", self.seeds, 1)
        at_least("--processes", self.processes, 1)
        if self.real and self.peers:
            raise ConfigError("--real and --peers are two parts of the bench; choose one.")
        if self.peers:
            from benchmarks.tracking.baselines import bench as peers

            n_seeds = self.seeds if self.seeds is not None else 1 if self.quick else 5
            return show(
                partial(peers.run, peers.PeersConfig(n_seeds=n_seeds)),
                self.out or Path("out/bench_tracking_peers"),
                "peers.md",
                "results.json, peers.md",
            )
        if self.real:
            from benchmarks.recorded import bench as footage

            return show(
                footage.run,
                self.out or Path("out/bench_tracking_real"),
                "real.md",
                "results.json, real.md, a film (real.mp4) and its middle frame (real.png)",
            )
        from benchmarks.tracking.bench import QUICK, TrackingBenchConfig, run

        config = QUICK if self.quick else TrackingBenchConfig()
        if self.seeds is not None:
            config = replace(config, n_seeds=self.seeds)
        out = self.out or Path("out/bench_tracking")
        return show(
            partial(run, config, processes=self.processes or n_cores()),
            out,
            "tracking.md",
            "results.json, tracking.md, two plots (PNG)",
        )


@dataclass(frozen=True)
class SpeedBench:
    """Steps a second, what each organ takes of a step, and resets; beside Gymnasium's Reacher.

    Everybody takes turns: nothing else should run on the machine.
    """

    out: Path = Path("out/bench_speed")
    """Folder for results.json, a table and a picture."""
    quick: bool = False
    """One short round: every number, in less than two minutes."""
    rounds: int | None = None
    """In how many rounds everybody has a turn, instead of 7 (1 if quick); medians count."""

    def run(self) -> int:
        """Run, show the table."""
        at_least("--rounds", self.rounds, 1)
        from benchmarks.speed.bench import QUICK, SpeedBenchConfig, run

        config = QUICK if self.quick else SpeedBenchConfig()
        if self.rounds is not None:
            config = replace(config, n_rounds=self.rounds)
        written = "results.json, speed.md, organs.png"
        return show(partial(run, config), self.out, "speed.md", written)


@dataclass(frozen=True)
class MotionBench:
    """Play everything that workers can do; statistics beside those of people."""

    out: Path = Path("out/bench_motion")
    """Folder for results.json, a table and a picture."""
    quick: bool = False
    """One body and two seeds: every number, in less than a minute."""
    seeds: int | None = None
    """How often each worker plays a scene, instead of 12 (2 if quick)."""

    def run(self) -> int:
        """Run, show the table."""
        at_least("--seeds", self.seeds, 1)
        from benchmarks.motion.bench import QUICK, MotionBenchConfig, run

        config = QUICK if self.quick else MotionBenchConfig()
        if self.seeds is not None:
            config = replace(config, n_seeds=self.seeds)
        return show(
            partial(run, config), self.out, "motion.md", "results.json, motion.md, motion.png"
        )


@dataclass(frozen=True)
class PerceptionBench:
    """Level `pixels`: steps a second and what takes them, how well workers are seen by pose,
    distance, view angle and lens, what every fault of a camera costs, ghosts in empty rooms.

    A bench that was stopped goes on where it was when it is started with the same folder.
    """

    out: Path = Path("out/bench_perception")
    """Folder for results.json, tables, pictures and the parts that are done."""
    quick: bool = False
    """Fewer episodes and crops: every number, with wider intervals."""

    def run(self) -> int:
        """Run, show the tables."""
        from benchmarks.perception.bench import run
        from benchmarks.perception.settings import QUICK, PerceptionBenchConfig

        config = QUICK if self.quick else PerceptionBenchConfig()
        written = "results.json, perception.md, three plots (PNG), worst_crops.png"
        return show(partial(run, config), self.out, "perception.md", written)


@dataclass(frozen=True)
class Bench:
    """Measure the estimators (tracking), the eyes (perception), the environment (speed) or the
    workers (motion).

    Each takes --quick (minutes, not hours) and --out DIR, where it writes results.json, a table
    and pictures; `bench tracking --help` and so on say the rest.
    """

    what: (
        Annotated[TrackingBench, tyro.conf.subcommand("tracking")]
        | Annotated[PerceptionBench, tyro.conf.subcommand("perception")]
        | Annotated[SpeedBench, tyro.conf.subcommand("speed")]
        | Annotated[MotionBench, tyro.conf.subcommand("motion")]
    )
    """Which bench."""

    def run(self) -> int:
        """Run it."""
        return self.what.run()


def show(run: Callable[[Path, Say], object], out: Path, table: str, written: str) -> int:
    """Run a part of the bench under a progress bar, then show its table."""
    writable_folder(out)
    console = Console()
    with progress_bar(console, "bench") as say:
        run(out, say)
    console.print(Markdown((out / table).read_text()))
    console.print(f"In [bold]{out}[/]: {written}")
    return 0
