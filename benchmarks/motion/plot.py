"""Every statistic that has a target, in its band: one line each."""

from collections.abc import Mapping
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks.motion.report import inside, scenes_of
from benchmarks.motion.targets import ANY, targets_of
from hrc_env.core.results import Metric


def plot_targets(path: Path, metrics: Mapping[str, Metric]) -> None:
    """Measured values, where 0 and 1 are the ends of the band that was measured of people."""
    rows = [
        (f"{scene}: {target.statistic}", target, metrics[f"{scene}.{target.statistic}"])
        for scene in scenes_of(metrics)
        for target in targets_of(scene)
        if target.scene != ANY
    ][::-1]
    figure = Figure(figsize=(10, 0.24 * len(rows) + 1.4), layout="constrained")
    axis = figure.subplots()
    axis.axvspan(0.0, 1.0, color="0.9", label="target")
    for y, (_, target, metric) in enumerate(rows):
        width = target.high - target.low
        low, value, high = (
            min(max((number - target.low) / width, -0.9), 1.9)
            for number in (metric.low, metric.value, metric.high)
        )
        colour = "C0" if inside(target, metric) else "C3"
        axis.plot([low, high], [y, y], color=colour, linewidth=1.5)
        axis.plot(value, y, "o", color=colour)
    axis.set_yticks(range(len(rows)), [name for name, _, _ in rows], fontsize=9)
    axis.set_xlim(-1.0, 2.0)
    axis.set_ylim(-0.7, len(rows) - 0.3)
    axis.set_xticks([0.0, 1.0], ["least", "most"])
    axis.set_title("Workers' motion beside people's (blue: inside, red: outside)", fontsize=12)
    axis.grid(True, axis="y", color="0.93")
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110)
