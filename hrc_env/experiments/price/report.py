"""The report of the price study: figures of throughput against contacts, and tables."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from hrc_env.core.results import Metric
from hrc_env.experiments.plots import label_axes, make_figure, save, use_plain_log_ticks
from hrc_env.experiments.price import declaration
from hrc_env.experiments.price.metrics import Played
from hrc_env.experiments.price.setups import find_setups
from hrc_env.experiments.report import Metrics, Report, Table, format_picture

if TYPE_CHECKING:
    from hrc_env.experiments.price.experiment import Price

COLOURS = (
    "0.2", "#2f6db3", "#3a9a8f", "#7fb069", "#d1793b", "#e0b03c", "#8a6bb8", "#b23a48",
)  # fmt: skip
MARKERS = "oosDvP^X"
"""Colours and markers of the perception setups in the figures, in their order."""


def make_report(figures: Path, config: "Price", played: Played, metrics: Metrics) -> Report:
    """Draw the figures and return the report.

    Args:
        figures: folder of the figures.
        config: settings of the study.
        played: episodes of the study.
        metrics: metrics by name.
    """
    setups = find_setups(config.setups)

    def state(table: Table, on_choosing_seeds: bool = False) -> str:
        conditions = config.choosing_conditions if on_choosing_seeds else config.conditions
        return replace(table, conditions=conditions).to_markdown(metrics)

    draw_frontier(figures / "frontier.png", config, played, metrics, "towards")
    draw_frontier(figures / "severity.png", config, played, metrics, "severe")
    levels = " and ".join(f"{level:g}" for level in config.levels_per_hour)
    parts = [
        format_picture(figures / "frontier.png", "Every point is a setting of the shield on the "
                       "proof seeds, with 95 % intervals; triangles to the left are upper ends of "
                       "intervals without a contact. Dotted: the levels."),
        state(declaration.make_best_table(setups, config.levels_per_hour)),
        state(declaration.make_worth_table(config.levels_per_hour)),
        state(declaration.make_unshielded_table()),
        "## Severity",
        format_picture(figures / "severity.png", "The same settings by their contacts with an "
                       "estimated force above the limit of the touched region."),
        f"## All settings\n\n{config.n_kept} settings of each perception setup were kept.",
        state(declaration.make_frontier_table(setups)),
        state(declaration.make_choosing_table(setups), on_choosing_seeds=True),
    ]  # fmt: skip
    question = declaration.QUESTION.format(
        levels=levels, robot=config.driver.words, n_settings=config.n_settings,
        n_kept=config.n_kept, n_choosing=config.n_choosing, n_proof=config.n_proof,
    )  # fmt: skip
    return Report(declaration.TITLE, question, [*filter(None, parts)])


WORDS = {
    "towards": "contacts towards the worker per hour",
    "severe": "contacts above the force limit per hour",
}
"""Labels of the axis of contacts, by the name of the metric."""


def draw_frontier(
    path: Path, config: "Price", played: Played, metrics: Metrics, contacts: str
) -> None:
    """Draw the throughput of all settings on the proof seeds against a rate of contacts.

    Args:
        path: picture file to write.
        config: settings of the study.
        played: episodes of the study.
        metrics: metrics by name.
        contacts: name of the metric of contacts, one of `WORDS`.
    """
    figure = make_figure(9.2, 6.0)
    axis = figure.subplots()
    axis.set_xscale("log")
    for k, setup in enumerate(find_setups(config.setups)):
        rows = [f"{setup.name}.{setting}." for setting in played.proof[setup.name]]
        points = [(metrics[f"{row}{contacts}"], metrics[f"{row}share"]) for row in rows]
        colour = COLOURS[k % len(COLOURS)]
        known = sorted((x.value, 100 * y.value) for x, y in points if x.value > 0)
        axis.plot(*zip(*known, strict=True) if known else ([], []), color=colour, alpha=0.35)
        for x, y in points:
            _draw_point(axis, x, y, colour, MARKERS[k % len(MARKERS)])
        axis.plot([], [], MARKERS[k % len(MARKERS)], color=colour, label=setup.words)
    if contacts == "towards":
        for level_per_hour in config.levels_per_hour:
            axis.axvline(level_per_hour, color="0.4", linestyle=":", zorder=0)
    label_axes(axis, WORDS[contacts], "throughput [% of unshielded]")
    use_plain_log_ticks(axis.xaxis)
    figure.legend(loc="outside lower center", ncols=4, fontsize=10)
    save(figure, path)


def _draw_point(axis: Axes, x: Metric, y: Metric, colour: str, marker: str) -> None:
    """Draw a setting with its intervals; a rate of zero is a triangle at the interval's end."""
    if not (np.isfinite(y.value) and np.isfinite(x.high)):
        return
    at = x.value or x.high
    axis.plot(at, 100 * y.value, marker if x.value else "<", color=colour,
              fillstyle="full" if x.value else "none", markersize=7)  # fmt: skip
    low = x.low if x.low > 0 else at
    axis.plot([low, x.high], [100 * y.value] * 2, color=colour, linewidth=1, alpha=0.7)
    if np.isfinite([y.low, y.high]).all():
        axis.plot([at, at], [100 * y.low, 100 * y.high], color=colour, linewidth=1, alpha=0.7)
