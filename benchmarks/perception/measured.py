"""What the bench found, and the numbers that come of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.perception.crops import STEP_S
from benchmarks.perception.families import NAMES
from benchmarks.perception.loops import Episode, camera_name, some_steps
from benchmarks.perception.speed import ROUNDS
from benchmarks.perception.views import ROWS, View, rows_of
from hrc_env.core.results import Metric
from hrc_env.experiments.study.intervals import quantile_over, ratio_over, rmse_over

PIXELS, EMULATED = "pixels", "keypoints"
NO_FAULT = "none"
RESAMPLES = 200
Z_95 = 1.96
Metrics = dict[str, Metric]


@dataclass(slots=True)
class Measured:
    """Everything, part by part."""

    speed: dict[str, dict[str, Any]] = field(default_factory=dict)
    """By `speed.Setting.name`, as `speed.measure` gives it."""
    network_ms: dict[str, float] = field(default_factory=dict)
    """By runtime, as `speed.network_ms` gives it."""
    views: list[View] = field(default_factory=list)
    loops: dict[str, list[Episode]] = field(default_factory=dict)
    """By scene, at `pixels`, without faults."""
    faults: dict[tuple[str, str], list[Episode]] = field(default_factory=dict)
    """By level and kind; `NO_FAULT` are the same seeds without. The cameras of a rig have the
    fault in turns, from episode to episode."""
    emulator: Metrics = field(default_factory=dict)
    """As `calibration.validate.error_ratios` gives it."""
    phantoms: list[dict[str, int]] = field(default_factory=list)
    """As `phantoms.count` gives it."""


def metrics_of(found: Measured) -> Metrics:
    """Every number by its name."""
    return {
        **_speed(found),
        **_loops(found),
        **_faults(found),
        **_views(found),
        **_phantoms(found),
        **found.emulator,
    }


def share(seen: Sequence[bool]) -> Metric:
    """A share with Wilson's 95 % interval; NaN of nothing."""
    n = len(seen)
    if n == 0:
        return Metric(math.nan, math.nan, math.nan, "share", 0)
    p, z = float(np.mean(seen)), Z_95
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * math.sqrt(p * (1 - p) / n + (z / (2 * n)) ** 2) / (1 + z * z / n)
    return Metric(p, middle - half, middle + half, "share", n)


def _speed(found: Measured) -> Metrics:
    metrics: Metrics = {}
    for runtime, ms in found.network_ms.items():
        metrics[f"network_ms.{runtime}"] = Metric(ms, ms, ms, "ms", ROUNDS)
    for key, each in found.speed.items():
        value = each["steps_per_s"]
        metrics[f"steps_per_s.{key}"] = Metric(value, value, value, "1/s", each["n"])
        for stage, ms in each["stages"].items():
            metrics[f"stage_ms.{stage}.{key}"] = Metric(ms, ms, ms, "ms", each["n"])
    return metrics


def _loops(found: Measured) -> Metrics:
    metrics: Metrics = {}
    for scene, episodes in found.loops.items():
        metrics |= _belief(scene, episodes)
    everything = [episode for episodes in found.loops.values() for episode in episodes]
    for k, family in enumerate(NAMES):
        those = [some_steps(episode, episode.family == k) for episode in everything]
        those = [episode for episode in those if len(episode.family)]
        if those:
            metrics |= _belief(f"pose.{family}", those)
    return metrics


def _belief(name: str, episodes: list[Episode]) -> Metrics:
    """Error, coverage, reported deviation and lost steps of some episodes."""
    errors = [_known(episode.error_m) for episode in episodes]
    squared = [float((each**2).sum()) for each in errors]
    reported = [float((_known(episode.std_m) ** 2).sum()) for episode in episodes]
    inside = [float(episode.inside95.sum()) for episode in episodes]
    lost = [float(np.isnan(episode.error_m[:, 0]).sum()) for episode in episodes]
    steps = [float(len(episode.family)) for episode in episodes]
    return {
        f"error_m.{name}.median": quantile_over(errors, 0.5, "m"),
        f"error_m.{name}.p95": quantile_over(errors, 0.95, "m"),
        f"coverage95.{name}": ratio_over(inside, [float(len(each)) for each in errors], "share"),
        f"std_over_error.{name}": rmse_over(reported, squared, "ratio"),
        f"lost_steps.{name}": ratio_over(lost, steps, "share"),
    }


