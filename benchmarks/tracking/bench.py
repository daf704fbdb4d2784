"""The tracking bench: every estimator on the same sequences, beside the bound.

Each (rig, condition, estimator) is written to DIR/parts as soon as it is done, so that a bench
that was stopped goes on where it was; parts made by other code or settings are made anew.
"""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from benchmarks.common import check_positive
from benchmarks.tracking.cells import run_cell
from benchmarks.tracking.detections import CONDITIONS
from benchmarks.tracking.env_sequences import ENV, make_env_rig
from benchmarks.tracking.metrics import ASSOCIATION, TIMING, Parts, metrics_of
from benchmarks.tracking.names import DEFAULT, SMOOTHER, conditions, names_of
from benchmarks.tracking.report import report
from benchmarks.tracking.rigs import RIGS, SIGMA_PX, Rig, make_rig
from benchmarks.tracking.sequences import MATCHED, Sequences, make_sequences
from benchmarks.tracking.timing import BATCH, time_association, time_estimator
from hrc_env.core.results import Metric, write_results
from hrc_env.experiments.study.fingerprint import fingerprint_of
from hrc_env.experiments.study.shelf import Say, Shelf, Tick
from hrc_env.tracking.estimators import ESTIMATORS


@dataclass(frozen=True, slots=True)
class TrackingBenchConfig:
    """How much is run."""

    n_seeds: int = 100
    """Sequences per rig and condition."""
    first_seed: int = 20_000
    """Seed of the first sequence; the others count up. No setting was chosen on these: seeds
    1000 to 1023, 5000 to 5023 and 7000 to 7023 served for that."""
    n_matched: int = 200
    """Matched sequences per rig."""
    n_smoothed: int = 25
    """Sequences per rig and condition for the smoother, which is slow; the first ones."""
    timing_repeats: int = 7
    """How often the time per update is taken."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for numbers that cannot work."""
        check_positive(self, "n_seeds", "n_matched", "n_smoothed", "timing_repeats")


QUICK = TrackingBenchConfig(n_seeds=8, n_matched=30, n_smoothed=2, timing_repeats=2)
"""Every number, from fewer sequences."""


def run(config: TrackingBenchConfig, out: Path, say: Say, processes: int = 1) -> dict[str, Metric]:
    """Run what is not yet there; writes results.json, a report and a plot into `out`.

    Args:
        config: how much.
        out: a folder.
        say: hears of the progress: shares that sum to 1.
        processes: how many conditions are run at once; times are taken alone, at the end.
    """
    asked = conditions()
    n_parts = sum(len(names_of(condition)) for _, condition in asked) + len(ESTIMATORS) + 1
    fingerprint = fingerprint_of(asdict(config), "benchmarks.tracking.cells")
    shelf = Shelf(out / "parts", fingerprint, n_parts, say)
    quiet = replace(shelf, say=_silent)
    if processes > 1:  # they leave their parts on the shelf
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(processes, mp_context=context) as pool:
            running = {pool.submit(make_condition, config, quiet, *each): each for each in asked}
            for done in as_completed(running):
                done.result()
                say(len(names_of(running[done][1])) / n_parts, ".".join(running[done]))
    parts: Parts = {}
    for each in asked:
        parts |= make_condition(config, quiet if processes > 1 else shelf, *each)
    parts |= _timing(config, shelf)
    metrics = metrics_of(parts)
    settings = {
        "bench": asdict(config),
        "default": DEFAULT,
        "sigma_px": SIGMA_PX,
        "tracker": {name: asdict(_rig(name).tracker) for name in (*RIGS, ENV)},
        "conditions": {name: asdict(damage) for name, damage in CONDITIONS.items()},
        "fingerprint": fingerprint,
    }
    write_results(out / "results.json", settings, _seeds(config, "clean"), metrics)
    report(out, parts, metrics)
    return metrics


def make_condition(config: TrackingBenchConfig, shelf: Shelf, rig_name: str, what: str) -> Parts:
    """Everybody on one rig and condition; the sequences are made if a part is missing."""
    seeds = _seeds(config, what)

    @cache
    def sequences() -> tuple[Rig, Sequences]:
        rig = _rig(rig_name)
        return rig, make_sequences(rig, what, seeds)

    def make(name: str, tick: Tick) -> dict[str, Any]:
        rig, given = sequences()
        n = min(config.n_smoothed, len(seeds)) if name == SMOOTHER else len(seeds)
        return run_cell(name, rig, given.first(n), seeds[:n], tick)

    return {
        (rig_name, what, name): shelf.part(f"{rig_name}.{what}.{name}", partial(make, name))
        for name in names_of(what)
    }


def _silent(share: float, label: str) -> None:
    """Say nothing."""


def _rig(name: str) -> Rig:
    return make_env_rig() if name == ENV else make_rig(name)


def _seeds(config: TrackingBenchConfig, condition: str) -> list[int]:
    n = config.n_matched if condition == MATCHED else config.n_seeds
    return [config.first_seed + k for k in range(n)]


def _timing(config: TrackingBenchConfig, shelf: Shelf) -> Parts:
    """Microseconds per update of every estimator, on the lab's sequences, and of association."""
    rig = make_rig("lab")
    frames = cache(lambda kind: make_sequences(rig, kind, list(range(BATCH))))
    repeats = config.timing_repeats

    def make(name: str, tick: Tick) -> dict[str, Any]:
        return time_estimator(name, rig, frames("clean"), frames("hard"), repeats, tick)

    parts: Parts = {
        ("lab", TIMING, name): shelf.part(f"{TIMING}.{name}", partial(make, name))
        for name in ESTIMATORS
    }
    parts["site", TIMING, ASSOCIATION] = shelf.part(
        f"{TIMING}.{ASSOCIATION}", partial(time_association, make_rig("site"), repeats)
    )
    return parts
