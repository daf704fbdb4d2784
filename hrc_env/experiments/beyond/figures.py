"""One picture for each study: errors against a number, or a line for each setting."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.experiments.beyond.metrics import Found, Metrics
from hrc_env.experiments.beyond.study import Curves, Rows, Study

PanelT = TypeVar("PanelT", Curves, Rows)
COLOURS = ("#1565c0", "#e65100", "#2e7d32", "#6a1b9a")
MARKS = {"median": ("o", "-", 1.0), "p95": ("s", "--", 0.6)}
"""Mark, line and strength of each quantile."""
SPOKEN = {"median": "median", "p95": "95th percentile"}
CURVES_IN, ROWS_IN, NAMES_IN, CURVES_HIGH_IN, ROW_IN, ROUND_IN = 5.4, 4.6, 3.6, 5.2, 0.36, 1.8
"""Sizes of panels, of the names before rows, of a row, and of what is above and below [inches]."""


def draw_figures(folder: Path, studies: Sequence[Study], metrics: Metrics) -> None:
    """Write <study>.png of every study."""
    folder.mkdir(parents=True, exist_ok=True)
    for study in studies:
        draw(folder / f"{study.name}.png", study, Found(study.name, metrics))


def draw(path: Path, study: Study, found: Found) -> None:
    """One study's picture: curves in one band, rows in another, side by side if there is room."""
    panels = study.panels(found)
    curves = [panel for panel in panels if isinstance(panel, Curves)]
    rows = [panel for panel in panels if isinstance(panel, Rows)]
    names = [[_short(study, panel, name) for name in panel.settings] for panel in rows]
    shared = len(rows) > 1 and all(each == names[0] for each in names)
    widths = [
        CURVES_IN * len(curves),
        ROWS_IN * len(rows) + NAMES_IN * (1 if shared else len(rows)),
    ]
    n_lines = max(map(len, names), default=0)
    heights = [CURVES_HIGH_IN * bool(curves), (ROW_IN * n_lines + ROUND_IN) * bool(rows)]
    beside = bool(curves) and bool(rows) and sum(widths) < 18
    width = sum(widths) if beside else max(w for w, h in zip(widths, heights, strict=True) if h)
    height = max(heights) if beside else sum(heights)
    figure = Figure(figsize=(max(width, 7.0), height + 0.4), layout="constrained")
    bands: list = [figure]
    if curves and rows:
        ratios = {"width_ratios": widths} if beside else {"height_ratios": heights}
        shape = (1, 2) if beside else (2, 1)
        bands = list(np.ravel(figure.subfigures(*shape, **ratios)))  # type: ignore[arg-type]
    high_in = max(heights) if beside else heights[0]
    _draw_band(bands[0], curves, lambda axis, panel, _: _draw_curves(axis, panel, found), high_in)
    _draw_band(
        bands[-1],
        rows,
        lambda axis, panel, k: _draw_rows(axis, panel, [] if k and shared else names[k], found),
        high_in,
    )
    figure.suptitle(study.title, fontsize=15)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110)


def _draw_band(
    band: Any,
    panels: Sequence[PanelT],
    draw_on: Callable[[Axes, PanelT, int], None],
    high_in: float,
) -> None:
    """Panels side by side in a figure or a part of one that is so high; one legend if it does for
    all."""
    if not panels:
        return
    axes = list(np.ravel(band.subplots(1, len(panels))))
    for k, (axis, panel) in enumerate(zip(axes, panels, strict=True)):
        draw_on(axis, panel, k)
        axis.set_title(panel.title, fontsize=13)
        axis.tick_params(labelsize=11)
        axis.grid(True, which="both", color="0.92")
        axis.set_axisbelow(True)
    handles, labels = axes[0].get_legend_handles_labels()
    if all(axis.get_legend_handles_labels()[1] == labels for axis in axes):
        place = "outside lower center"
        band.legend(handles, labels, loc=place, ncols=2 if len(axes) < 3 else 4, fontsize=10)
        return
    below = (0.5, -0.65 / (high_in - ROUND_IN))
    for axis in axes:
        axis.legend(
            fontsize=9.5, loc="upper center", bbox_to_anchor=below, ncols=2, borderaxespad=0.0
        )


def _draw_curves(axis: Axes, panel: Curves, found: Found) -> None:
    for k, line in enumerate(panel.lines):
        for quantile, (mark, style, alpha) in MARKS.items():
            at = [x for x, _ in line.points]
            metrics = [found.error(name, quantile) for _, name in line.points]
            label = SPOKEN[quantile]
            axis.errorbar(
                at, [1000 * each.value for each in metrics], _ends_mm(metrics), fmt=mark,
                linestyle=style if len(at) > 1 else "none", color=COLOURS[k], alpha=alpha,
                capsize=3, label=label if len(panel.lines) == 1 else f"{line.label}: {label}",
            )  # fmt: skip
    if panel.is_log:
        axis.set_xscale("log")
        _plain(axis.xaxis)
    else:
        axis.set_xticks(sorted({x for line in panel.lines for x, _ in line.points}))
    axis.set_xlabel(panel.across, fontsize=12)
    axis.set_ylabel("error of a joint [mm]", fontsize=12)
    axis.set_yscale("log")
    _plain(axis.yaxis)


def _draw_rows(axis: Axes, panel: Rows, names: Sequence[str], found: Found) -> None:
    """Errors as marks; coverage as numbers at the right. No names: those of the panel before."""
    places = np.arange(len(panel.settings))[::-1]
    for colour, (quantile, (mark, _, _)) in zip(COLOURS, MARKS.items(), strict=False):
        metrics = [found.error(name, quantile) for name in panel.settings]
        axis.errorbar(
            [1000 * each.value for each in metrics], places, xerr=_ends_mm(metrics), fmt=mark,
            color=colour, capsize=3, label=SPOKEN[quantile],
        )  # fmt: skip
    across = axis.get_yaxis_transform()
    axis.text(1.02, len(places) - 0.45, "coverage", transform=across, fontsize=10, color="0.3")
    for place, name in zip(places, panel.settings, strict=True):
        inside = f"{100 * found.of('coverage95', name).value:.0f} %"
        axis.text(1.02, place, inside, transform=across, fontsize=11, va="center", color="0.3")
    axis.set_yticks(places, names or [""] * len(places))
    axis.set_ylim(-0.7, len(places) - 0.3)
    axis.set_xlabel("error of a joint [mm]", fontsize=12)
    axis.set_xscale("log")
    _plain(axis.xaxis)


def _short(study: Study, panel: Rows, setting: str) -> str:
    """A setting's words without what the panel's title says already."""
    return study.words(setting).removeprefix(f"{panel.title.lower()}: ")


def _ends_mm(metrics: Sequence[Metric]) -> Floats:
    """(2, n) how far the intervals go to either side [mm]."""
    return 1000 * np.abs([[m.value - m.low, m.high - m.value] for m in metrics]).T


def _plain(axis: Axis) -> None:
    """Plain numbers on a logarithmic axis, as many as have room."""
    low, high = axis.get_view_interval()
    span = np.log10(high / low)
    fine = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0) if span < 0.9 else (1.0, 2.0, 5.0)
    axis.set_major_locator(LogLocator(10, subs=fine if span < 2.5 else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
    axis.set_minor_formatter(NullFormatter())