def _faults(found: Measured) -> Metrics:
    metrics: Metrics = {}
    for (level, kind), episodes in found.faults.items():
        start = "" if level == PIXELS else f"{level}."
        base = found.faults[level, NO_FAULT]
        for name, metric in _belief(f"fault.{kind}", episodes).items():
            metrics[start + name] = metric
        if kind == NO_FAULT:
            metrics |= _named(f"{start}miscalibrated.{kind}", episodes, [-1] * len(episodes))
            continue
        metrics[f"{start}coverage95.{kind}"] = metrics.pop(f"{start}coverage95.fault.{kind}")
        metrics[f"{start}error_ratio.{kind}"] = _ratio(episodes, base)
        own = [_camera_of(k, episode) for k, episode in enumerate(episodes)]
        metrics[f"{start}detected.fault.{kind}"] = _detected(episodes, own)
        metrics |= _named(f"{start}miscalibrated.{kind}", episodes, own)
        if kind == "lost":
            for c in sorted(set(own)):
                mine = [k for k, camera in enumerate(own) if camera == c]
                metrics[f"{start}error_ratio.{kind}.{camera_name(c)}"] = _ratio(
                    [episodes[k] for k in mine], [base[k] for k in mine]
                )
    return metrics


def _ratio(episodes: list[Episode], base: list[Episode]) -> Metric:
    """Median error over that of the same seeds without the fault; seeds are drawn anew."""
    draws, n = np.random.default_rng(0), len(episodes)
    with_fault, without = ([_known(e.error_m) for e in some] for some in (episodes, base))

    def ratio(ks: Sequence[int]) -> float:
        above, below = (np.concatenate([each[k] for k in ks]) for each in (with_fault, without))
        return float(np.median(above) / np.median(below)) if len(above) else math.nan

    again = [ratio(draws.integers(0, n, n).tolist()) for _ in range(RESAMPLES)]
    low, high = (float(each) for each in np.nanpercentile(again, (2.5, 97.5)))
    return Metric(ratio(range(n)), low, high, "-", n)


def _camera_of(k: int, episode: Episode) -> int:
    """Which camera has the fault in episode k."""
    return k % episode.off_px.shape[1]


def _detected(episodes: list[Episode], cameras: list[int]) -> Metric:
    """The share of steps in which the camera with the fault reported anybody."""
    pairs = zip(episodes, cameras, strict=True)
    seen = [float(np.isfinite(each.off_px[:, c]).sum()) for each, c in pairs]
    return ratio_over(seen, [float(len(each.off_px)) for each in episodes], "share")


def _named(start: str, episodes: list[Episode], own: list[int]) -> Metrics:
    """How often, and how soon, the camera with the fault is named as miscalibrated, and others."""
    cameras = [np.arange(each.named.shape[1]) for each in episodes]
    mine = [each.named[:, c == k].any(1) for each, c, k in zip(episodes, cameras, own, strict=True)]
    wrong = [
        each.named[:, c != k].any(1) for each, c, k in zip(episodes, cameras, own, strict=True)
    ]
    first = [float(np.argmax(each)) * STEP_S for each in mine if each.any()]
    steps = [float(len(each.family)) for each in episodes]
    return {
        f"{start}.named": share([bool(each.any()) for each in mine]),
        f"{start}.after_s": quantile_over([[each] for each in first], 0.5, "s"),
        f"{start}.others": ratio_over([float(each.sum()) for each in wrong], steps, "share"),
    }


def _views(found: Measured) -> Metrics:
    metrics: Metrics = {}
    for kind in ROWS:
        for row, views in rows_of(found.views, kind).items():
            metrics[f"detected.{kind}.{row}"] = share([view.error is not None for view in views])
            errors = [view.error for view in views if view.error is not None]
            if errors:
                metrics[f"error_share.{kind}.{row}.median"] = _spread(errors, 50)
                metrics[f"error_share.{kind}.{row}.p95"] = _spread(errors, 95)
    return metrics


def _spread(errors: list[float], q: float) -> Metric:
    draws, values = np.random.default_rng(len(errors)), np.array(errors)
    again = [np.percentile(draws.choice(values, len(values)), q) for _ in range(RESAMPLES)]
    low, high = (float(each) for each in np.percentile(again, (2.5, 97.5)))
    return Metric(float(np.percentile(values, q)), low, high, "share of stature", len(values))


def _phantoms(found: Measured) -> Metrics:
    sums = {
        key: sum(each[key] for each in found.phantoms) for key in ("images", "phantoms", "tracked")
    }
    frames, tracked = float(sums["phantoms"]), float(sums["tracked"])
    return {
        "phantom_frames": Metric(frames, frames, frames, "images", sums["images"]),
        "phantom_tracks": Metric(tracked, tracked, tracked, "steps", sums["images"]),
    }


def _known(values: np.ndarray) -> np.ndarray:
    """Those of single joints, while the worker was tracked."""
    return values[np.isfinite(values)]
