"""The tracking benchmark with other libraries, on the same sequences.

The two filters follow the documentation of their libraries: a constant-velocity model, pixels as
measurements, and protection against outliers (a likelihood with heavy tails for particles, and for
filterpy a gate that restarts a joint after repeated rejections). All libraries receive the pixels
of all cameras and frames, and the true standard deviation of the detector. None of them handles
swapped left and right sides.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import format_number
from benchmarks.tracking.cells import beliefs
from benchmarks.tracking.names import DEFAULT, DLT
from benchmarks.tracking.rigs import RIGS, Rig, make_rig
from benchmarks.tracking.sequences import Sequences, find_durations, make_sequences
from hrc_env.core.results import Metric, over
from hrc_env.core.typing import Floats, Points2, Points3
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.report import Metrics, Report, describe_quick_run, format_table
from hrc_env.experiments.runner import check_at_least_one

LIBRARIES = ("aniposelib", "particles", "filterpy")
INSTALL = 'pip install -c constraints.txt -e ".[baselines]"'
CONDITIONS = ("clean", "occluded", "hard", "one_camera")
ROWS = (*CONDITIONS, "after_return")
OURS = (DEFAULT, DLT)
N_QUICK = 1
"""Number of sequences per rig and condition in a quick run."""
Played = Mapping[tuple[str, str], list[dict[str, float]]]
"""Results of each sequence, by (rig and window, name of the library)."""


@dataclass(frozen=True, slots=True)
class BaselinesBench:
    """Benchmark of other libraries on simulated sequences."""

    name = "bench baselines"
    depends = ("tracker",)
    n_seeds: int = 5
    """Number of sequences per rig and condition; the libraries take about a minute for each
    sequence.
    """
    first_seed: int = 1000
    """Seed of the first sequence; it increases by one with each further sequence."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a number is invalid."""
        check_at_least_one(self, "n_seeds")

    @property
    def seeds(self) -> list[int]:
        """Seeds of the sequences."""
        return [self.first_seed + k for k in range(self.n_seeds)]

    @property
    def n_parts(self) -> int:
        """Number of parts, one for each library and sequence."""
        return len(RIGS) * len(CONDITIONS) * len(names()) * self.n_seeds

    @property
    def quick_note(self) -> str:
        """Warning for the tables of a short run, or "" if the run is long enough."""
        return describe_quick_run(self.n_seeds, find_durations()) if self.n_seeds <= N_QUICK else ""

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all results depend."""
        versions = {name: version(name) for name in LIBRARIES if is_installed(name)}
        return {"baselines": asdict(self), "versions": versions, "missing": list_missing()}

    def play(self, cache: PartCache) -> Played:
        """Return the results of all libraries on all sequences."""
        cells: dict[tuple[str, str], list[dict[str, float]]] = {}
        for rig, condition in product(map(make_rig, RIGS), CONDITIONS):
            for seed, name in product(self.seeds, names()):
                make = partial(_part, name, rig, condition, seed)
                part = cache.make_part(f"{rig.name}.{condition}.{name}.{seed}", make)
                for window, sums in part.items():
                    cells.setdefault((f"{rig.name}.{window}", name), []).append(sums)
        return cells

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return all metrics of the results, by name."""
        return compute_metrics(played)

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Return the report, with its tables and figures."""
        return report(metrics)


def is_installed(name: str) -> bool:
    """Return whether a library is installed."""
    return find_spec(name) is not None


def find_follow(name: str) -> Callable[[Floats, Points2, int], Points3]:
    """Return the function that estimates joints with a library.

    It returns joints (T, J, 3) [m] from projections (C, 3, 4), pixels (T, C, J, 2) and a seed.
    Missing pixels are NaN.
    """
    return import_module(f"benchmarks.tracking.baselines.{name}").follow


def names() -> list[str]:
    """Return the names of all participants: those in `OURS` and the installed libraries."""
    return [*OURS, *filter(is_installed, LIBRARIES)]


def _part(name: str, rig: Rig, condition: str, seed: int, tick: PartProgress) -> dict[str, Any]:
    """Compute the mean squared error and the time per update in each window of a sequence."""
    sequences = make_sequences(rig, condition, [seed])
    if name in LIBRARIES:
        find_follow(name)(rig.P, sequences.px[:30, 0, :, 0], seed)  # compilation
    started_s = time.perf_counter()
    joints = _joints(name, rig, sequences, seed)
    took_us = 1e6 * (time.perf_counter() - started_s) / len(joints)
    tick(1.0)
    squared = ((joints - sequences.joints[:, 0, 0]) ** 2).sum(-1)
    return {
        window: {"mean_squared": float(squared[slice(*frames)].mean()), "update_us": took_us}
        for window, frames in sequences.windows.items()
        if window in ROWS
    }


def _joints(name: str, rig: Rig, sequences: Sequences, seed: int) -> Points3:
    """Estimate the joints (T, J, 3) in a sequence with one person [m]."""
    if name in LIBRARIES:
        return find_follow(name)(rig.P, sequences.px[:, 0, :, 0], seed)
    return np.stack([mean[0, 0] for mean, _ in beliefs(name, rig, sequences, [seed])])


def compute_metrics(played: Played) -> dict[str, Metric]:
    """Compute RMSE and times per update, with the best and the worst sequence as interval."""
    metrics: dict[str, Metric] = {}
    times: dict[str, list[float]] = {}
    for (row, name), parts in played.items():
        squared = np.array([part["mean_squared"] for part in parts])
        rmse, low, high = np.sqrt([squared.mean(), squared.min(), squared.max()]).tolist()
        metrics[f"rmse_m.{row}.{name}"] = Metric(rmse, low, high, "m", len(parts))
        times.setdefault(name, []).extend(part["update_us"] for part in parts)
    metrics |= {f"update_us.{name}.1": over(values, "us") for name, values in times.items()}
    return dict(sorted(metrics.items()))


def report(metrics: Metrics) -> Report:
    """Return the report, with errors, times, and missing libraries."""
    lines = [
        [row, *(format_number(metrics[f"rmse_m.{row}.{name}"], 100) for name in names())]
        for row in (f"{rig}.{window}" for rig in RIGS for window in ROWS)
    ]
    times = [format_number(metrics[f"update_us.{name}.1"], 1, 0) for name in names()]
    header = ["RMSE in cm", *names()]
    return Report("Other libraries on the same sequences", describe_missing(), [
        format_table(header, [*lines, ["us per update of a worker", *times]]),
        "aniposelib is offline: it uses the whole clip, including future frames; its time is that "
        "of the clip divided by its number of frames. Low and high in results.json are the best "
        "and the worst sequence.",
    ], "the best and the worst sequence")  # fmt: skip


def list_missing() -> list[str]:
    """Return the names of the libraries that are not installed."""
    return [name for name in LIBRARIES if not is_installed(name)]


def describe_missing() -> str:
    """Return a sentence that lists the missing libraries and explains their installation."""
    if not list_missing():
        return "All libraries are installed."
    return (
        f"Not installed and therefore skipped: {', '.join(list_missing())}. Install them with: "
        f"{INSTALL}"
    )
