"""The tracking bench in two pictures: error against occlusion, and calibration."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks.tracking.metrics import Parts
from benchmarks.tracking.names import DEFAULT, DLT, RIVALS
from benchmarks.tracking.own import OWN
from benchmarks.tracking.rigs import RIGS
from benchmarks.tracking.tally import N_LEVELS

_MARKS = ("o", "s", "^", "D", "v", "P", "X", "*")
_LEAST_OBSERVATIONS = 30


def plot_error(path: Path, parts: Parts) -> None:
    """RMSE against how many cameras see the joint at that moment, `occluded` and `hard`."""
    figure = Figure(figsize=(11, 8), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    views = np.arange(4, -1, -1)
    for row, condition in enumerate(("occluded", "hard")):
        for column, rig in enumerate(RIGS):
            axis = axes[row, column]
            for k, name in enumerate((DEFAULT, *RIVALS)):
                sums = parts[rig, condition, name][condition]
                squared = np.array(sums["squared_by_views"]).sum(0)[views]
                n = np.array(sums["n_by_views"]).sum(0)[views]
                error_cm = 100 * np.sqrt(squared / np.maximum(n, 1))
                enough = n >= _LEAST_OBSERVATIONS
                axis.plot(np.arange(5), np.where(enough, error_cm, np.nan), **_style(k, name))
            axis.set_title(f"{rig}, {condition}", fontsize=13)
    for axis in axes[:, 0]:
        axis.set_ylabel("RMSE [cm], log scale", fontsize=12)
    for axis in axes[1]:
        axis.set_xticks(np.arange(5), [str(k) for k in views])
        axis.set_xlabel("cameras that see the joint", fontsize=12)
    axes[0, 0].set_yscale("log")
    _finish(figure, axes, path, "Error against occlusion")


def plot_calibration(path: Path, parts: Parts) -> None:
    """Share of joints within the reported region, against what the region claims."""
    shown = [(rig, what) for rig in RIGS for what in ("clean", "hard", "one_camera")]
    shown += [(OWN, what) for what in ("four_cameras", "two_cameras", "one_camera")]
    figure = Figure(figsize=(12, 12.8), layout="constrained")
    axes = figure.subplots(3, 3, sharex=True, sharey=True)
    claimed = np.arange(N_LEVELS + 1) / N_LEVELS
    for axis, (rig, condition) in zip(axes.flat, shown, strict=True):
        axis.plot([0, 1], [0, 1], color="0.6", linestyle="--", label="honest")
        for k, name in enumerate((DEFAULT, *RIVALS)):
            if name == DLT:
                continue
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
        "linewidth": 2.4 if name == DEFAULT else 1.4,
        "zorder": 3 if name == DEFAULT else 2,
        "label": "per-frame DLT" if name == DLT else name,
    }


def _finish(figure: Figure, axes: np.ndarray, path: Path, title: str) -> None:
    """Grid, legend below, and the file."""
    for axis in axes.ravel():
        axis.grid(True, which="both", color="0.9")
        axis.tick_params(labelsize=11)
    first: Axes = axes.flat[0]
    handles, labels = first.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=min(len(labels), 5), fontsize=12
    )
    figure.suptitle(title, fontsize=15)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110)
