"""The motion bench as people read it: tables, and every target in its band."""

from pathlib import Path

from benchmarks.common import table
from benchmarks.motion.targets import ANY, Target, targets_of
from hrc_env.core.results import Metric
from hrc_env.experiments.study.plots import label, new_figure, save
from hrc_env.experiments.study.report import (
    Column,
    Metrics,
    Picture,
    Report,
    Table,
    said,
    table_of,
)

COLUMNS = (
    Column("{}.seconds", "s"),
    Column("{}.wrist_p95_m_s", "wrist p95", 2),
    Column("{}.wrist_max_m_s", "max", 2),
    Column("{}.ankle_p95_m_s", "ankle p95", 2),
    Column("{}.head_p95_m_s", "head p95", 2),
    Column("{}.wrist_p999_m_s2", "wrist p99.9 [m/s²]", 0),
    Column("{}.ankle_p999_m_s2", "ankle p99.9", 0),
    Column("{}.slip_p95_m_s", "slip p95", 3),
    Column("{}.grip_missed_share", "grips missed", 3),
    Column("{}.inside_itself_share", "in itself", 3),
    Column("{}.us_per_frame", "µs a frame"),
)
"""Of the table of everything."""


def report(metrics: Metrics, figures: Path) -> Report:
    """What is to be read; motion.png is drawn into `figures`."""
    cost = metrics["us_per_control_step"].value
    scenes = [name.rsplit(".", 1)[0] for name in metrics if name.endswith(".seconds")]
    _plot_targets(figures / "motion.png", scenes, metrics)
    lead = (
        "Medians over bodies, smallest and largest in brackets; the first table has the targets of "
        "single scenes, the second what all scenes have (speeds in m/s). A control step of the "
        f"environment (five poses, velocities, planning): {cost:.1f} µs a worker, batched, on one "
        "thread."
    )
    asked = (f"`{each.statistic}` <= {each.high:g} ({each.source})" for each in targets_of(ANY))
    return Report("Motion bench", lead, (
        "## Beside what is known of people", _targets(scenes, metrics),
        Picture(figures / "motion.png", "0 and 1 are the ends of the band; outside of it: red."),
        "## Every scene", table_of("scene", {each: each for each in scenes}, COLUMNS, metrics),
        f"Everywhere: {'; '.join(asked)}.",
    ))  # fmt: skip


def inside(target: Target, metric: Metric) -> bool:
    """Whether the median body is in the band."""
    return target.low <= metric.value <= target.high


def _targets(scenes: list[str], metrics: Metrics) -> Table:
    lines = []
    for scene in scenes:
        for target in targets_of(scene):
            metric = metrics[f"{scene}.{target.statistic}"]
            if target.scene != ANY or not inside(target, metric):
                verdict = "" if inside(target, metric) else "**outside**"
                band = f"{target.low:.3g}-{target.high:.3g}"
                measured = said(metric, 1, 3)
                lines.append([scene, target.statistic, measured, band, verdict, target.source])
    return table(["scene", "statistic", "measured", "target", "", "source"], lines)


def _plot_targets(path: Path, scenes: list[str], metrics: Metrics) -> None:
    """Measured values, where 0 and 1 are the ends of the band that was measured of people."""
    rows = [
        (f"{scene}: {target.statistic}", target, metrics[f"{scene}.{target.statistic}"])
        for scene in scenes
        for target in targets_of(scene)
        if target.scene != ANY
    ][::-1]
    figure = new_figure(10, 0.24 * len(rows) + 1.4)
    axis = figure.subplots()
    axis.axvspan(0.0, 1.0, color="0.9")
    for y, (_, target, metric) in enumerate(rows):
        low, value, high = (
            min(max((number - target.low) / (target.high - target.low), -0.9), 1.9)
            for number in (metric.low, metric.value, metric.high)
        )
        colour = "C0" if inside(target, metric) else "C3"
        axis.plot([low, high], [y, y], color=colour, linewidth=1.5)
        axis.plot(value, y, "o", color=colour)
    axis.set_yticks(range(len(rows)), [name for name, _, _ in rows], fontsize=9)
    axis.set_xlim(-1.0, 2.0)
    axis.set_xticks([0.0, 1.0], ["least", "most"])
    label(axis, title="Workers' motion beside people's", grid="y")
    save(figure, path)
