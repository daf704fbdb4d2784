"""The report: throughput against true cost, rows, differences, what lateness costs in metres."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes

from hrc_env.experiments.columns import Column
from hrc_env.experiments.impact.episodes import SLOW_M, STOP_M
from hrc_env.experiments.impact.metrics import COMPARED, NOMINAL_MPS, Played
from hrc_env.experiments.impact.policies import PPO, SCRIPTED
from hrc_env.experiments.impact.policies import WORDS as ROBOTS
from hrc_env.experiments.plots import ends, label, new_figure, save
from hrc_env.experiments.report import Metrics, Report, Table, picture, table_of
from hrc_env.experiments.setups import LATE, LATE_S, REFERENCE, setup_called
from hrc_env.safety.incidents import MOVING_M_S
from hrc_env.tracking.estimators import ESTIMATORS

WORDS = {
    "goals_per_min": ("goals / min", 1), "cost": ("true cost", 1),
    "cost_towards": ("of it moving towards", 1), "called_slowings": ("near", 0),
    "separation_min_m": ("least separation [m]", 3), "contacts_towards": ("contacts towards", 2),
    "contacts_standing": ("standing arm pushed", 2), "contacts_fleeing": ("moving away", 2),
    "approaches": ("approaches", 1), "missed_stops": ("missed stops", 1),
    "false_stops": ("false stops", 1), "z_d_m": ("Z_d [m]", 3), "tax_m": ("tax [m]", 2),
}  # fmt: skip
ASKED = f"""\
A robot keeps away from a worker whom it knows through cameras only. What is a better estimator, one
more camera or a shorter delay worth, in goals reached and in safety? Only perception is exchanged;
robots, goals and workers, who take no notice of the robot, are the same in every row, bit for bit.

Counted is the truth. *True cost*: steps nearer than 0.15 m, and steps in touch, an episode; *of it
moving towards*: while the robot moves towards the worker at more than {MOVING_M_S} m/s. The rest
comes of workers who walk up to a robot that stands, and depends on where it stands. *Contacts* a
minute, touches within half a second as one, are named by what the robot did in the step before:
*towards* the worker, *standing arm pushed*, *moving away*. In 1,000 steps, *near*: nearer than
{SLOW_M:g} m, the exposure; *approaches*: the robot moves towards a worker nearer than {STOP_M:g} m;
*missed stops*: the true
separation is below {STOP_M:g} m and the believed one is not; *false stops*: the other way round.
*Z_d*: 95th percentile of the error of all joints, also where the track is lost. *Tax*: Z_d on time
+ latency x (v_h + v_r), v_h = {NOMINAL_MPS} m/s, v_r the 95th percentile of the robot's speed
towards the worker.

Fewer than four cameras: the others fail after a second; which are left goes round. Late images say
when they were taken, and the tracker predicts from there; untold ones claim to be new."""
LATENESS = Table(
    "lateness",
    "What latency costs in separation",
    {
        each.name: (f"{1000 * each.latency_s:.0f} ms, {'told' if each.is_told else 'not told'}",)
        for each in LATE
    },
    (
        Column("lateness.{}.nominal_m", "nominal tax [m]", 3, plain=True),
        Column("lateness.{}.speeds_here_m", "tax with measured speeds [m]", 3, plain=True),
        Column("lateness.{}.squares_m", "squares added [m]", 3, plain=True),
        Column("lateness.{}.belief_m", "measured in the belief [m]", 3),
        Column("lateness.{}.margin_m", "measured in the loop [m]", 3),
    ),
    ("latency",),
    f"Nominal tax: latency x ({NOMINAL_MPS} m/s + robot speed) on top of Z_d. Measured in the "
    "belief: growth of the 95th percentile of believed less true gap. In the loop: margin that "
    "`scripted_slowed` must add until it misses no greater share of stops than on time.",
)
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
    title = f"What perception is worth in safety{', a quick run' if warning else ''}"
    if not policies:
        return Report(title, "\n\n".join(asked), ())
    setups = {name: setup_called(name).words for _, name in table}
    draw_tradeoff(figures / "tradeoff.png", metrics, policies, list(setups))
    caption = (
        "A point for each setup, placed by its paired difference from the reference, whose 95 % "
        "interval are the bars: up is more goals, left is safer. Below: approaches instead of "
        "cost, without setups that track nobody."
    )
    parts = [picture(figures / "tradeoff.png", caption)]
    for policy in policies:
        columns = [Column(f"{policy}.{{}}.{what}", *words) for what, words in WORDS.items()]
        parts.append(table_of(policy, setups, columns, metrics))
    marks = "" if warning else "; a dot where the interval leaves out zero"
    others = {name: words for name, words in setups.items() if name != REFERENCE}
    if others:
        parts.append(f"Less {setups[REFERENCE]}, paired{marks}.")
    for policy in policies if others else ():
        key = f"difference.{policy}.{{}}."
        columns = [
            Column(key + what, *WORDS[what], signed=True, marked=not warning)
            for what in (*COMPARED, "z_d_m")
        ]
        parts.append(table_of(policy, others, columns, metrics))
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
    for policy, below in zip(policies, axes[1] if looking else (), strict=False):
        if policy in looking:
            _panel(below, metrics, policy, seeing, "approaches")
        else:
            below.remove()
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=12)
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
