"""Computation of the metrics of the perception benchmark from the results of its parts."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.common import make_exact
from benchmarks.perception.crops import STEP_S
from benchmarks.perception.episodes import Episode, read_episode, select_steps
from benchmarks.perception.speed import ROUNDS
from benchmarks.perception.views import FAMILIES, ROWS, View, group_rows
from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats, Ints
from hrc_env.evaluation.intervals import (
    bootstrap,
    estimate_clustered_share,
    estimate_quantile,
    estimate_rmse,
    estimate_share,
)

PIXELS, EMULATED, NO_FAULT = "pixels", "keypoints", "none"
N_DRAWS = 200
Metrics = dict[str, Metric]
Found = Mapping[str, dict[str, Any]]
"""Results of completed parts by label, as in `bench.Parts`."""


def compute_metrics(found: Found, n_faults: int, fault_steps: int) -> Metrics:
    """Compute all metrics of the benchmark, by name.

    Args:
        found: results of the completed parts.
        n_faults: number of first episodes in the lab that serve as the baseline for faults.
        fault_steps: number of first steps of these episodes that are used.
    """
    played = {
        label: [read_episode(each) for each in part["episodes"]]
        for label, part in found.items()
        if "episodes" in part
    }
    loops: dict[str, list[Episode]] = {}
    faults: dict[tuple[str, str], list[Episode]] = {}
    for label, episodes in played.items():
        kind, first, second = label.split(".")
        if kind == "loop":
            loops.setdefault(first, []).extend(episodes)
        else:
            faults[first, second] = episodes
    base = [select_steps(each, slice(fault_steps)) for each in loops["lab"][:n_faults]]
    faults[PIXELS, NO_FAULT] = base
    views = [View(**view) for part in found.values() for view in part.get("views", ())]
    metrics = {**_speed(found), **_loops(loops), **_faults(faults), **_views(views)}
    emulator = found.get("emulator", {})
    return metrics | {name: Metric(**metric) for name, metric in emulator.items()}


def _speed(found: Found) -> Metrics:
    metrics: Metrics = {}
    for label, part in found.items():
        kind, _, key = label.partition(".")
        if kind == "network":
            metrics[f"network_ms.{key}"] = make_exact(part["ms"], "ms", ROUNDS)
        elif kind == "speed":
            metrics[f"steps_per_s.{key}"] = make_exact(part["steps_per_s"], "1/s", part["n"])
            metrics[f"step_ms.{key}"] = make_exact(1e3 / part["steps_per_s"], "ms", part["n"])
            for stage, ms in part["stages"].items():
                metrics[f"stage_ms.{stage}.{key}"] = make_exact(ms, "ms", part["n"])
    return metrics


def _loops(loops: dict[str, list[Episode]]) -> Metrics:
    metrics: Metrics = {}
    for scene, episodes in loops.items():
        metrics |= _belief(scene, episodes)
    everything = [episode for episodes in loops.values() for episode in episodes]
    for k, family in enumerate(FAMILIES):
        those = [select_steps(episode, episode.family == k) for episode in everything]
        those = [episode for episode in those if len(episode.family)]
        if those:
            metrics |= _belief(f"pose.{family}", those)
    return metrics


def _belief(name: str, episodes: list[Episode]) -> Metrics:
    """Compute error, coverage, reported standard deviation and untracked steps of episodes."""
    errors = [_select_tracked(episode.error_m) for episode in episodes]
    squared = [float((each**2).sum()) for each in errors]
    reported = [float((_select_tracked(episode.std_m) ** 2).sum()) for episode in episodes]
    inside = [float(episode.inside95.sum()) for episode in episodes]
    lost = [float(np.isnan(episode.error_m[:, 0]).sum()) for episode in episodes]
    steps = [float(len(episode.family)) for episode in episodes]
    return {
        f"error_m.{name}.median": estimate_quantile(errors, 0.5, "m"),
        f"error_m.{name}.p95": estimate_quantile(errors, 0.95, "m"),
        f"coverage95.{name}": estimate_clustered_share(
            inside, [float(len(each)) for each in errors]
        ),
        f"std_over_error.{name}": estimate_rmse(reported, squared, "ratio"),
        f"lost_steps.{name}": estimate_clustered_share(lost, steps),
    }


def _faults(faults: dict[tuple[str, str], list[Episode]]) -> Metrics:
    """Compute the metrics of faults, relative to the same seeds without faults.

    The faulty camera alternates between episodes.
    """
    metrics: Metrics = {}
    for (level, kind), episodes in faults.items():
        start = "" if level == PIXELS else f"{level}."
        base = faults[level, NO_FAULT]
        found = _belief(f"fault.{kind}", episodes)
        own = [k % each.off_px.shape[1] for k, each in enumerate(episodes)]
        if kind == NO_FAULT:
            own = [-1] * len(episodes)
        else:
            found[f"error_ratio.{kind}"] = _ratio(episodes, base)
            found[f"detected.fault.{kind}"] = _rate_detections(episodes, own)
        found |= _rate_reports(f"miscalibrated.{kind}", episodes, own)
        metrics |= {start + name: metric for name, metric in found.items()}
    return metrics


def _ratio(episodes: list[Episode], base: list[Episode]) -> Metric:
    """Compute the ratio of the median error to that of the same seeds without the fault.

    The confidence interval is computed by bootstrap over seeds.
    """
    above, below = ([_select_tracked(each.error_m) for each in some] for some in (episodes, base))

    def ratio(weights: Ints) -> Floats:
        drawn = [np.repeat(np.arange(len(each)), each) for each in weights]
        return np.array([_median(above, ks) / _median(below, ks) for ks in drawn])

    return bootstrap(ratio, len(episodes), "-", N_DRAWS)


def _median(values: list[Floats], which: Ints) -> float:
    together = np.concatenate([values[k] for k in which])
    return float(np.median(together)) if together.size else np.nan


def _rate_detections(episodes: list[Episode], cameras: list[int]) -> Metric:
    """Compute the fraction of steps in which the faulty camera detects the worker."""
    pairs = zip(episodes, cameras, strict=True)
    seen = [float(np.isfinite(each.off_px[:, c]).sum()) for each, c in pairs]
    return estimate_clustered_share(seen, [float(len(each.off_px)) for each in episodes])


def _rate_reports(start: str, episodes: list[Episode], own: list[int]) -> Metrics:
    """Compute rate and delay of reports of the faulty camera, and the rate of false reports."""
    cameras = [np.arange(each.named.shape[1]) for each in episodes]
    mine = [each.named[:, c == k].any(1) for each, c, k in zip(episodes, cameras, own, strict=True)]
    wrong = [
        each.named[:, c != k].any(1) for each, c, k in zip(episodes, cameras, own, strict=True)
    ]
    first = [float(np.argmax(each)) * STEP_S for each in mine if each.any()]
    steps = [float(len(each.family)) for each in episodes]
    return {
        f"{start}.named": estimate_share([bool(each.any()) for each in mine]),
        f"{start}.after_s": estimate_quantile([[each] for each in first], 0.5, "s"),
        f"{start}.others": estimate_clustered_share([float(each.sum()) for each in wrong], steps),
    }


def _views(every: list[View]) -> Metrics:
    metrics: Metrics = {}
    for kind in ROWS:
        for row, views in group_rows(every, kind).items():
            metrics[f"detected.{kind}.{row}"] = estimate_share(
                [view.error is not None for view in views]
            )
            errors = [[view.error] for view in views if view.error is not None]
            for name, q in (("median", 0.5), ("p95", 0.95)):
                key = f"error_share.{kind}.{row}.{name}"
                metrics[key] = estimate_quantile(errors, q, "share of stature")
    return metrics


def _select_tracked(values: np.ndarray) -> np.ndarray:
    """Return the values of all joints in steps in which the worker is tracked."""
    return values[np.isfinite(values)]
