"""The tracking bench: every estimator on the same sequences, beside the bound.

Each (rig, condition, estimator) is written to DIR/parts as soon as it is done, so that a bench
that was stopped goes on where it was; parts made by other code or settings are made anew.
"""

import functools
import multiprocessing
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.tracking.cells import run_cell
from benchmarks.tracking.detections import CONDITIONS
from benchmarks.tracking.metrics import ASSOCIATION, TIMING, Parts, metrics_of
from benchmarks.tracking.names import DEFAULT, SMOOTHER, cells, names_of
from benchmarks.tracking.own import OWN, make_own_rig
from benchmarks.tracking.report import write_report
from benchmarks.tracking.rigs import RIGS, SIGMA_PX, Rig, make_rig
from benchmarks.tracking.sequences import BOUNDED, Sequences, make_sequences
from benchmarks.tracking.timing import BATCH, time_association, time_estimator
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, write_results
from hrc_env.experiments.study.cache import PartCache, PartProgress, Progress
from hrc_env.experiments.study.fingerprint import fingerprint_of
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
        for name in ("n_seeds", "n_matched", "n_smoothed", "timing_repeats"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{name} must be at least 1, got {getattr(self, name)}.")


QUICK = TrackingBenchConfig(n_seeds=8, n_matched=30, n_smoothed=2, timing_repeats=2)
"""Every number, from fewer sequences."""


def run(
    config: TrackingBenchConfig, out: Path, say: Progress, processes: int = 1
) -> dict[str, Metric]:
    """Run what is not yet there; writes results.json, tracking.md and two plots into `out`.

    Args:
        config: how much.
        out: a folder.
        say: hears of the progress: shares that sum to 1.
        processes: how many conditions are run at once; times are taken alone, at the end.
    """
    asked = cells()
    n_parts = len(asked) + len(ESTIMATORS) + 1
    cache = PartCache(
        out / "parts", fingerprint_of(asdict(config), "benchmarks.tracking.cells"), n_parts, say
    )
    if processes > 1:
        _run_conditions(config, cache, processes)
        cache = PartCache(cache.folder, cache.fingerprint, n_parts, _silent)
    parts: Parts = {}
    for rig, condition in dict.fromkeys(cell[:2] for cell in asked):
        parts |= make_condition(config, cache, rig, condition)
    cache = PartCache(cache.folder, cache.fingerprint, n_parts, say)
    parts |= _timing(config, cache)
    metrics = metrics_of(parts)
    settings = {
        "bench": asdict(config),
        "default": DEFAULT,
        "sigma_px": SIGMA_PX,
        "tracker": {name: asdict(_rig(name).tracker) for name in (*RIGS, OWN)},
        "conditions": {name: asdict(damage) for name, damage in CONDITIONS.items()},
        "fingerprint": cache.fingerprint,
    }
    write_results(out / "results.json", settings, _seeds(config, "clean"), metrics)
    write_report(out, parts, metrics)
    return metrics


def make_condition(
    config: TrackingBenchConfig, cache: PartCache, rig_name: str, condition: str
) -> Parts:
    """Everybody on one rig and condition; the sequences are made if a part is missing."""
    seeds = _seeds(config, condition)

    @functools.cache
    def sequences() -> tuple[Rig, Sequences]:
        rig = _rig(rig_name)
        return rig, make_sequences(rig, condition, seeds)

    def make(name: str, tick: PartProgress) -> dict[str, Any]:
        rig, given = sequences()
        if name == SMOOTHER:
            n = min(config.n_smoothed, len(seeds))
            return run_cell(name, rig, given.first(n), seeds[:n], tick)
        return run_cell(name, rig, given, seeds, tick)

    return {
        (rig_name, condition, name): cache.part(
            f"{rig_name}.{condition}.{name}", partial(make, name)
        )
        for name in names_of(rig_name, condition)
    }


def _run_conditions(config: TrackingBenchConfig, cache: PartCache, processes: int) -> None:
    """Let several processes put the parts of whole conditions in the cache."""
    todo = Counter((rig, condition) for rig, condition, _ in cells())
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=context) as pool:
        running = {
            pool.submit(_in_process, config, cache.folder, cache.fingerprint, *what): what
            for what in todo
        }
        for done in as_completed(running):
            done.result()
            what = running[done]
            cache.progress(todo[what] / cache.n_parts, ".".join(what))


def _in_process(
    config: TrackingBenchConfig, folder: Path, fingerprint: str, rig: str, condition: str
) -> None:
    """What another process does: the parts stay in the cache."""
    make_condition(config, PartCache(folder, fingerprint, 1, _silent), rig, condition)


def _silent(share: float, label: str) -> None:
    """Say nothing."""


def _rig(name: str) -> Rig:
    return make_own_rig() if name == OWN else make_rig(name)


def _seeds(config: TrackingBenchConfig, condition: str) -> list[int]:
    n = config.n_matched if condition in BOUNDED else config.n_seeds
    return [config.first_seed + k for k in range(n)]


def _timing(config: TrackingBenchConfig, cache: PartCache) -> Parts:
    """Microseconds per update of every estimator, on the lab's sequences, and of association."""
    rig = make_rig("lab")
    frames = cache(lambda kind: make_sequences(rig, kind, list(range(BATCH))))
    repeats = config.timing_repeats

    def make(name: str, tick: PartProgress) -> dict[str, Any]:
        return time_estimator(name, rig, frames("clean"), frames("hard"), repeats, tick)

    parts: Parts = {
        ("lab", TIMING, name): cache.part(f"{TIMING}.{name}", partial(make, name))
        for name in ESTIMATORS
    }
    site = make_rig("site")
    parts["site", TIMING, ASSOCIATION] = cache.part(
        f"{TIMING}.{ASSOCIATION}", partial(time_association, site, repeats)
    )
    return parts
