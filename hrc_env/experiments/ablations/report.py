"""The report: question by question what was asked, a picture and a table."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hrc_env.experiments.ablations.ablation import Ablation
from hrc_env.experiments.ablations.declaration import ABLATIONS, ASKED, TITLE, columns_of
from hrc_env.experiments.plots import ends, label, new_figure, plain_log, save
from hrc_env.experiments.report import Metrics, Report, Table, picture, table_of

QUANTILES = {"median": ("median", "o", "#1565c0"), "p95": ("95th percentile", "s", "#e65100")}


def report(
    figures: Path, ablations: Sequence[Ablation], tables: Sequence[Table], metrics: Metrics
) -> Report:
    """Draw a figure for each question; return the tables beside them.

    Args:
        figures: folder.
        ablations: the questions.
        tables: of all questions, which come first.
        metrics: of the study.
    """
    is_whole = len(ablations) == len(ABLATIONS)
    parts = [each.markdown(metrics) for each in tables if is_whole]
    for ablation in ablations:
        key, path = ablation.name, figures / f"{ablation.name}.png"
        rows = {setting.name: setting.words for setting in ablation.settings}
        rows |= {name: w for name, w in ablation.also.items() if f"rmse_m.{key}.{name}" in metrics}
        draw(path, key, rows, metrics)
        parts += [
            f"## {ablation.title}\n\n{ablation.asked}",
            picture(path, "Error of a joint in each setting."),
            table_of(
                "setting",
                {f"{key}.{name}": words for name, words in rows.items()},
                columns_of(ablation),
                metrics,
            ),
        ]
    return Report(TITLE, ASKED, [*filter(None, parts)])


def draw(path: Path, key: str, rows: Mapping[str, str], metrics: Metrics) -> None:
    """Errors of all rows with intervals, and coverage as numbers at the right."""
    places = np.arange(len(rows), dtype=float)[::-1]
    figure = new_figure(9, 0.3 * len(rows) + 1.6)
    axis = figure.subplots()
    across = axis.get_yaxis_transform()
    for quantile, (words, mark, colour) in QUANTILES.items():
        found = [metrics[f"error_m.{key}.{row}.{quantile}"] for row in rows]
        errors_mm, bars = [1000 * each.value for each in found], ends(found, 1000)
        axis.errorbar(errors_mm, places, xerr=bars, fmt=mark, capsize=3, color=colour, label=words)
    for place, row in zip(places, rows, strict=True):
        inside = f"{100 * metrics[f'coverage95.{key}.{row}'].value:.0f} %"
        axis.text(1.02, place, inside, transform=across, fontsize=11, va="center", color="0.3")
    axis.text(1.02, len(rows) - 0.15, "coverage", transform=across, fontsize=10, color="0.3")
    axis.set_yticks(places, list(rows.values()))
    axis.set_ylim(-0.7, len(rows) - 0.3)
    axis.set_xscale("log")
    plain_log(axis.xaxis)
    label(axis, "error of a joint [mm]")
    figure.legend(loc="outside lower center", ncols=2)
    save(figure, path)
