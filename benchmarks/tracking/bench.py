"""The tracking benchmark, which runs all estimators on the same sequences.

The results of each rig, condition and estimator are written to DIR/parts as soon as they are
complete, and an interrupted run continues from there. Parts with other versions or settings are
computed again.
"""

import hashlib
from dataclasses import asdict, dataclass, replace
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

from benchmarks.tracking.cells import run_cell
from benchmarks.tracking.declaration import BENCH, times
from benchmarks.tracking.detections import CONDITIONS
from benchmarks.tracking.env_sequences import ENV, make_env_rig
from benchmarks.tracking.metrics import TIMING, Parts, compute_metrics
from benchmarks.tracking.names import DEFAULT, SMOOTHER, Selection
from benchmarks.tracking.report import report
from benchmarks.tracking.rigs import RIGS, SIGMA_PX, Rig, make_rig
from benchmarks.tracking.sequences import MATCHED, Sequences, find_durations, make_sequences
from benchmarks.tracking.timing import BATCH, time_estimator
from hrc_env.core.results import Metric
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.report import Metrics, Report, Table, describe_quick_run
from hrc_env.experiments.runner import check_at_least_one, is_as_short
from hrc_env.experiments.versions import hash_source, make_key
from hrc_env.tracking.estimators import ESTIMATORS


@dataclass(frozen=True, slots=True)
class TrackingBench:
    """Benchmark of the estimators on simulated sequences."""

    name = "bench tracking"
    depends = ("env", "tracker", "emulator", "motion")
    n_seeds: int = 70
    """Number of sequences per rig and condition."""
    first_seed: int = 20_000
    """Seed of the first sequence; it increases by one with each further sequence.

    These sequences were not used to tune the estimators; the seeds 1000 to 1023, 5000 to 5023 and
    7000 to 7023 were.
    """
    n_matched: int = 140
    """Number of matched sequences per rig."""
    n_smoothed: int = 18
    """Number of sequences per rig and condition on which the slow smoother runs."""
    timing_repeats: int = 7
    """Number of repetitions of the time measurement of an update."""
    estimators: tuple[str, ...] = ()
    """Names of estimators in addition to the default, as in `Selection`."""
    sequences: tuple[str, ...] = ()
    """Names of rigs and conditions, as in `Selection`."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a value is invalid."""
        check_at_least_one(self, "n_seeds", "n_matched", "n_smoothed", "timing_repeats")
        self.selection.check()

    @property
    def selection(self) -> Selection:
        """Selection of the estimators and sequences that are run."""
        return Selection(self.estimators, self.sequences)

    @property
    def seeds(self) -> list[int]:
        """Seeds of the sequences of all conditions except `matched`."""
        return list_seeds(self)

    @property
    def n_parts(self) -> int:
        """Number of parts: one per estimator, rig and condition, and one per time measurement."""
        run = self.selection
        return sum(len(run.names_of(each)) for _, each in run.conditions()) + len(run.timed())

    @property
    def quick_note(self) -> str:
        """Warning for the tables and figures of a short run, or "" if the run is long enough."""
        return (
            describe_quick_run(self.n_seeds, find_durations()) if is_as_short(self, QUICK) else ""
        )

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all results depend."""
        bench = asdict(self)
        for name in ("estimators", "sequences"):
            if not bench[name]:
                del bench[name]
        return {
            "bench": bench,
            "default": DEFAULT,
            "sigma_px": SIGMA_PX,
            "tracker": {name: asdict(_rig(name).tracker) for name in (*RIGS, ENV)},
            "conditions": {name: asdict(damage) for name, damage in CONDITIONS.items()},
        }

    def play(self, cache: PartCache) -> Parts:
        """Return the results of all estimators; times are measured at the end, one after the other.

        The result of a part does not depend on the selection of other parts.
        """
        whole = {"experiment": self.name, **replace(self, estimators=(), sequences=()).settings()}
        cache, run = replace(cache, key=make_key(whole, self.depends)), self.selection
        asked = [(*each, name) for each in run.conditions() for name in run.names_of(each[1])]
        parts = [make_part(self, *each, cache.key) for each in asked]
        played: Parts = dict(zip(asked, cache.make_parts(parts, one_core=True), strict=True))
        return played | _timing(self, cache)

    def metrics(self, played: Parts) -> dict[str, Metric]:
        """Return all metrics of the results, by name."""
        return compute_metrics(played, self.selection)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables that this benchmark fills in the documentation."""
        return (BENCH, times(self.selection.timed()))

    def report(self, played: Parts, metrics: Metrics, figures: Path) -> Report:
        """Return the report, with its tables and figures."""
        return report(metrics, self.selection)


QUICK = TrackingBench(n_seeds=8, n_matched=30, n_smoothed=2, timing_repeats=2)
"""Benchmark settings for a quick run, which computes all numbers from fewer sequences."""


def make_part(config: TrackingBench, rig_name: str, condition: str, name: str, key: str) -> Part:
    """Return the part of the benchmark for an estimator, a rig and a condition."""
    seeds = list_seeds(config, condition)
    n = min(config.n_smoothed, len(seeds)) if name == SMOOTHER else len(seeds)
    make = partial(_run, rig_name, condition, tuple(seeds), n, name)
    return Part(f"{rig_name}.{condition}.{name}", make, extend_key(name, key))


def _run(
    rig_name: str, condition: str, seeds: tuple[int, ...], n: int, name: str, tick: PartProgress
) -> dict[str, Any]:
    given = _make_sequences(rig_name, condition, seeds)
    return run_cell(name, _rig(rig_name), given.first(n), list(seeds[:n]), tick)


@lru_cache(maxsize=1)
def _make_sequences(rig_name: str, condition: str, seeds: tuple[int, ...]) -> Sequences:
    """Return the sequences of a condition; the latest ones are cached for other estimators."""
    return make_sequences(_rig(rig_name), condition, list(seeds))


def extend_key(name: str, key: str) -> str:
    """Return the cache key of an estimator's parts, including the source of a custom estimator."""
    source = hash_source(ESTIMATORS[name].make) if name in ESTIMATORS else ""
    return hashlib.sha256(f"{key} {source}".encode()).hexdigest()[:16] if source else key


def list_seeds(config: TrackingBench, condition: str = "clean") -> list[int]:
    """Return the seeds of a condition's sequences."""
    n = config.n_matched if condition == MATCHED else config.n_seeds
    return [config.first_seed + k for k in range(n)]


@cache
def _rig(name: str) -> Rig:
    return make_env_rig() if name == ENV else make_rig(name)


def _timing(config: TrackingBench, parts: PartCache) -> Parts:
    """Measure the time per update of all estimators on sequences in the lab [us]."""
    rig = make_rig("lab")
    frames = cache(lambda kind: make_sequences(rig, kind, list(range(BATCH))))
    repeats = config.timing_repeats

    def make(name: str, tick: PartProgress) -> dict[str, Any]:
        return time_estimator(name, rig, frames("clean"), frames("hard"), repeats, tick)

    return {
        ("lab", TIMING, name): parts.make_part(
            f"{TIMING}.{name}", partial(make, name), extend_key(name, parts.key)
        )
        for name in config.selection.timed()
    }
