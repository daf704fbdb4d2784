"""The report of the speed benchmark, with tables and a figure of the parts of a step."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from benchmarks.common import list_endings
from benchmarks.speed.declaration import (
    ASKED,
    REACHER,
    SINGLE,
    TASKS,
    make_organs_table,
    make_steps_table,
    title,
)
from benchmarks.speed.organs import ORGANS, REST, TOTAL
from hrc_env.experiments.plots import label_axes, make_figure, save
from hrc_env.experiments.report import Metrics, Report, format_picture

_COLOURS = (*(f"C{k}" for k in range(7)), "gold", "C9", "0.75")
"""Colours of the parts, of resets and of the remaining time."""
SPREAD = "the smallest and the largest of all rounds"
_ABOUT_THE_ORGANS = """\
Measured in separate runs with timers around the functions of each part, which cost about half a
microsecond per call. With two threads the time of a part is divided by two, so that every column is
wall-clock time and half of the column for one thread would be ideal. Waiting time of a thread
belongs to the part that waits, or to the rest. `physics` includes the controller, `distances` the
robot's own bodies, `reward` the task, `reset` the work of all parts in resets, and `rest`
everything else."""


def report(metrics: Metrics, figures: Path) -> Report:
    """Plot `organs.png` and return the report.

    Args:
        metrics: metrics by name.
        figures: folder of the figure.
    """
    tasks = TASKS.to_markdown(metrics)
    if f"env_steps_per_s.{REACHER}.{SINGLE}" not in metrics:
        return Report("Speed of every task", ASKED, [tasks], SPREAD)
    plot_organs(figures / "organs.png", metrics)
    pairs = [name.split(".", 1) for name in list_endings(metrics, "env_steps_per_s.")]
    levels = dict.fromkeys(level for level, _ in pairs if level != REACHER)
    sizes = sorted({configuration for _, configuration in pairs}, key=_size)
    return Report("Speed bench", ASKED, (
        make_steps_table([*levels], sizes).to_markdown(metrics),
        make_organs_table(list_endings(metrics, f"us_per_env_step.{TOTAL}.")).to_markdown(metrics),
        _ABOUT_THE_ORGANS,
        format_picture(figures / "organs.png", "Time of a step by part, level `keypoints` (wall)."),
        tasks,
    ), SPREAD)  # fmt: skip


def _size(configuration: str) -> tuple[int, str]:
    """Return the sort key of a configuration: number of environments, then name."""
    size, _, how = configuration.partition(".")
    return (0, "") if configuration == SINGLE else (int(size), how)


def plot_organs(path: Path, metrics: Metrics) -> None:
    """Plot the times of the parts as stacked bars, with panels for one and many environments."""
    groups: tuple[list[str], list[str]] = ([], [])
    for each in list_endings(metrics, f"us_per_env_step.{TOTAL}."):
        groups[each != SINGLE and not each.startswith("1.")].append(each)
    shown = [group for group in groups if group]
    figure = make_figure(12.5, 7)
    axes = figure.subplots(
        1, len(shown), squeeze=False, width_ratios=[len(group) + 0.6 for group in shown]
    )[0]
    for axis, group in zip(axes, shown, strict=True):
        _stack(axis, group, metrics)
    label_axes(axes[0], y="microseconds per environment and step", grid="y")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles[::-1], labels[::-1], loc="outside right center", frameon=False)
    save(figure, path)


def _bar_title(configuration: str) -> str:
    """Return the label below a bar; that of a batch has two lines."""
    words = title(configuration)
    return words if configuration == SINGLE else f"batch of {words.replace(' on ', chr(10))}"


def _stack(axis: Axes, group: list[str], metrics: Metrics) -> None:
    """Plot a bar of stacked parts for each configuration, with the total above it."""
    x, foot = np.arange(len(group)), np.zeros(len(group))
    for organ, colour in zip((*ORGANS, REST), _COLOURS, strict=True):
        us = np.array([metrics[f"us_per_env_step.{organ}.{each}"].value for each in group])
        axis.bar(x, us, 0.72, foot, label=organ, color=colour, edgecolor="white", linewidth=0.5)
        foot += us
    for place, total in enumerate(foot):
        axis.text(place, total, f"{total:.0f}", ha="center", va="bottom", fontsize=12)
    axis.set_xticks(x, [_bar_title(each) for each in group], fontsize=11)
    axis.margins(y=0.08)
