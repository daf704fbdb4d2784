"""The perception bench: how fast the eyes are, how well they see, and what goes wrong.

Each part is written to DIR/parts as soon as it is done, so that a bench that was stopped goes on
where it was; parts made by other code or settings are made anew. Times are taken last.
"""

from dataclasses import asdict
from pathlib import Path

import numpy as np

from benchmarks.perception import loops, sheet
from benchmarks.perception.measured import NO_FAULT, PIXELS, Measured, metrics_of
from benchmarks.perception.parts import FIRST_SEED, tasks_of
from benchmarks.perception.report import write_report
from benchmarks.perception.settings import PerceptionBenchConfig
from benchmarks.perception.views import PLAIN
from hrc_env.core.results import Metric, write_results
from hrc_env.experiments.study.cache import PartCache, Progress
from hrc_env.experiments.study.fingerprint import fingerprint_of


def run(config: PerceptionBenchConfig, out: Path, say: Progress) -> dict[str, Metric]:
    """Measure what is not yet there.

    Writes results.json, perception.md, plots and the sheet of the worst crops into `out`.

    Args:
        config: how much.
        out: a folder.
        say: hears of the progress: shares that sum to 1.
    """
    tasks = list(tasks_of(config, out))
    settings, found = asdict(config), Measured()
    fingerprint = fingerprint_of(settings, "benchmarks.perception.parts")
    total = sum(task.cost for task in tasks)
    for task in tasks:
        n_parts = total / task.cost
        cache = PartCache(out / "parts", fingerprint, n_parts, say)
        task.take(cache.part(task.label, task.make), found)
    base = found.loops["lab"][: config.n_faults]
    first = slice(config.fault_steps)
    found.faults[PIXELS, NO_FAULT] = [loops.some_steps(each, first) for each in base]
    metrics = metrics_of(found)
    seeds = [FIRST_SEED + k for k in range(max(n for _, n in config.episodes))]
    write_results(out / "results.json", {"bench": asdict(config)}, seeds, metrics)
    write_report(out, metrics)
    plain = [view for view in found.views if view.variant == PLAIN]
    worst = sheet.worst_of([np.nan if v.error is None else v.error for v in plain])
    kept = [plain[k].picture for k in worst]
    sheet.write_sheet(out / "worst_crops.png", [out / name for name in kept if name])
    return metrics
