"""The report of the price study: bar chart of throughput, margins and contrasts."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from hrc_env.core.results import Metric
from hrc_env.experiments.plots import compute_error_bars, label_axes, make_figure, save
from hrc_env.experiments.price import declaration
from hrc_env.experiments.price.declaration import MORE, count_per_hour
from hrc_env.experiments.price.metrics import Played, Row
from hrc_env.experiments.price.setups import FOUR, GROUPS, QUICK, PriceSetup, list_setups
from hrc_env.experiments.price.shield import SHIELD
from hrc_env.experiments.report import Metrics, Report, Table, format_picture

if TYPE_CHECKING:
    from hrc_env.experiments.price.experiment import Price

COLOURS = {
    "truth": "0.25", "estimator": "#2f6db3", "cameras": "#3a9a8f", "latency": "#d1793b",
    "calibration": "#b23a48", "covariance": "#8a6bb8", "fault": "#8c7a4f",
}  # fmt: skip
"""Colours of the groups of setups in the figure."""


def make_report(figures: Path, config: "Price", played: Played, metrics: Metrics) -> Report:
    """Draw the figure and return the report.

    Args:
        figures: folder of the figure.
        config: settings of the study.
        played: episodes of the study.
        metrics: metrics by name.
    """
    task, table = config.task, played.table
    setups = [list_setups()[name] for name in table[task]]

    def state(table: Table) -> str:
        return replace(table, conditions=config.conditions).to_markdown(metrics)

    draw_price(figures / "price.png", metrics, task, setups, config.level)
    parts = [
        format_picture(figures / "price.png", "Goals that remain at that rate of contacts, in "
                       "percent of a robot's without a shield; whiskers are 95 % intervals."),
        config.make_price_table(MORE).to_markdown(metrics),
        state(declaration.make_unshielded_table(task)),
        _describe_open_ends(task, table[task], metrics),
        state(declaration.WORTH),
    ]  # fmt: skip
    if config.others:
        tasks_table = declaration.make_tasks_table(config.tasks)
        parts += ["## Other tasks", state(tasks_table)]
        tables = map(declaration.make_small_price_table, config.others)
        parts += map(state, tables)
    if played.pixels:
        parts += [
            f"## Emulator and rendered images\n\n{config.n_pixels} episodes with the margin of "
            f"`{FOUR}`; the same for both, and too few for a bar.",
            replace(declaration.IMAGES, conditions=config.image_conditions).to_markdown(metrics),
        ]
    question = declaration.QUESTION.format(
        level=config.level, hourly=count_per_hour(config.level), shield=SHIELD,
        n_seeds=config.n_seeds, n_fresh=config.n_fresh, robot=config.driver.words,
    )  # fmt: skip
    return Report(declaration.TITLE, question, [*filter(None, parts)])


def _describe_open_ends(task: str, rows: Mapping[str, Row], metrics: Metrics) -> str:
    """Return a note on setups that reach the level with none of the margins; "" if all reach it."""
    margins_m = {name: metrics[f"{task}.{name}.margin_m"].value for name in rows}
    beyond = [f"`{name}`" for name, row in rows.items() if row.ends_at(margins_m[name])]
    if not beyond:
        return ""
    unsure = [
        f"`{name}` ({row.margin_m:+.3f} m)"
        for name, row in rows.items()
        if row.ends_at(margins_m[name]) and abs(row.margin_m - margins_m[name]) > 1e-6
    ]
    note = (
        f" For {', '.join(unsure)}, fresh seeds with the margin that the search found contradict "
        "it, but are too few to determine it."
    )
    return (
        f"For {', '.join(beyond)}, the level was not reached within the tested margins: the margin "
        f"is the last one tested, and the throughput is a bound.{note if unsure else ''}"
    )


def choose_bars(metrics: Metrics, task: str, setups: Sequence[PriceSetup]) -> list[PriceSetup]:
    """Return the setups of the figure by increasing throughput; if there are many, only `QUICK`."""
    shown = [each for each in setups if len(setups) <= len(QUICK) or each.name in QUICK]
    return sorted(shown, key=lambda each: metrics[f"{task}.{each.name}.share"].value)


def draw_price(
    path: Path, metrics: Metrics, task: str, setups: Sequence[PriceSetup], level: float
) -> None:
    """Draw a bar for each setup of `choose_bars`, with the longest on top.

    Args:
        path: picture file to write.
        metrics: metrics by name.
        task: id of the environment.
        setups: setups that have metrics in the task.
        level: contacts in 1,000 episodes of 10 s at which setups are compared.
    """
    shown = choose_bars(metrics, task, setups)
    figure = make_figure(9.2, 1.6 + 0.42 * len(shown))
    axis = figure.subplots()
    values = [metrics[f"{task}.{setup.name}.share"] for setup in shown]
    axis.barh(
        range(len(shown)), [100 * value.value for value in values],
        xerr=compute_error_bars(values, 100.0),
        color=[COLOURS[setup.group] for setup in shown], height=0.72, ecolor="0.35", capsize=3,
    )  # fmt: skip
    _label_bars(axis, shown, values)
    used = [name for name in GROUPS if name in {setup.group for setup in shown}]
    bars: list[Any] = [axis.barh(0, 0, color=COLOURS[name]) for name in used]
    words = [GROUPS[name] for name in used]
    figure.legend(bars, words, loc="outside lower center", ncols=2, fontsize=10)
    figure.suptitle(
        f"Throughput at {count_per_hour(level):.1f} contacts towards the worker per hour\n"
        "emulated detections, margin of one shield", fontsize=13,
    )  # fmt: skip
    save(figure, path)


def _label_bars(axis: Axes, shown: Sequence[PriceSetup], values: Sequence[Metric]) -> None:
    """Write the names of setups beside their bars, and numbers into them."""
    axis.set_yticks(range(len(shown)), [setup.words for setup in shown], fontsize=12)
    for y, value in enumerate(values):
        if value.value == value.value:
            axis.text(1.2, y, f"{100 * value.value:.0f} %", va="center", color="white",
                      fontsize=12, fontweight="bold")  # fmt: skip
    label_axes(axis, "throughput in % of a robot without a shield", grid="x")
    axis.set_xlim(0, np.nanmax([100.0, *(100 * value.high for value in values)]))
    for side in ("top", "right", "left"):
        axis.spines[side].set_visible(False)
    axis.tick_params(axis="y", length=0)
