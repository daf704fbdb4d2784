"""The tracking bench: every estimator on the same sequences, beside the bound.

Each (rig, condition, estimator) is written to DIR/parts as soon as it is done, so that a bench
that was stopped goes on where it was; parts made by other code or settings are made anew.
"""

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

import hrc_env
from hrc_env.errors import ConfigError
from hrc_env.experiments.tracking_cells import (
    DLT,
    FULL_STATE,
    MATCHED,
    Tick,
    make_sequences,
    run_cell,
)
from hrc_env.experiments.tracking_detections import CONDITIONS
from hrc_env.experiments.tracking_metrics import TIMING, Parts, metrics_of
from hrc_env.experiments.tracking_report import write_report
from hrc_env.experiments.tracking_rigs import RIGS, SIGMA_PX, Rig, make_rig
from hrc_env.experiments.tracking_timing import BATCH, time_estimator
from hrc_env.results import Metric, write_results
from hrc_env.tracking.estimators import ESTIMATORS


@dataclass(frozen=True, slots=True)
class TrackingBenchConfig:
    """How much is run."""

    n_seeds: int = 100
    """Sequences per rig and condition."""
    first_seed: int = 1000
    """Seed of the first sequence; the others count up."""
    n_matched: int = 200
    """Matched sequences per rig."""
    timing_repeats: int = 7
    """How often the time per update is taken."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for numbers that cannot work."""
        for name in ("n_seeds", "n_matched", "timing_repeats"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{name} must be at least 1, got {getattr(self, name)}.")


QUICK = TrackingBenchConfig(n_seeds=12, n_matched=40, timing_repeats=2)
"""Every number, from fewer sequences."""
Say = Callable[[float, str], None]
"""Told by how much the share that is done grew, and what is being done."""


def run(config: TrackingBenchConfig, out: Path, say: Say) -> dict[str, Metric]:
    """Run what is not yet there; writes results.json, tracking.md and two plots into `out`.

    Args:
        config: how much.
        out: a folder.
        say: hears of the progress: shares that sum to 1.
    """
    names = [*ESTIMATORS, DLT]
    n_parts = len(RIGS) * ((len(CONDITIONS) + 1) * len(names) + 1) + len(ESTIMATORS)
    shelf = _Shelf(out / "parts", _fingerprint(config), n_parts, say)
    parts: Parts = {}
    for rig in map(make_rig, RIGS):
        for condition in (*CONDITIONS, MATCHED):
            asked = [*names, FULL_STATE] if condition == MATCHED else names
            for name, part in _condition(config, shelf, rig, condition, asked):
                parts[rig.name, condition, name] = part
    for name, part in _timing(config, shelf):
        parts["lab", TIMING, name] = part
    metrics = metrics_of(parts, list(ESTIMATORS))
    settings = {
        "bench": asdict(config),
        "sigma_px": SIGMA_PX,
        "tracker": {name: asdict(make_rig(name).tracker) for name in RIGS},
        "conditions": {name: asdict(damage) for name, damage in CONDITIONS.items()},
        "fingerprint": shelf.fingerprint,
    }
    write_results(out / "results.json", settings, _seeds(config, "clean"), metrics)
    write_report(out, parts, metrics, list(ESTIMATORS))
    return metrics


@dataclass(frozen=True, slots=True)
class _Shelf:
    """Where parts are kept."""

    folder: Path
    fingerprint: str
    n_parts: int
    say: Say

    def part(self, label: str, make: Callable[[Tick], dict[str, Any]]) -> dict[str, Any]:
        """The part called `label`: the one that is there, or a new one."""
        part = self._load(label)
        if part is not None:
            self.say(1 / self.n_parts, label)
            return part
        self.say(0.0, label)
        part = make(lambda share: self.say(share / self.n_parts, label))
        self._store(label, part)
        return part

    def _load(self, label: str) -> dict[str, Any] | None:
        """A part that is there, whole, and made by the same code and settings."""
        path = self.folder / f"{label}.json"
        if not path.exists():
            return None
        content: Mapping[str, Any] = json.loads(path.read_text())
        return content["part"] if content["fingerprint"] == self.fingerprint else None

    def _store(self, label: str, part: Mapping[str, Any]) -> None:
        """Write a part, whole or not at all."""
        self.folder.mkdir(parents=True, exist_ok=True)
        draft = self.folder / f"{label}.draft"
        draft.write_text(json.dumps({"fingerprint": self.fingerprint, "part": part}))
        os.replace(draft, self.folder / f"{label}.json")


def _seeds(config: TrackingBenchConfig, condition: str) -> list[int]:
    n = config.n_matched if condition == MATCHED else config.n_seeds
    return [config.first_seed + k for k in range(n)]


def _condition(
    config: TrackingBenchConfig, shelf: _Shelf, rig: Rig, condition: str, names: list[str]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """All estimators on one rig and condition; the sequences are made if a part is missing."""
    seeds = _seeds(config, condition)
    sequences = cache(lambda: make_sequences(rig, condition, seeds))

    def make(name: str, tick: Tick) -> dict[str, Any]:
        return run_cell(name, rig, sequences(), seeds, tick)

    for name in names:
        yield name, shelf.part(f"{rig.name}.{condition}.{name}", partial(make, name))


def _timing(config: TrackingBenchConfig, shelf: _Shelf) -> Iterator[tuple[str, dict[str, Any]]]:
    """Microseconds per update of every estimator, on the lab's sequences."""
    rig = make_rig("lab")
    frames = cache(lambda kind: make_sequences(rig, kind, list(range(BATCH))))

    def make(name: str, tick: Tick) -> dict[str, Any]:
        repeats = config.timing_repeats
        return time_estimator(name, rig, frames("clean"), frames("hard"), repeats, tick)

    for name in ESTIMATORS:
        yield name, shelf.part(f"{TIMING}.{name}", partial(make, name))


def _fingerprint(config: TrackingBenchConfig) -> str:
    """What a part depends on: the settings and the code that it comes from."""
    digest = hashlib.sha256(json.dumps(asdict(config), sort_keys=True).encode())
    root = Path(hrc_env.__file__).parent
    for room in ("geometry", "tracking", "experiments"):
        for path in sorted((root / room).glob("*.py")):
            digest.update(path.read_bytes())
    digest.update((root / "skeleton.py").read_bytes())
    digest.update(np.__version__.encode())
    return digest.hexdigest()[:16]
