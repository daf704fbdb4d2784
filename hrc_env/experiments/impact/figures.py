"""Three pictures: throughput against cost, stops missed and made for nothing, the tax."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hrc_env.core.results import Metric
from hrc_env.experiments.impact.measures import Table
from hrc_env.experiments.impact.tax import MEASURED, missed_share
from hrc_env.experiments.impact.trial.eyes import LATE, LATE_S, REFERENCE, Eyes, eyes_called
from hrc_env.experiments.impact.trial.policies import SCRIPTED, SLOWED, Policy
from hrc_env.experiments.impact.words import eyes_words
from hrc_env.tracking.estimators import ESTIMATORS

Metrics = Mapping[str, Metric]
_COLOURS = {
    "particle": "C0", "kalman": "C2", "triangulation": "C4", "paper": "C6",
    "truth": "black", "none": "0.55", "pixels": "C1",
}  # fmt: skip
"""Of perception levels, and of estimators with four cameras."""
_FREE = (3, 5, 8, 9)
"""Colours of the cycle for everybody else's."""
_CAMERA_COLOURS = {4: "C0", 3: "#5aa2d6", 2: "#e8a33d", 1: "#d1495b"}
_ACROSS = {
    "cost": "true cost per episode  (less is safer)",
    "approaches": "approaches per 1,000 steps  (less is safer)",
}
_LATE_MARKS = {0.0: "o", LATE_S[0]: "s", LATE_S[1]: "^"}


def plot_tradeoff(
    path: Path, metrics: Metrics, policies: Sequence[str], eyes: Sequence[str]
) -> None:
    """Goals a minute against true cost: a column for each policy, a point for each pair of eyes;
    below against approaches, without eyes that see nothing and the policy that does not look."""
    figure = Figure(figsize=(5.4 * len(policies) + 1, 12), layout="constrained")
    axes = figure.subplots(2, len(policies), squeeze=False)
    seeing = [name for name in eyes if not _is_blind(eyes_called(name))]
    for (above, below), policy in zip(axes.T, policies, strict=True):
        _panel(above, metrics, policy, eyes, "cost")
        above.set_title(policy, fontsize=14)
        if policy == SCRIPTED:
            below.set_axis_off()
            continue
        _panel(below, metrics, policy, seeing, "approaches")
        below.set_title(f"{policy}, eyes that see something", fontsize=12)
    for axis in axes[:, 0]:
        axis.set_ylabel("goals per minute", fontsize=12)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=12)
    figure.suptitle("What the eyes are worth: throughput against true cost", fontsize=15)
    _save(figure, path)


def _panel(axis: Axes, metrics: Metrics, policy: str, eyes: Sequence[str], across: str) -> None:
    """Points of one policy: goals against what is `across`."""
    for name in eyes:
        _point(axis, metrics, policy, name, across)
    axis.set_xlabel(_ACROSS[across], fontsize=12)
    axis.tick_params(labelsize=11)
    axis.margins(0.08)
    axis.grid(True, color="0.9")
    axis.set_axisbelow(True)


def _is_blind(eyes: Eyes) -> bool:
    """Whether nobody is ever followed with them."""
    return eyes.perception == "none" or eyes.is_alone


