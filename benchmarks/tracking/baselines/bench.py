"""The tracking bench with other people's code, on the same sequences."""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.tracking.baselines.registry import PEERS, missing_sentence
from benchmarks.tracking.cells import beliefs
from benchmarks.tracking.names import DEFAULT, DLT
from benchmarks.tracking.rigs import RIGS, Rig, make_rig
from benchmarks.tracking.sequences import Sequences, make_sequences
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, write_results
from hrc_env.core.typing import Points3
from hrc_env.experiments.study.cache import PartCache, PartProgress, Progress
from hrc_env.experiments.study.fingerprint import fingerprint_of

CONDITIONS = ("clean", "occluded", "hard", "one_camera")
ROWS = (*CONDITIONS, "after_return")
_OWN = (DEFAULT, DLT)


@dataclass(frozen=True, slots=True)
class PeersConfig:
    """How much is run."""

    n_seeds: int = 5
    """Sequences per rig and condition; these libraries take about a minute for each."""
    first_seed: int = 1000
    """Seed of the first sequence, as in the first part of the bench."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for numbers that cannot work."""
        if self.n_seeds < 1:
            raise ConfigError(f"n_seeds must be at least 1, got {self.n_seeds}.")


def run(config: PeersConfig, out: Path, say: Progress) -> dict[str, Metric]:
    """Run what is installed; writes results.json and peers.md into `out`.

    Args:
        config: how much.
        out: a folder; parts that are done are kept there.
        say: hears of the progress: shares that sum to 1.
    """
    installed = [name for name, peer in PEERS.items() if peer.installed]
    missing = [name for name in PEERS if name not in installed]
    names = [*_OWN, *installed]
    versions = {name: version(name) for name in installed}
    fingerprint = fingerprint_of({**asdict(config), **versions}, __name__)
    n_parts = len(RIGS) * len(CONDITIONS) * len(names) * config.n_seeds
    cache = PartCache(out / "parts", fingerprint, n_parts, say)
    seeds = [config.first_seed + k for k in range(config.n_seeds)]
    cells: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for rig in map(make_rig, RIGS):
        for condition in CONDITIONS:
            for seed in seeds:
                for name in names:
                    make = partial(_part, name, rig, condition, seed)
                    part = cache.part(f"{rig.name}.{condition}.{name}.{seed}", make)
                    for window, sums in part.items():
                        cells.setdefault((f"{rig.name}.{window}", name), []).append(sums)
    metrics = _metrics(cells)
    settings = {"peers": asdict(config), "versions": versions, "missing": missing}
    write_results(out / "results.json", settings, seeds, metrics)
    (out / "peers.md").write_text(markdown(metrics, names, missing))
    return metrics


def _part(name: str, rig: Rig, condition: str, seed: int, tick: PartProgress) -> dict[str, Any]:
    """One sequence: squared errors and time of each window."""
    sequences = make_sequences(rig, condition, [seed])
    if name in PEERS:
        PEERS[name].follow(rig.P, sequences.px[:30, 0, :, 0], seed)  # compiles
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
    """(T, J, 3) of a sequence with one person."""
    if name in PEERS:
        return PEERS[name].follow(rig.P, sequences.px[:, 0, :, 0], seed)
    return np.stack([mean[0, 0] for mean, _ in beliefs(name, rig, sequences, [seed])])


def _metrics(cells: Mapping[tuple[str, str], list[dict[str, Any]]]) -> dict[str, Metric]:
    """RMSE over all sequences with the best and the worst; microseconds per update."""
    metrics, times = {}, {}
    for (row, name), parts in cells.items():
        squared = np.array([part["mean_squared"] for part in parts])
        low, high = np.sqrt(squared.min()), np.sqrt(squared.max())
        rmse = float(np.sqrt(squared.mean()))
        metrics[f"rmse_m.{row}.{name}"] = Metric(rmse, float(low), float(high), "m", len(parts))
        times.setdefault(name, []).extend(part["update_us"] for part in parts)
    for name, values in times.items():
        median = float(np.median(values))
        spread = (float(np.min(values)), float(np.max(values)))
        metrics[f"update_us.{name}.1"] = Metric(median, *spread, "us", len(values))
    return dict(sorted(metrics.items()))


def markdown(metrics: Mapping[str, Metric], names: list[str], missing: list[str]) -> str:
    """The table of errors and times, and who is missing."""
    lines = [["RMSE in cm", *names], ["---", *["---:"] * len(names)]]
    for rig in RIGS:
        for row in ROWS:
            found = [metrics[f"rmse_m.{rig}.{row}.{name}"] for name in names]
            lines.append([f"{rig} {row}", *(f"{100 * metric.value:.1f}" for metric in found)])
    times = [metrics[f"update_us.{name}.1"].value for name in names]
    lines.append(["us per update of a worker", *(f"{value:.0f}" for value in times)])
    table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
    return (
        "# Other people's code on the same sequences\n\n"
        f"{missing_sentence(missing)}\n\n{table}\n\n"
        "aniposelib is offline: it sees the whole clip at once, frames to come included; its "
        "time is the clip's over its frames.\n"
    )
