"""The report of the motion benchmark."""

from benchmarks.motion.targets import ANY, Target, list_targets
from hrc_env.core.results import Metric
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Metrics, Report, format_metric, format_metrics, format_table

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
)
"""Columns of the table of all motions."""


def report(metrics: Metrics) -> Report:
    """Return the report, with its tables and figures."""
    scenes = [name.rsplit(".", 1)[0] for name in metrics if name.endswith(".seconds")]
    lead = (
        "Medians over bodies, with the smallest and the largest value in brackets. The first table "
        "compares single scenes with targets, the second lists all scenes (speeds in m/s)."
    )
    asked = (f"`{each.statistic}` <= {each.high:g} ({each.source})" for each in list_targets(ANY))
    return Report("Motion bench", lead, (
        "## Comparison with measurements of people", _targets(scenes, metrics),
        "## All scenes",
        format_metrics("scene", {each: each for each in scenes}, COLUMNS, metrics),
        f"In all scenes: {'; '.join(asked)}.",
    ), "the smallest and the largest value over bodies")  # fmt: skip


def inside(target: Target, metric: Metric) -> bool:
    """Return whether the median over bodies lies within the target band."""
    return target.low <= metric.value <= target.high


def _targets(scenes: list[str], metrics: Metrics) -> str:
    lines = []
    for scene in scenes:
        for target in list_targets(scene):
            metric = metrics[f"{scene}.{target.statistic}"]
            if target.scene != ANY or not inside(target, metric):
                verdict = "" if inside(target, metric) else "**outside**"
                band = f"{target.low:.3g}-{target.high:.3g}"
                measured = format_metric(metric, 1, 3)
                lines.append([scene, target.statistic, measured, band, verdict, target.source])
    return format_table(["scene", "statistic", "measured", "target", "", "source"], lines)
