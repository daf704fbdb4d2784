"""The perception bench in three pictures: speed, detection, faults."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks.perception.speed import REST, STAGES
from benchmarks.perception.views import ROWS
from hrc_env.core.results import Metric
from hrc_env.perception.faults.fault import KINDS

_Metrics = Mapping[str, Metric]
LEAST_COVERAGE, MOST_RATIO = 0.9, 1.5
"""What is asked for: of coverage, and of the error with one camera lost."""


def plot_speed(path: Path, metrics: _Metrics) -> None:
    """Milliseconds of a step, stage upon stage, for numbers of cameras and workers."""
    start = "steps_per_s."
    keys = [name.removeprefix(start) for name in metrics if name.startswith(start)]
    figure = Figure(figsize=(10, 6), layout="constrained")
    axis, foot = figure.subplots(), np.zeros(len(keys))
    for k, stage in enumerate((*STAGES, REST)):
        ms = np.array([metrics[f"stage_ms.{stage}.{key}"].value for key in keys])
        axis.bar(np.arange(len(keys)), ms, 0.7, foot, label=stage, color=f"C{k}", edgecolor="white")
        foot += ms
    for k, key in enumerate(keys):
        rate = metrics[start + key].value
        axis.annotate(
            f"{rate:.0f}/s", (k, foot[k]), (0, 3), textcoords="offset points", ha="center",
            fontsize=12,
        )  # fmt: skip
    axis.set_xticks(np.arange(len(keys)), [_title(key) for key in keys], fontsize=11)
    axis.set_ylabel("milliseconds of a step", fontsize=12)
    axis.grid(True, axis="y", color="0.9")
    axis.set_axisbelow(True)
    axis.legend(fontsize=11)
    _finish(figure, path, "What a step costs, level pixels; steps a second above")


def plot_views(path: Path, metrics: _Metrics) -> None:
    """Detection rate and error of single crops, row by row."""
    names = [
        (kind, name.removeprefix(f"detected.{kind}."))
        for kind in ROWS for name in metrics if name.startswith(f"detected.{kind}.")
    ]  # fmt: skip
    figure = Figure(figsize=(12, 1.5 + 0.34 * len(names)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    y = np.arange(len(names))[::-1]
    kinds = list(ROWS)
    colours = [f"C{kinds.index(kind)}" for kind, _ in names]
    seen = [metrics[f"detected.{kind}.{row}"] for kind, row in names]
    _bars(left, y, seen, 100, colours)
    left.set_xlabel("detected [%]", fontsize=12)
    left.set_xlim(min(80.0, 100 * min(m.low for m in seen if m.n) - 2), 100)
    nothing = Metric(np.nan, np.nan, np.nan, "", 0)
    for q, alpha in (("p95", 0.35), ("median", 1.0)):
        error = [metrics.get(f"error_share.{k}.{row}.{q}", nothing) for k, row in names]
        _bars(right, y, error, 100, colours, alpha)
    right.set_xlabel("error, median and (pale) 95th percentile [% of stature]", fontsize=12)
    left.set_yticks(y, [f"{kind}: {row.replace('_', ' ')}" for kind, row in names], fontsize=10)
    _finish(figure, path, "Single crops, looked at as if for the first time")


def plot_faults(path: Path, metrics: _Metrics) -> None:
    """Error ratio and coverage of every fault at both levels."""
    kinds = [kind for kind in KINDS if f"error_ratio.{kind}" in metrics]
    figure = Figure(figsize=(12, 8), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    y = np.arange(len(kinds))[::-1]
    nothing = Metric(np.nan, np.nan, np.nan, "", 0)
    for start, level, shift, colour in (
        ("", "pixels", 0.2, "C0"), ("keypoints.", "keypoints", -0.2, "C1"),
    ):  # fmt: skip
        for axis, what in ((left, "error_ratio"), (right, "coverage95")):
            found = [metrics.get(f"{start}{what}.{kind}", nothing) for kind in kinds]
            _bars(axis, y + shift, found, 1, [colour] * len(kinds), height=0.38, label=level)
    left.axvline(MOST_RATIO, color="0.3", linestyle="--")
    right.axvline(LEAST_COVERAGE, color="0.3", linestyle="--")
    left.set_xlabel("median error with / without the fault", fontsize=12)
    right.set_xlabel("joints inside the reported 95 % region", fontsize=12)
    right.set_xlim(0.5, 1.0)
    left.set_yticks(y, kinds, fontsize=11)
    figure.legend(
        *left.get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=11
    )
    _finish(figure, path, "One of four cameras has a fault")


def _bars(
    axis: Axes, y: np.ndarray, metrics: list[Metric], scale: float, colours: list[str],
    alpha: float = 1.0, height: float = 0.7, label: str | None = None,
) -> None:  # fmt: skip
    """Bars with intervals."""
    value, low, high = (
        scale * np.array([getattr(metric, name) for metric in metrics])
        for name in ("value", "low", "high")
    )
    axis.barh(y, value, height, color=colours, alpha=alpha, label=label)
    away = np.maximum(np.stack([value - low, high - value]), 0.0)
    axis.errorbar(value, y, xerr=away, fmt="none", ecolor="0.25", elinewidth=1, capsize=2)
    axis.grid(True, axis="x", color="0.9")
    axis.set_axisbelow(True)


def _title(key: str) -> str:
    cameras, workers, *special = key.split(".")
    plural = "s" if cameras != "1" else "", "s" if workers != "1" else ""
    lines = (f"{cameras} camera{plural[0]}", f"{workers} worker{plural[1]}", *special)
    return "\n".join(lines)


def _finish(figure: Figure, path: Path, title: str) -> None:
    figure.suptitle(title, fontsize=14)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110)
