"""The report: question by question what was asked, a picture and a table."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from hrc_env.experiments.ablations.ablation import Ablation, Curves, Rows
from hrc_env.experiments.study.plots import COLOURS, label, new_figure, plain_log, points, save
from hrc_env.experiments.study.report import Column, Metrics, Picture, Report, table_of

QUANTILES = {"median": ("median", "o", "-", 1.0), "p95": ("95th percentile", "s", "--", 0.6)}
"""Words, mark, line and strength."""
CURVES_IN, ROWS_IN, HIGH_IN, ROW_IN = 5.4, 8.2, 5.2, 0.36
"""Sizes of panels, and of a row [inches]."""
ASKED = """\
What the paper's two experiments leave open. Detections are those of the calibrated emulator
(`perception="keypoints"`): these are questions about estimators and rigs. The estimator is the
default, `particle`, unless a setting says otherwise; settings are changed one at a time. Workers of
all bodies work beside an arm that rests, on the same walks in every setting of a scene.

Every joint of every frame after the first second counts, also where the track is lost: the last
word, or the prior, is then the answer. *Coverage*: the share of joints within the reported 95 %
region; *lost*: the share of time without a track; *us an update*: processor time of one thread."""


def report(figures: Path, ablations: Sequence[Ablation], metrics: Metrics) -> Report:
    """Draw a figure for each question; tables beside them."""
    parts: list = []
    for ablation in ablations:
        path = figures / f"{ablation.name}.png"
        draw(path, ablation, metrics)
        parts += [f"## {ablation.title}\n\n{ablation.asked}", Picture(path, ablation.title)]
        key = ablation.name
        columns = [
            Column(f"error_m.{key}.{{}}.median", "median [mm]", 1, 1000),
            Column(f"error_m.{key}.{{}}.p95", "95th percentile [mm]", 0, 1000),
            Column(f"rmse_m.{key}.{{}}", "RMSE [mm]", 0, 1000),
            Column(f"coverage95.{key}.{{}}", "coverage [%]", 1, 100),
            Column(f"lost.{key}.{{}}", "lost [%]", 2, 100),
        ]
        if any(setting.is_timed for setting in ablation.settings):
            columns.append(Column(f"update_us.{key}.{{}}", "us an update", 0))
        rows = {setting.name: setting.words for setting in ablation.settings}
        rows |= {name: w for name, w in ablation.also.items() if f"rmse_m.{key}.{name}" in metrics}
        parts.append(table_of("setting", rows, columns, metrics))
    return Report("Ablations of rigs, detections and estimators", ASKED, parts)


def draw(path: Path, ablation: Ablation, metrics: Metrics) -> None:
    """A question's picture: its panels side by side."""
    widths = [CURVES_IN if isinstance(panel, Curves) else ROWS_IN for panel in ablation.panels]
    most = max((len(panel.settings) for panel in ablation.panels if isinstance(panel, Rows)),
               default=0)  # fmt: skip
    figure = new_figure(max(sum(widths), 7.0), max(HIGH_IN, ROW_IN * most + 1.8))
    axes = figure.subplots(1, len(widths), squeeze=False, width_ratios=widths)[0]
    for axis, panel in zip(axes, ablation.panels, strict=True):
        if isinstance(panel, Curves):
            _draw_curves(axis, ablation.name, panel, metrics)
        else:
            _draw_rows(axis, ablation.name, panel, metrics)
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2, fontsize=9.5)
    save(figure, path)


def _draw_curves(axis: Axes, key: str, panel: Curves, metrics: Metrics) -> None:
    """Median and 95th percentile along every line."""
    for colour, (name, line) in zip(COLOURS, panel.lines.items(), strict=False):
        known = {x: each for x, each in line.items() if f"rmse_m.{key}.{each}" in metrics}
        if panel.by_time:
            known = {metrics[f"update_us.{key}.{each}"].value: each for each in known.values()}
        for quantile, (words, mark, style, alpha) in QUANTILES.items():
            points(
                axis, list(known),
                [metrics[f"error_m.{key}.{each}.{quantile}"] for each in known.values()], 1000,
                fmt=mark, linestyle=style if len(known) > 1 else "none", color=colour, alpha=alpha,
                label=words if len(panel.lines) == 1 else f"{name}: {words}",
            )  # fmt: skip
    label(axis, panel.across, "error of a joint [mm]", panel.title)
    axis.set_yscale("log")
    plain_log(axis.yaxis)
    if panel.is_log:
        axis.set_xscale("log")
        plain_log(axis.xaxis)
    else:
        axis.set_xticks(sorted({x for line in panel.lines.values() for x in line}))


def _draw_rows(axis: Axes, key: str, panel: Rows, metrics: Metrics) -> None:
    """Errors as marks; coverage as numbers at the right."""
    places = np.arange(len(panel.settings))[::-1]
    for colour, (quantile, (words, mark, *_)) in zip(COLOURS, QUANTILES.items(), strict=False):
        found = [metrics[f"error_m.{key}.{each.name}.{quantile}"] for each in panel.settings]
        points(axis, places, found, 1000, sideways=True, fmt=mark, color=colour, label=words)
    across = axis.get_yaxis_transform()
    axis.text(1.02, len(places) - 0.45, "coverage", transform=across, fontsize=10, color="0.3")
    for place, each in zip(places, panel.settings, strict=True):
        inside = f"{100 * metrics[f'coverage95.{key}.{each.name}'].value:.0f} %"
        axis.text(1.02, place, inside, transform=across, fontsize=11, va="center", color="0.3")
    said = [each.words.removeprefix(f"{panel.title.lower()}: ") for each in panel.settings]
    axis.set_yticks(places, said)
    axis.set_ylim(-0.7, len(places) - 0.3)
    label(axis, "error of a joint [mm]", "", panel.title)
    axis.set_xscale("log")
    plain_log(axis.xaxis)
