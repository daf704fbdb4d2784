"""The motion bench as people read it: Markdown tables."""

from collections.abc import Mapping
from pathlib import Path

from benchmarks.motion.targets import ANY, Target, targets_of
from hrc_env.core.provenance import provenance
from hrc_env.core.results import Metric

COLUMNS = (
    ("seconds", "s", 1), ("wrist_p95_m_s", "wrist p95", 2), ("wrist_max_m_s", "max", 2),
    ("ankle_p95_m_s", "ankle p95", 2), ("head_p95_m_s", "head p95", 2),
    ("wrist_p999_m_s2", "wrist p99.9 [m/s²]", 0), ("ankle_p999_m_s2", "ankle p99.9", 0),
    ("slip_p95_m_s", "slip p95", 3), ("grip_missed_share", "grips missed", 3),
    ("inside_itself_share", "in itself", 3), ("us_per_frame", "µs a frame", 1),
)  # fmt: skip
"""Statistic, title, digits of the table of everything."""


def write_report(out: Path, metrics: Mapping[str, Metric]) -> None:
    """Write motion.md into `out`."""
    (out / "motion.md").write_text(markdown(metrics))


def scenes_of(metrics: Mapping[str, Metric]) -> list[str]:
    """The scenes that were measured."""
    return [name.rsplit(".", 1)[0] for name in metrics if name.endswith(".seconds")]


def inside(target: Target, metric: Metric) -> bool:
    """Whether the median body is in the band."""
    return target.low <= metric.value <= target.high


def markdown(metrics: Mapping[str, Metric]) -> str:
    """Targets, then everything."""
    made, cost = provenance(), metrics["us_per_control_step"]
    blocks = [
        "# Motion bench",
        f"Commit {made['git']}. Medians over bodies, smallest and largest in brackets; the first "
        "table has the targets of single scenes, the second what all scenes have (speeds in m/s).",
        f"A control step of the environment (five poses, velocities, planning): {cost.value:.1f} "
        "µs a worker, batched, on one thread.",
        "## Beside what is known of people",
        _targets(metrics),
        "## Every scene",
        _everything(metrics),
        "Everywhere: " + "; ".join(_asked(target) for target in targets_of(ANY)) + ".",
    ]
    return "\n\n".join(blocks) + "\n"


def _asked(target: Target) -> str:
    return f"`{target.statistic}` at most {target.high:g} ({target.source})"


def _targets(metrics: Mapping[str, Metric]) -> str:
    lines = [["scene", "statistic", "measured", "target", "", "source"]]
    for scene in scenes_of(metrics):
        for target in targets_of(scene):
            metric = metrics[f"{scene}.{target.statistic}"]
            if target.scene != ANY or not inside(target, metric):
                verdict = "" if inside(target, metric) else "**outside**"
                band = f"{target.low:.3g}-{target.high:.3g}"
                lines.append([scene, target.statistic, _cell(metric), band, verdict, target.source])
    return _table(lines)


def _everything(metrics: Mapping[str, Metric]) -> str:
    lines = [["scene", *(title for _, title, _ in COLUMNS)]]
    for scene in scenes_of(metrics):
        numbers = [f"{metrics[f'{scene}.{key}'].value:.{digits}f}" for key, _, digits in COLUMNS]
        lines.append([scene, *numbers])
    return _table(lines)


def _cell(metric: Metric) -> str:
    if metric.low == metric.high:
        return f"{metric.value:.3g}"
    return f"{metric.value:.3g} ({metric.low:.3g}-{metric.high:.3g})"


def _table(lines: list[list[str]]) -> str:
    rows = [lines[0], ["---"] * len(lines[0]), *lines[1:]]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)
