"""The report: throughput against true cost, rows, differences, what lateness costs in metres."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes

from hrc_env.experiments.impact.declaration import (
    ASKED,
    LATENESS,
    TITLE,
    differences_of,
    results_of,
)
from hrc_env.experiments.impact.metrics import Played
from hrc_env.experiments.impact.policies import PPO, SCRIPTED
from hrc_env.experiments.impact.policies import WORDS as ROBOTS
from hrc_env.experiments.plots import ends, label, new_figure, save
from hrc_env.experiments.report import Metrics, Report, picture
from hrc_env.experiments.setups import LATE_S, REFERENCE, setup_called
from hrc_env.tracking.estimators import ESTIMATORS

LEAST_SHARE = 0.25
"""Of the best robot's goals: a trained policy that reaches fewer has not learnt the task."""
COLOURS = {
    "particle": "C0", "kalman": "C2", "triangulation": "C4", "paper_restarts": "C6",
    "truth": "black", "none": "0.55", "pixels": "C1",
}  # fmt: skip
"""Of perception levels, and of estimators with four cameras."""
FREE_COLOURS = ("C3", "C5", "C8", "C9")
CAMERA_COLOURS = {4: "C0", 3: "#5aa2d6", 2: "#e8a33d", 1: "#d1495b"}
LATE_MARKS = {0.0: "o", LATE_S[0]: "s", LATE_S[1]: "^"}
ACROSS = {
    "cost_towards": "true cost while moving towards the worker  (less is safer)",
    "approaches": "approaches per 1,000 steps  (less is safer)",
}


def report(
    figures: Path, table: Played, metrics: Metrics, robots: Mapping[str, str], warning: str = ""
) -> Report:
    """Draw the figure, and put the tables beside it.

    Args:
        figures: folder of the figure.
        table: of the episodes.
        metrics: numbers of it.
        robots: whose perception was exchanged: agents by their labels in the table.
        warning: what stands above all where too little was played: no difference is marked then.
    """
    policies = [name for name in robots if (name, REFERENCE) in table]
    asked = [*filter(None, (warning, ASKED, _acting(robots)))]
    if PPO in policies and not has_learnt(metrics, policies):
        policies.remove(PPO)
        reached = metrics[f"{PPO}.{REFERENCE}.goals_per_min"].value
        asked.append(
            f"`{PPO}` did not learn its task ({reached:.1f} goals a minute with the reference), so "
            "that nothing can be said of its perception: it is left out here, and its numbers are "
            "in results.json only."
        )
    title = f"{TITLE}{', a quick run' if warning else ''}"
    if not policies:
        return Report(title, "\n\n".join(asked), ())
    setups = [*dict.fromkeys(name for _, name in table)]
    draw_tradeoff(figures / "tradeoff.png", metrics, policies, setups)
    caption = (
        "A point for each setup, placed by its paired difference from the reference, whose 95 % "
        "interval are the bars: up is more goals, left is safer. Below: approaches instead of "
        "cost, without setups that track nobody."
    )
    parts = [picture(figures / "tradeoff.png", caption)]
    parts += [results_of(policy, setups).markdown(metrics) for policy in policies]
    marks = "" if warning else "; a dot where the interval leaves out zero"
    others = [name for name in setups if name != REFERENCE]
    if others:
        parts.append(f"Less {setup_called(REFERENCE).words}, paired{marks}.")
    parts += [differences_of(policy, others, not warning).markdown(metrics) for policy in policies]
    parts.append(LATENESS.markdown(metrics))
    return Report(title, "\n\n".join(asked), [*filter(None, parts)])


def _acting(robots: Mapping[str, str]) -> str:
    """Return the names of the policies."""
    said = [
        f"`{label}` {ROBOTS[label]}" if label in ROBOTS else f"`{label}` is the agent `{agent}`"
        for label, agent in robots.items()
    ]
    return f"Robots: {'; '.join(said)}."


def has_learnt(metrics: Metrics, policies: Sequence[str]) -> bool:
    """Return whether `ppo` reaches at least a quarter of the goals a minute that the best of the
    others reaches with the reference; beside no others, whether its interval leaves out zero."""
    found = {name: metrics[f"{name}.{REFERENCE}.goals_per_min"] for name in policies}
    others = [each.value for name, each in found.items() if name != PPO]
    if not others or max(others) == 0:
        return found[PPO].value > 0 and found[PPO].low > 0
    return found[PPO].value >= LEAST_SHARE * max(others)


def draw_tradeoff(
    path: Path,
    metrics: Metrics,
    policies: Sequence[str],
    setups: Sequence[str],
) -> None:
    """Draw goals a minute against true cost while the robot moves towards the worker, and below
    against approaches, without setups that track nobody and without the policy that does not look.

    Args:
        path: file of the picture.
        metrics: of the study.
        policies: names, each has a column.
        setups: names, each has a point.
    """
    looking = [name for name in policies if name != SCRIPTED]
    n_rows = 2 if looking else 1
    figure = new_figure(5.4 * len(policies) + 1, 6 * n_rows)
    axes = figure.subplots(n_rows, len(policies), squeeze=False)
    seeing = [name for name in setups if setup_called(name).level != "none"]
    for policy, above in zip(policies, axes[0], strict=True):
        _panel(above, metrics, policy, setups, "cost_towards")
    free: Axes | None = None
    for policy, below in zip(policies, axes[1] if looking else (), strict=False):
        if policy in looking:
            _panel(below, metrics, policy, seeing, "approaches")
        else:
            below.axis("off")
            free = below
    handles, labels = axes[0, 0].get_legend_handles_labels()
    if free is None:
        figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=12)
    else:
        free.legend(handles, labels, loc="center left", fontsize=12)
    save(figure, path)


def _panel(axis: Axes, metrics: Metrics, policy: str, setups: Sequence[str], across: str) -> None:
    """Goals of one policy against what is `across`: the reference and paired differences."""
    for name in setups:
        setup, place, bars = setup_called(name), [], []
        for what in (across, "goals_per_min"):
            place.append(metrics[f"{policy}.{REFERENCE}.{what}"].value)
            difference = metrics.get(f"difference.{policy}.{name}.{what}")
            if difference is not None:
                place[-1] += difference.value
            bars.append(None if difference is None else ends([difference]))
        mark = "X" if setup.is_alone else LATE_MARKS[setup.latency_s]
        is_check, colour = setup.level == "pixels", _colour(name)
        axis.errorbar(
            *place, xerr=bars[0], yerr=bars[1], fmt="*" if is_check else mark, color=colour,
            markersize=14 if is_check else 9, markeredgewidth=1.6, elinewidth=0.9, alpha=0.9,
            markerfacecolor=colour if setup.is_told else "white", label=setup.words,
        )  # fmt: skip
    label(axis, ACROSS[across], "goals per minute", policy)
    axis.margins(0.08)


def _colour(setup_name: str) -> str:
    setup, others = setup_called(setup_name), [each for each in ESTIMATORS if each not in COLOURS]
    if setup.n_cameras < 4:
        return CAMERA_COLOURS[setup.n_cameras]
    if setup.level in COLOURS or setup.estimator in COLOURS:
        return COLOURS.get(setup.level) or COLOURS[setup.estimator]
    return FREE_COLOURS[others.index(setup.estimator) % len(FREE_COLOURS)]
