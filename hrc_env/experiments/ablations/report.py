"""The report: question by question what was asked, a picture and a table."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hrc_env.experiments.ablations.ablation import Ablation
from hrc_env.experiments.columns import Column
from hrc_env.experiments.plots import ends, label, new_figure, plain_log, save
from hrc_env.experiments.report import Metrics, Report, picture, table_of

QUANTILES = {"median": ("median", "o", "#1565c0"), "p95": ("95th percentile", "s", "#e65100")}
ASKED = """\
What the paper's two experiments leave open. Detections are those of the calibrated emulator
(`perception="keypoints"`): these are questions about estimators and rigs. The estimator is the
default, `particle`, unless a setting says otherwise; settings are changed one at a time. Workers of
all bodies work beside an arm that rests, on the same walks in every setting of a scene.

Every joint of every frame after the first second counts, also where the track is lost: the last
word, or the prior, is then the answer. *Coverage*: the share of joints within the reported 95 %
region; *lost*: the share of time without a track; *switches*: of a worker from one track to
another, a minute, and *IDF1*: how well workers keep theirs (`hrc_env/tracking/metrics.py`);
*less*: less the setting that was changed, walk by walk; a dot where the interval leaves out
zero."""


def report(figures: Path, ablations: Sequence[Ablation], metrics: Metrics) -> Report:
    """A figure and a table for each question."""
    parts: list[str] = []
    for ablation in ablations:
        key, path = ablation.name, figures / f"{ablation.name}.png"
        rows = {setting.name: setting.words for setting in ablation.settings}
        rows |= {name: w for name, w in ablation.also.items() if f"rmse_m.{key}.{name}" in metrics}
        draw(path, key, rows, metrics)
        columns = [
            Column(f"error_m.{key}.{{}}.median", "median [mm]", 1, 1000),
            Column(f"error_m.{key}.{{}}.p95", "95th percentile [mm]", 0, 1000),
            Column(f"difference.error_m.{key}.{{}}.median", "less, median", 1, 1000, signed=True),
            Column(f"difference.error_m.{key}.{{}}.p95", "less, 95th", 0, 1000, signed=True),
            Column(f"rmse_m.{key}.{{}}", "RMSE [mm]", 0, 1000),
            Column(f"coverage95.{key}.{{}}", "coverage [%]", 1, 100),
            Column(f"lost.{key}.{{}}", "lost [%]", 2, 100),
        ]
        if any(setting.n_workers > 1 for setting in ablation.settings):
            columns.append(Column(f"id_switches.{key}.{{}}", "switches [1/min]", 2))
            columns.append(Column(f"idf1.{key}.{{}}", "IDF1 [%]", 1, 100))
        parts += [
            f"## {ablation.title}\n\n{ablation.asked}",
            picture(path, "Error of a joint in each setting."),
            table_of("setting", rows, columns, metrics),
        ]
    return Report("Ablations of rigs, detections and estimators", ASKED, parts)


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
    axis.text(1.02, len(rows) - 0.4, "coverage", transform=across, fontsize=10, color="0.3")
    axis.set_yticks(places, list(rows.values()))
    axis.set_ylim(-0.7, len(rows) - 0.3)
    axis.set_xscale("log")
    plain_log(axis.xaxis)
    label(axis, "error of a joint [mm]")
    figure.legend(loc="outside lower center", ncols=2)
    save(figure, path)
