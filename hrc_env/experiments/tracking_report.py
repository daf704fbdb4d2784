"""The tracking bench as people read it: a Markdown table and two plots."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hrc_env.experiments.tracking_cells import DLT, FULL_STATE, MATCHED, N_LEVELS
from hrc_env.experiments.tracking_metrics import Parts
from hrc_env.experiments.tracking_rigs import RIGS
from hrc_env.results import Metric

ROWS = ("clean", "occluded", "hard", "one_camera", "after_return", MATCHED)
_MARKS = ("o", "s", "^", "D", "v", "P", "X", "*")
_CALIBRATED = ("clean", "hard", "one_camera")


def write_report(
    out: Path, parts: Parts, metrics: Mapping[str, Metric], estimators: list[str]
) -> None:
    """Write tracking.md, error_by_views.png and calibration.png into `out`."""
    (out / "tracking.md").write_text(markdown(metrics, estimators))
    _plot_error(out / "error_by_views.png", parts, [*estimators, DLT])
    _plot_calibration(out / "calibration.png", parts, estimators)


def markdown(metrics: Mapping[str, Metric], estimators: list[str]) -> str:
    """The tables: errors, honesty, the bound and the cost."""
    names = [*estimators, DLT]
    blocks = [
        "# Tracking bench\n\nIntervals are 95 % bootstrap intervals over sequences.",
        "## RMSE in cm\n\n" + _table(metrics, "rmse_m", names, 100, 2, True),
        "## Median error in cm\n\n" + _table(metrics, "median_m", names, 100, 2, False),
        "## Coverage of the reported 95 % region\n\n"
        + _table(metrics, "coverage95", estimators, 1, 3, False),
        "## Reported standard deviation / RMSE\n\n"
        + _table(metrics, "std_over_rmse", estimators, 1, 2, False),
        "## Normalised estimation error squared per degree of freedom\n\n"
        + _table(metrics, "nees", estimators, 1, 2, False),
        "## Share of frames facing the wrong way\n\n"
        + _table(metrics, "mirrored", names, 1, 4, False),
        "## RMSE / posterior Cramer-Rao bound, matched sequences\n\n"
        + _bound(metrics, [*names, FULL_STATE])
        + "\n\n`full_state` filters all 90 states with the model these sequences were drawn from.",
        "## Microseconds per worker and update, one core\n\n" + _cost(metrics, estimators),
    ]
    return "\n\n".join(blocks) + "\n"


def _table(
    metrics: Mapping[str, Metric],
    kind: str,
    names: list[str],
    scale: float,
    digits: int,
    interval: bool,
) -> str:
    """One row per rig and condition, one column per estimator."""
    rows = []
    for rig in RIGS:
        for condition in ROWS:
            cells = [metrics[f"{kind}.{rig}.{condition}.{name}"] for name in names]
            rows.append([f"{rig} {condition}", *(_cell(m, scale, digits, interval) for m in cells)])
    return _lines(["", *names], rows)


def _bound(metrics: Mapping[str, Metric], names: list[str]) -> str:
    rows = [["both rigs", *(_cell(metrics[f"ratio_to_bound.{n}"], 1, 3, True) for n in names)]]
    for rig in RIGS:
        cells = [metrics[f"ratio_to_bound_in.{rig}.{name}"] for name in names]
        rows.append([rig, *(_cell(metric, 1, 3, True) for metric in cells)])
    return _lines(["", *names], rows)


def _cost(metrics: Mapping[str, Metric], estimators: list[str]) -> str:
    rows = []
    for batch, title in (
        ("1", "batch 1"),
        ("64", "batch 64"),
        ("hard_64", "batch 64, mean over hard"),
    ):
        cells = [metrics[f"update_us.{name}.{batch}"] for name in estimators]
        rows.append([title, *(_cell(metric, 1, 1, True) for metric in cells)])
    return _lines(["", *estimators], rows)


def _cell(metric: Metric, scale: float, digits: int, interval: bool) -> str:
    text = f"{scale * metric.value:.{digits}f}"
    if interval:
        text += f" ({scale * metric.low:.{digits}f}-{scale * metric.high:.{digits}f})"
    return text


def _lines(header: list[str], rows: list[list[str]]) -> str:
    rule = ["---", *["---:"] * (len(header) - 1)]
    return "\n".join("| " + " | ".join(row) + " |" for row in (header, rule, *rows))


def _plot_error(path: Path, parts: Parts, names: list[str]) -> None:
    """RMSE against how many cameras see the joint at that moment, `occluded` and `hard`."""
    figure = Figure(figsize=(11, 8), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    views = np.arange(4, -1, -1)
    for row, condition in enumerate(("occluded", "hard")):
        for column, rig in enumerate(RIGS):
            axis = axes[row, column]
            for k, name in enumerate(names):
                sums = parts[rig, condition, name][condition]
                squared = np.array(sums["squared_by_views"]).sum(0)[views]
                n = np.array(sums["n_by_views"]).sum(0)[views]
                error_cm = 100 * np.sqrt(squared / np.maximum(n, 1))
                axis.plot(np.arange(5), np.where(n > 0, error_cm, np.nan), **_style(k, name))
            axis.set_title(f"{rig}, {condition}", fontsize=13)
    for axis in axes[:, 0]:
        axis.set_ylabel("RMSE [cm], log scale", fontsize=12)
    for axis in axes[1]:
        axis.set_xticks(np.arange(5), [str(k) for k in views])
        axis.set_xlabel("cameras that see the joint", fontsize=12)
    axes[0, 0].set_yscale("log")
    _finish(figure, axes, path, "Error against occlusion")


def _plot_calibration(path: Path, parts: Parts, names: list[str]) -> None:
    """Share of joints within the reported region, against what the region claims."""
    figure = Figure(figsize=(13, 8.5), layout="constrained")
    axes = figure.subplots(len(RIGS), len(_CALIBRATED), sharex=True, sharey=True)
    claimed = np.arange(N_LEVELS + 1) / N_LEVELS
    for row, rig in enumerate(RIGS):
        for column, condition in enumerate(_CALIBRATED):
            axis = axes[row, column]
            axis.plot([0, 1], [0, 1], color="0.6", linestyle="--", label="honest")
            for k, name in enumerate(names):
                levels = np.array(parts[rig, condition, name][condition]["levels"]).sum(0)
                held = np.concatenate([[0], np.cumsum(levels) / levels.sum()])
                axis.plot(claimed, held, **_style(k, name), markevery=(k % 4, 4))
            axis.set_title(f"{rig}, {condition}", fontsize=13)
            axis.set_aspect("equal")
    for axis in axes[:, 0]:
        axis.set_ylabel("share of joints inside it", fontsize=12)
    for axis in axes[-1]:
        axis.set_xlabel("probability that the region claims", fontsize=12)
    _finish(figure, axes, path, "Calibration: under the diagonal is over-confident")


def _style(k: int, name: str) -> dict[str, object]:
    """Colour and mark of the k-th estimator."""
    return {
        "color": "black" if name == DLT else f"C{k}",
        "marker": _MARKS[k % len(_MARKS)],
        "markersize": 6,
        "linewidth": 1.6,
        "label": "per-frame DLT" if name == DLT else name,
    }


def _finish(figure: Figure, axes: np.ndarray, path: Path, title: str) -> None:
    """Grid, legend below, and the file."""
    for axis in axes.ravel():
        axis.grid(True, which="both", color="0.9")
        axis.tick_params(labelsize=11)
    first: Axes = axes.flat[0]
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=12)
    figure.suptitle(title, fontsize=15)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110)
