"""python -m hrc_env bench tracking: how good, how honest and how fast the estimators are."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import tyro
from rich.console import Console
from rich.markdown import Markdown
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn


@dataclass(frozen=True)
class Bench:
    """Run every estimator on the same simulated sequences; a table, plots and results.json.

    A bench that was stopped goes on where it was when it is started with the same folder.
    """

    what: Annotated[Literal["tracking"], tyro.conf.Positional]
    """Which bench."""
    out: Path = Path("out/bench_tracking")
    """Folder for results.json, tracking.md, two plots and the parts that are done."""
    quick: bool = False
    """Fewer sequences: every number, with wider intervals, in less than four minutes."""
    seeds: int | None = None
    """Sequences per rig and condition, instead of 100 (12 if quick)."""

    def run(self) -> int:
        """Run, show the table."""
        from hrc_env.experiments.tracking_bench import QUICK, TrackingBenchConfig, run

        config = QUICK if self.quick else TrackingBenchConfig()
        if self.seeds is not None:
            config = replace(config, n_seeds=self.seeds)
        console = Console()
        with Progress(
            TextColumn("{task.description:30s}"),
            BarColumn(),
            TextColumn("{task.percentage:3.0f} %"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
        ) as progress:
            task = progress.add_task("bench tracking", total=1.0)
            run(
                config,
                self.out,
                lambda share, label: progress.update(task, advance=share, description=label),
            )
        console.print(Markdown((self.out / "tracking.md").read_text()))
        console.print(f"In [bold]{self.out}[/]: results.json, tracking.md, two plots (PNG)")
        return 0
