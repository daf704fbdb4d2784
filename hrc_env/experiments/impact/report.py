"""The report of the impact study: throughput against true cost, rows, differences, and latency."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from matplotlib.axes import Axes

from hrc_env.evaluation.intervals import MIN_SEEDS
from hrc_env.experiments.impact.declaration import (
    LATENESS,
    QUESTION,
    TITLE,
    make_differences_table,
    make_results_table,
)
from hrc_env.experiments.impact.metrics import Played
from hrc_env.experiments.impact.policies import PPO, SCRIPTED
from hrc_env.experiments.impact.policies import WORDS as ROBOTS
from hrc_env.experiments.plots import compute_error_bars, label_axes, make_figure, save
from hrc_env.experiments.report import Conditions, Metrics, Report, format_picture
from hrc_env.experiments.setups import LATE_S, REFERENCE, find_setup
from hrc_env.tracking.estimators import ESTIMATORS

LEAST_SHARE = 0.25
"""Fraction of the best policy's goals per minute from which PPO counts as having learnt the
task."""
COLOURS = {
    "particle": "C0", "kalman": "C2", "triangulation": "C4", "paper_restarts": "C6",
    "truth": "black", "none": "0.55", "pixels": "C1",
}  # fmt: skip
"""Colours of perception levels, and of estimators with four cameras."""
FREE_COLOURS = ("C3", "C5", "C8", "C9")
"""Colours of the remaining estimators, which are used in turn."""
CAMERA_COLOURS = {4: "C0", 3: "#5aa2d6", 2: "#e8a33d", 1: "#d1495b"}
"""Colours by number of cameras."""
LATE_MARKS = {0.0: "o", LATE_S[0]: "s", LATE_S[1]: "^"}
"""Markers by latency [s]."""
ACROSS = {
    "cost_towards": "true cost while moving towards the worker  (lower is safer)",
    "approaches": "approaches per 1,000 steps  (lower is safer)",
}
"""Metrics on the horizontal axes, with the labels of the axes."""


def make_report(
    figures: Path,
    table: Played,
    metrics: Metrics,
    robots: Mapping[str, str],
    conditions: Conditions,
    warning: str = "",
) -> Report:
    """Draw the figure and return the report.

    Args:
        figures: folder of the figure.
        table: rows of episodes.
        metrics: metrics by name.
        robots: agents by their labels in the table.
        conditions: conditions of the episodes.
        warning: text at the top of the report if the run is too short for comparisons; no
            difference is then marked. "" for other runs.
    """
    policies = [name for name in robots if (name, REFERENCE) in table]
    question = [*filter(None, (warning, QUESTION, _describe_robots(robots)))]
    if PPO in policies and not has_learnt(metrics, policies):
        policies.remove(PPO)
        reached = metrics[f"{PPO}.{REFERENCE}.goals_per_min"].value
        question.append(
            f"`{PPO}` did not learn its task ({reached:.1f} goals per minute with the reference), "
            "so its rows do not show the effect of perception: it is left out here, and its "
            "numbers are in results.json only."
        )
    title = f"{TITLE}{', a quick run' if warning else ''}"
    if not policies:
        return Report(title, "\n\n".join(question), ())
    setups = [*dict.fromkeys(name for _, name in table)]
    draw_tradeoff(figures / "tradeoff.png", metrics, policies, setups)
    caption = (
        "One point per setup, placed by its paired difference from the reference; bars are 95 % "
        f"intervals, and setups without bars have too few seeds (fewer than {MIN_SEEDS}). Higher "
        "is more goals, further left is safer. Below: approaches instead of cost, without setups "
        "that have no track."
    )
    parts = [format_picture(figures / "tradeoff.png", caption)]
    parts += [
        make_results_table(policy, setups, conditions).to_markdown(metrics) for policy in policies
    ]
    others = [name for name in setups if name != REFERENCE]
    if others:
        parts.append(f"Paired differences from {find_setup(REFERENCE).words}.")
    parts += [
        make_differences_table(policy, others, not warning, conditions).to_markdown(metrics)
        for policy in policies
    ]
    parts.append(replace(LATENESS, conditions=conditions).to_markdown(metrics))
    return Report(title, "\n\n".join(question), [*filter(None, parts)])


def _describe_robots(robots: Mapping[str, str]) -> str:
    """Return a sentence that describes the policies."""
    texts = [
        f"`{label}` {ROBOTS[label]}" if label in ROBOTS else f"`{label}` is the agent `{agent}`"
        for label, agent in robots.items()
    ]
    return f"Robots: {'; '.join(texts)}."


def has_learnt(metrics: Metrics, policies: Sequence[str]) -> bool:
    """Return whether PPO has learnt the task, judged with the reference perception.

    It has if it reaches at least a quarter of the goals per minute of the best other policy or,
    without other policies, if the interval of its goals per minute, if any, excludes zero.
    """
    found = {name: metrics[f"{name}.{REFERENCE}.goals_per_min"] for name in policies}
    others = [each.value for name, each in found.items() if name != PPO]
    if not others or max(others) == 0:
        return found[PPO].value > 0 and not found[PPO].low <= 0
    return found[PPO].value >= LEAST_SHARE * max(others)


def draw_tradeoff(
    path: Path,
    metrics: Metrics,
    policies: Sequence[str],
    setups: Sequence[str],
) -> None:
    """Draw goals per minute against true cost while the robot moves towards the worker.

    A second row of panels shows goals against approaches. It omits setups without tracks and the
    policy that ignores the worker.

    Args:
        path: picture file to write.
        metrics: metrics by name.
        policies: labels of the policies, with one column of panels each.
        setups: names of the setups, with one point each.
    """
    looking = [name for name in policies if name != SCRIPTED]
    n_rows = 2 if looking else 1
    figure = make_figure(5.4 * len(policies) + 1, 6 * n_rows)
    axes = figure.subplots(n_rows, len(policies), squeeze=False)
    seeing = [name for name in setups if find_setup(name).level != "none"]
    for policy, above in zip(policies, axes[0], strict=True):
        _draw_panel(above, metrics, policy, setups, "cost_towards")
    free: Axes | None = None
    for policy, below in zip(policies, axes[1] if looking else (), strict=False):
        if policy in looking:
            _draw_panel(below, metrics, policy, seeing, "approaches")
        else:
            below.axis("off")
            free = below
    handles, labels = axes[0, 0].get_legend_handles_labels()
    if free is None:
        figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=12)
    else:
        free.legend(handles, labels, loc="center left", fontsize=12)
    save(figure, path)


def _draw_panel(
    axis: Axes, metrics: Metrics, policy: str, setups: Sequence[str], across: str
) -> None:
    """Draw one policy's goals against a metric of `ACROSS`, with intervals of the differences."""
    for name in setups:
        setup, place, bars = find_setup(name), [], []
        for key in (across, "goals_per_min"):
            place.append(metrics[f"{policy}.{REFERENCE}.{key}"].value)
            difference = metrics.get(f"difference.{policy}.{name}.{key}")
            if difference is not None:
                place[-1] += difference.value
            bars.append(None if difference is None else compute_error_bars([difference]))
        mark = "X" if setup.is_alone else LATE_MARKS[setup.latency_s]
        is_check, colour = setup.level == "pixels", _choose_colour(name)
        axis.errorbar(
            *place, xerr=bars[0], yerr=bars[1], fmt="*" if is_check else mark, color=colour,
            markersize=14 if is_check else 9, markeredgewidth=1.6, elinewidth=0.9, alpha=0.9,
            markerfacecolor=colour if setup.is_told else "white", label=setup.words,
        )  # fmt: skip
    label_axes(axis, ACROSS[across], "goals per minute", policy)
    axis.margins(0.08)


def _choose_colour(setup_name: str) -> str:
    setup, others = find_setup(setup_name), [each for each in ESTIMATORS if each not in COLOURS]
    if setup.n_cameras < 4:
        return CAMERA_COLOURS[setup.n_cameras]
    if setup.level in COLOURS or setup.estimator in COLOURS:
        return COLOURS.get(setup.level) or COLOURS[setup.estimator]
    return FREE_COLOURS[others.index(setup.estimator) % len(FREE_COLOURS)]
