"""The report of the ablations, with a text, a figure and a table for each ablation."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hrc_env.experiments.ablations.ablation import Ablation
from hrc_env.experiments.ablations.declaration import ABLATIONS, QUESTION, TITLE, list_columns
from hrc_env.experiments.plots import (
    compute_error_bars,
    label_axes,
    make_figure,
    save,
    use_plain_log_ticks,
)
from hrc_env.experiments.report import Metrics, Report, Table, format_metrics, format_picture

QUANTILES = {"median": ("median", "o", "#1565c0"), "p95": ("95th percentile", "s", "#e65100")}


def make_report(
    figures: Path, ablations: Sequence[Ablation], tables: Sequence[Table], metrics: Metrics
) -> Report:
    """Draw a figure for each ablation and return the report.

    Args:
        figures: folder of the figures.
        ablations: the ablations.
        tables: tables over all ablations, which are shown first.
        metrics: metrics of the study by name.
    """
    is_whole = len(ablations) == len(ABLATIONS)
    parts = [each.to_markdown(metrics) for each in tables if is_whole]
    for ablation in ablations:
        key, path = ablation.name, figures / f"{ablation.name}.png"
        rows = {setting.name: setting.words for setting in ablation.settings}
        rows |= {name: w for name, w in ablation.also.items() if f"rmse_m.{key}.{name}" in metrics}
        draw(path, key, rows, metrics)
        parts += [
            f"## {ablation.title}\n\n{ablation.question}",
            format_picture(path, "Error of a joint in each setting."),
            format_metrics(
                "setting",
                {f"{key}.{name}": words for name, words in rows.items()},
                list_columns(ablation),
                metrics,
            ),
        ]
    return Report(TITLE, QUESTION, [*filter(None, parts)])


def draw(path: Path, key: str, rows: Mapping[str, str], metrics: Metrics) -> None:
    """Draw the errors of all rows with intervals, and print their coverage on the right."""
    places = np.arange(len(rows), dtype=float)[::-1]
    figure = make_figure(9, 0.3 * len(rows) + 1.6)
    axis = figure.subplots()
    across = axis.get_yaxis_transform()
    for quantile, (words, mark, colour) in QUANTILES.items():
        values = [metrics[f"error_m.{key}.{row}.{quantile}"] for row in rows]
        errors_mm, bars = [1000 * m.value for m in values], compute_error_bars(values, 1000)
        axis.errorbar(errors_mm, places, xerr=bars, fmt=mark, capsize=3, color=colour, label=words)
    for place, row in zip(places, rows, strict=True):
        inside = f"{100 * metrics[f'coverage95.{key}.{row}'].value:.0f} %"
        axis.text(1.02, place, inside, transform=across, fontsize=11, va="center", color="0.3")
    axis.text(1.02, len(rows) - 0.15, "coverage", transform=across, fontsize=10, color="0.3")
    axis.set_yticks(places, list(rows.values()))
    axis.set_ylim(-0.7, len(rows) - 0.3)
    axis.set_xscale("log")
    use_plain_log_ticks(axis.xaxis)
    label_axes(axis, "error of a joint [mm]")
    figure.legend(loc="outside lower center", ncols=2)
    save(figure, path)