def plot_stops(path: Path, metrics: Metrics, eyes: Sequence[str]) -> None:
    """Stops that `scripted_slowed` missed, and those that it made for nothing."""
    figure = Figure(figsize=(12, 0.42 * len(eyes) + 1.6), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    rows = np.arange(len(eyes))[::-1]
    for axis, what, title in (
        (axes[0], "missed_stops", "missed: called for by the truth, not by the belief"),
        (axes[1], "false_stops", "false: called for by the belief, not by the truth"),
    ):  # fmt: skip
        found = [metrics[f"{SLOWED}.{name}.{what}"] for name in eyes]
        values = np.array([metric.value for metric in found])
        spread = np.abs([[m.value - m.low, m.high - m.value] for m in found]).T
        colours = [_colour(eyes_called(name)) for name in eyes]
        axis.barh(rows, values, 0.7, color=colours, xerr=spread, ecolor="0.25", capsize=3)
        axis.axvline(
            metrics[f"{SLOWED}.{REFERENCE}.{what}"].value, color="0.3", linestyle="--", linewidth=1
        )
        axis.set_title(title, fontsize=12)
        axis.set_xlabel("per 1,000 control steps", fontsize=12)
        axis.grid(True, axis="x", color="0.9")
        axis.set_axisbelow(True)
    axes[0].set_yticks(rows, [eyes_words(name) for name in eyes], fontsize=11)
    figure.suptitle(f"Wrong decisions of {SLOWED}; dashed: the reference", fontsize=15)
    _save(figure, path)


def plot_tax(path: Path, table: Table, metrics: Metrics, margins_m: Sequence[float]) -> bool:
    """Left what a margin does for late eyes; right metres of lateness, predicted and measured.

    Returns:
        Whether there are late eyes to be drawn.
    """
    late = [eyes for eyes in LATE if (SLOWED, eyes.name) in table]
    if not late or not margins_m:
        return False
    figure = Figure(figsize=(13.5, 5.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    _margins(left, table, late, (0.0, *margins_m))
    _metres(right, metrics, late)
    figure.suptitle("What lateness costs in metres", fontsize=15)
    _save(figure, path)
    return True


def _point(axis: Axes, metrics: Metrics, policy: str, name: str, across: str) -> None:
    """One pair of eyes: the reference and the paired difference from it, with its interval."""
    eyes, colour = eyes_called(name), _colour(eyes_called(name))
    (x, x_bar), (y, y_bar) = (
        _placed(metrics, policy, name, what) for what in (across, "goals_per_min")
    )
    mark = "X" if eyes.is_alone else _LATE_MARKS[eyes.latency_s]
    axis.errorbar(
        x, y, xerr=x_bar, yerr=y_bar, fmt="*" if eyes.perception == "pixels" else mark,
        color=colour, markersize=14 if eyes.perception == "pixels" else 9,
        markerfacecolor=colour if eyes.is_told else "white",
        markeredgewidth=1.6, elinewidth=0.9, alpha=0.9, label=eyes_words(name),
    )  # fmt: skip


def _placed(
    metrics: Metrics, policy: str, name: str, what: str
) -> tuple[float, list[list[float]] | None]:
    """Where a point is on one axis, and how far its bar goes to either side (the reference has
    none)."""
    reference = metrics[f"{policy}.{REFERENCE}.{what}"].value
    if name == REFERENCE:
        return reference, None
    found = metrics[f"difference.{policy}.{name}.{what}"]
    bar = [[found.value - found.low], [found.high - found.value]]
    return reference + found.value, bar


def _colour(eyes: Eyes) -> str:
    if eyes.n_cameras < 4:
        return _CAMERA_COLOURS[eyes.n_cameras]
    name = eyes.perception if eyes.perception in _COLOURS else eyes.estimator
    if name not in _COLOURS:  # somebody's own
        others = [each for each in ESTIMATORS if each not in _COLOURS]
        return f"C{_FREE[others.index(name) % len(_FREE)]}"
    return _COLOURS[name]


def _margins(axis: Axes, table: Table, late: Sequence[Eyes], margins_m: Sequence[float]) -> None:
    """Share of stops missed against the margin."""
    for eyes in (eyes_called(REFERENCE), *late):
        colour = {0.0: "C0", LATE_S[0]: "C1", LATE_S[1]: "C3"}[eyes.latency_s]
        rows = [table[Policy(SLOWED, margin_m).label, eyes.name] for margin_m in margins_m]
        shares = [100 * missed_share(row) for row in rows]
        axis.plot(
            margins_m, shares, color=colour, marker="o", label=eyes_words(eyes.name),
            linestyle="-" if eyes.is_told else "--",
            markerfacecolor=colour if eyes.is_told else "white",
        )  # fmt: skip
    level = 100 * missed_share(table[SLOWED, REFERENCE])
    axis.axhline(level, color="0.4", linestyle=":", label="on time, without a margin")
    axis.set_xlabel("margin added to both distances [m]", fontsize=12)
    axis.set_ylabel("stops that were called for and missed [%]", fontsize=12)
    axis.set_ylim(bottom=0)
    axis.grid(True, color="0.9")
    axis.legend(fontsize=10)


def _metres(axis: Axes, metrics: Metrics, late: Sequence[Eyes]) -> None:
    """Bars of extra metres."""
    bars = (
        ("nominal_m", "latency x (1.6 m/s + v_r)", "0.75"),
        ("speeds_here_m", "latency x (v_h + v_r), speeds as they were", "0.5"),
        ("squares_m", "errors added as squares", "0.25"),
        ("belief_m", "measured in the belief", "C0"),
        ("margin_m", "measured as a margin in the loop", "C1"),
    )
    x, width = np.arange(len(late)), 0.16
    for k, (how, words, colour) in enumerate(bars):
        found = [metrics[f"lateness.{eyes.name}.{how}"] for eyes in late]
        spread = np.abs([[m.value - m.low, m.high - m.value] for m in found]).T
        axis.bar(
            x + (k - 2) * width, [m.value for m in found], width, color=colour, label=words,
            yerr=spread if how in MEASURED else None, capsize=3, ecolor="0.2",
        )  # fmt: skip
    labels = [
        f"{1000 * eyes.latency_s:.0f} ms late\n{'told' if eyes.is_told else 'not told'}"
        for eyes in late
    ]
    axis.set_xticks(x, labels, fontsize=12)
    axis.set_ylabel("extra metres", fontsize=12)
    axis.set_ylim(0, 1.45 * axis.get_ylim()[1])  # room for the legend
    axis.grid(True, axis="y", color="0.9")
    axis.set_axisbelow(True)
    axis.legend(fontsize=10)


def _save(figure: Figure, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110)
