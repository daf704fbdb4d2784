"""The default estimator on what it does not expect: runners, acrobats, falls, exchanged sides.

    python -m benchmarks.tracking.surprises

White detections of 3 px; people run at 3 and 3.5 m/s, turn over in the air every second or so, fall
and roll on the floor, seen by four cameras, or by one while they fall and lie; the environment's
workers run and fall, too; two of four cameras exchange left and right in the first frame. No
setting was chosen on these seeds.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console

from benchmarks.common import exactly, publish
from benchmarks.tracking.cells import run_cell
from benchmarks.tracking.detections import SURPRISES
from benchmarks.tracking.metrics import STATISTICS, drawn_sums, metric
from benchmarks.tracking.names import DEFAULT, DLT
from benchmarks.tracking.rigs import RIGS, make_rig
from benchmarks.tracking.sequences import WINDOWS, make_sequences
from hrc_env.cli.progress import progress_bar
from hrc_env.core.results import Metric
from hrc_env.experiments.study.report import Column, Report, table_of

ALSO = ("clean",)
"""What it is held against: walkers without damage."""
KINDS = ("rmse_m", "coverage95", "std_over_rmse")


@dataclass(frozen=True)
class Arguments:
    """What is run."""

    seeds: int = 200
    """Sequences a rig and condition."""
    first_seed: int = 30_000
    """The others count up; settings were chosen on seeds 7000 to 7199."""
    out: Path = Path("out/surprises")


def main(arguments: Arguments) -> None:
    """Track, hold against the truth."""
    seeds = [arguments.first_seed + k for k in range(arguments.seeds)]
    metrics: dict[str, Metric] = {}
    conditions = (*ALSO, *SURPRISES)
    with progress_bar(Console(), "surprises") as say:
        for rig in RIGS:
            for condition in conditions:
                metrics |= of_condition(rig, condition, seeds)
                say(1 / len(RIGS) / len(conditions), f"{rig} {condition}")
    rows = {f"{r}.{w}": f"{r}, {w}" for r in RIGS for c in conditions for w in WINDOWS[c]}
    columns = [
        Column("rmse_m.{}", "RMSE [cm]", 2, 100), Column("coverage95.{}", "coverage", 3),
        Column("std_over_rmse.{}", "std/RMSE", 2), Column("over_dlt.{}", "over DLT", 2),
        Column("turned.{}", "mirrored [sequences]", 0),
    ]  # fmt: skip
    parts = [table_of("`particle`", rows, columns, metrics)]
    report = Report("What nobody expects", (__doc__ or "").strip(), parts)
    publish(arguments.out, report, asdict(arguments), seeds, metrics)


def of_condition(rig_name: str, condition: str, seeds: list[int]) -> dict[str, Metric]:
    """Accuracy by window, beside plain triangulation; of a mirrored start, how many sequences have
    the body facing the wrong way in any frame of the window."""
    rig, metrics = make_rig(rig_name), dict[str, Metric]()
    given = make_sequences(rig, condition, seeds)
    cells = {name: run_cell(name, rig, given, seeds, lambda *_: None) for name in (DEFAULT, DLT)}
    for window, sums in cells[DEFAULT].items():
        drawn, plain = drawn_sums(sums), drawn_sums(cells[DLT][window])
        for kind in KINDS:
            unit, statistic = STATISTICS[kind]
            metrics[f"{kind}.{rig_name}.{window}"] = metric(statistic(drawn), unit, drawn)
        unit, rmse = STATISTICS["rmse_m"]
        ratio = metric(rmse(drawn) / rmse(plain), "-", drawn)
        metrics[f"over_dlt.{rig_name}.{window}"] = ratio
        if condition == "mirrored_start":
            turned = float(np.count_nonzero(sums["wrong_way"]))
            metrics[f"turned.{rig_name}.{window}"] = exactly(turned, "sequences", len(seeds))
    return metrics


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
