"""Where the time of a step goes: a stacked bar for every number of environments and threads."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks.speed.measured import REST, SINGLE, TOTAL, configurations_of, title
from benchmarks.speed.organs import ORGANS
from hrc_env.core.results import Metric

_COLOURS = (*(f"C{k}" for k in range(7)), "gold", "C9", "0.75")
"""Of the organs, of resets and of the rest."""


def plot_organs(path: Path, metrics: Mapping[str, Metric]) -> None:
    """Bars of microseconds per environment and step; one environment apart from many."""
    groups: tuple[list[str], list[str]] = ([], [])
    for each in configurations_of(metrics):
        groups[each != SINGLE and not each.startswith("1.")].append(each)
    shown = [group for group in groups if group]
    figure = Figure(figsize=(12.5, 7), layout="constrained")
    axes = figure.subplots(
        1, len(shown), squeeze=False, width_ratios=[len(group) + 0.6 for group in shown]
    )[0]
    for axis, group in zip(axes, shown, strict=True):
        _stack(axis, group, metrics)
    axes[0].set_ylabel("microseconds per environment and step", fontsize=13)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        handles[::-1], labels[::-1], loc="outside right center", fontsize=12, frameon=False
    )
    figure.suptitle("What a step costs, level keypoints (time on the wall)", fontsize=15)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110)


def _stack(axis: Axes, group: list[str], metrics: Mapping[str, Metric]) -> None:
    """A bar for each configuration, organ upon organ, the sum above it."""
    x, foot = np.arange(len(group)), np.zeros(len(group))
    for organ, colour in zip((*ORGANS, REST), _COLOURS, strict=True):
        us = np.array([metrics[f"us_per_env_step.{organ}.{each}"].value for each in group])
        axis.bar(x, us, 0.72, foot, label=organ, color=colour, edgecolor="white", linewidth=0.5)
        foot += us
    for place, each in zip(x, group, strict=True):
        total = metrics[f"us_per_env_step.{TOTAL}.{each}"].value
        axis.annotate(
            f"{total:.0f}", (place, foot[place]), (0, 3), textcoords="offset points",
            ha="center", fontsize=12,
        )  # fmt: skip
    axis.set_xticks(x, [title(each).replace(" on ", " in one\n") for each in group], fontsize=11)
    axis.tick_params(axis="y", labelsize=11)
    axis.grid(True, axis="y", color="0.9")
    axis.set_axisbelow(True)
    axis.margins(y=0.08)
