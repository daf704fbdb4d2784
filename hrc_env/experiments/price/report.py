"""The report: bars of the work that is left, the margins behind them, questions."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from hrc_env.experiments.columns import Column
from hrc_env.experiments.plots import ends, label, new_figure, save
from hrc_env.experiments.price.episodes import SCRIPTED, Driver
from hrc_env.experiments.price.eyes import ELSEWHERE, FOUR, GROUPS, QUICK, Eyes, all_eyes
from hrc_env.experiments.price.metrics import PER, Played, Row
from hrc_env.experiments.report import Metrics, Report, Table, picture, table_of

COLUMNS = {
    "margin_m": ("margin [m]", 3, 1.0),
    "goals_per_min": ("goals / min", 1, 1.0),
    "share": ("of unshielded [%]", 0, 100.0),
    "of_truth": ("of true joints' [%]", 0, 100.0),
    "confirmed.margin_m": ("played with [m]", 4, 1.0),
    "confirmed.towards": ("contacts towards", 0, 1.0),
    "confirmed.standing": ("standing", 0, 1.0),
    "confirmed.away": ("fleeing", 0, 1.0),
    "confirmed.goals_per_min": ("goals / min", 1, 1.0),
    "confirmed.cost": ("true cost", 1, 1.0),
}
"""Of the table: words, digits, factor."""
RATES = {name: words for name, words in COLUMNS.items() if name.startswith("confirmed.")}
QUESTIONS = {
    "three_cameras": "the fourth camera", "two_cameras": "the third and the fourth",
    "one_camera": "all cameras but one", "late_120ms": "images on time, not 120 ms late (known)",
    "late_200ms": "not 200 ms late (known)", "telling_120ms": "knowing of 120 ms",
    "telling_200ms": "knowing of 200 ms", "kalman": "particle rather than kalman",
    "paper_restarts": "particle rather than paper_restarts",
    "triangulation": "particle rather than triangulation",
    "calibration": "cameras that are not turned by 1 degree",
    "half_covariance": "covariances that are not half as large",
    "twice_covariance": "not twice as large",
    "honesty_of_one": "with one camera: not half as large",
    "truth": "true joints rather than four cameras",
    "calibration_over_accuracy": "calibrated cameras more than a better estimator "
    "(triangulation less cameras turned by 1 degree)",
}  # fmt: skip
"""What each of `CONTRASTS` is worth, in words."""
WORTH = Table(
    "worth",
    "What it is worth",
    {question: (words,) for question, words in QUESTIONS.items()},
    (Column("worth.{}", "worth [%]", 1, 100.0, signed=True),),
    ("what",),
    "Throughput at that rate of contacts and under this shield, of an unshielded robot's, that is "
    "lost without it; the same seeds. Intervals are not corrected for the number of rows.",
)
COLOURS = {
    "truth": "0.25", "estimator": "#2f6db3", "cameras": "#3a9a8f", "latency": "#d1793b",
    "calibration": "#b23a48", "covariance": "#8a6bb8", "fault": "#8c7a4f",
}  # fmt: skip
ASKED = """\
Eyes that see less need more distance, and distance costs work. Every pair of eyes gets the shield
margin with which the robot touches a worker while moving towards them {level:g} times in 1,000
episodes of 10 s, {hourly:.1f} times an hour; the goals that are left are compared. The margin is
added to all protective distances of the `{shield}` shield and may be negative: the shield as it
comes is much safer than that. It is found by bisection on {n_seeds} episodes, the same for all
eyes, and confirmed on {n_fresh} others: the uncertainty of the level and of the margin is in the
intervals. The robot is {robot}, the workers take no notice of it; a touch is called by
what the robot did in the step before, and touches within half a second of each other are one. In
tasks with longer episodes there are fewer, and a thousand episodes are as much time.

This is one level, one shield and one body of the worker, and detections are emulated. Other touches
are not made equal. With true joints the shield still has its own model of the body around them. At
a stricter level, or with another shield, the order may be another one."""


def report(figures: Path, config: Any, played: Played, metrics: Metrics) -> Report:
    """Draw the figures; the tables beside them."""
    task, table = config.task, played.table
    eyes = [all_eyes()[name] for name in table[task]]
    draw_price(figures / "price.png", metrics, task, eyes, config.level)
    parts = [
        picture(figures / "price.png", "Goals that are left at that rate of contacts, in per cent "
                "of those of a robot without a shield; whiskers are 95 % intervals."),
        _table(task, eyes, metrics), _open_ended(task, table[task], metrics),
        WORTH.markdown(metrics),
    ]  # fmt: skip
    if config.others:
        parts.append("## Other tasks")
        parts += [_other(each, metrics) for each in config.others]
    if played.pixels:
        columns = [Column("slice.{}." + name.removeprefix("confirmed."), *words)
                   for name, words in RATES.items() if name != "confirmed.margin_m"]  # fmt: skip
        levels = {"keypoints": "the emulator", "pixels": "rendered images and the network"}
        parts += [
            f"## The emulator beside images\n\n{config.n_pixels} episodes with the margin of "
            f"`{FOUR}`; too few for a bar, the same for both.",
            table_of("level", levels, columns, metrics),
        ]
    asked = ASKED.format(
        level=config.level, hourly=an_hour(config.level), shield="qp", n_seeds=config.n_seeds,
        n_fresh=config.n_fresh, robot=_driven(config.driver),
    )  # fmt: skip
    return Report("What sight costs at one rate of contacts", asked, [*filter(None, parts)])


def _driven(driver: Driver) -> str:
    """Return the name of the agent that drives the robot."""
    usual = driver.agent == SCRIPTED
    return "the scripted one" if usual else f"driven by the agent `{driver.agent}`"


def an_hour(level: float) -> float:
    """Return contacts in an hour, of those in 1,000 episodes of 10 s."""
    return 60 * level / PER


def _table(task: str, eyes: Sequence[Eyes], metrics: Metrics) -> str:
    columns = [Column(f"{task}.{{}}.{what}", *words) for what, words in COLUMNS.items()]
    words = {each.name: each.words for each in eyes} | {"unshielded": "no shield"}
    none = [Column(f"{task}.{{}}.{what.removeprefix('confirmed.')}", *said)
            for what, said in RATES.items() if what != "confirmed.margin_m"]  # fmt: skip
    alone = table_of("without a shield", {"unshielded": words.pop("unshielded")}, none, metrics)
    return table_of(task, words, columns, metrics) + "\n\n" + alone


def _open_ended(task: str, rows: Mapping[str, Row], metrics: Metrics) -> str:
    margins_m = {name: metrics[f"{task}.{name}.margin_m"].value for name in rows}
    beyond = [f"`{name}`" for name, row in rows.items() if row.ends_at(margins_m[name])]
    if not beyond:
        return ""
    return (
        f"The level lies beyond the margins that were tried for {', '.join(beyond)}: theirs is "
        "the last one tried, and their price a bound."
    )


def _other(task: str, metrics: Metrics) -> str:
    names = ("margin_m", "goals_per_min", "share", "of_truth", "confirmed.towards")
    columns = [Column(f"{task}.{{}}.{what}", *COLUMNS[what]) for what in names]
    known = all_eyes()
    text = table_of(task, {name: known[name].words for name in ELSEWHERE}, columns, metrics)
    if f"{task}.ranking" not in metrics:
        return text
    holds = metrics[f"{task}.ranking"].value
    return (
        f"{text}\n\nA robot with true joints keeps as much as one with four cameras, and that as "
        f"much as one with one camera, in {holds:.0%} of the draws."
    )


def choose_bars(metrics: Metrics, task: str, eyes: Sequence[Eyes]) -> list[Eyes]:
    """Return the eyes that the picture shows, the longest bar last; of many only `QUICK`."""
    shown = [each for each in eyes if len(eyes) <= len(QUICK) or each.name in QUICK]
    return sorted(shown, key=lambda each: metrics[f"{task}.{each.name}.share"].value)


def draw_price(path: Path, metrics: Metrics, task: str, eyes: Sequence[Eyes], level: float) -> None:
    """Draw a bar for each pair of eyes, the longest above; of many only `QUICK`.

    Args:
        path: file of the picture.
        metrics: of the study.
        task: id of the environment.
        eyes: of which the task has metrics.
        level: contacts in 1,000 episodes of 10 s at which they are compared.
    """
    shown = choose_bars(metrics, task, eyes)
    figure = new_figure(9.2, 1.6 + 0.42 * len(shown))
    axis = figure.subplots()
    values = [metrics[f"{task}.{each.name}.share"] for each in shown]
    axis.barh(
        range(len(shown)), [100 * each.value for each in values], xerr=ends(values, 100.0),
        color=[COLOURS[each.group] for each in shown], height=0.72, ecolor="0.35", capsize=3,
    )  # fmt: skip
    _say(axis, shown, values)
    used = [name for name in GROUPS if name in {each.group for each in shown}]
    bars: list[Any] = [axis.barh(0, 0, color=COLOURS[name]) for name in used]
    words = [GROUPS[name] for name in used]
    figure.legend(bars, words, loc="outside lower center", ncols=2, fontsize=10)
    figure.suptitle(
        f"Work that is left where a robot drives into people {an_hour(level):.1f} times an hour\n"
        "emulated detections, one body, the margin of one shield", fontsize=13,
    )  # fmt: skip
    save(figure, path)


def _say(axis: Axes, shown: Sequence[Eyes], values: Sequence[Any]) -> None:
    """Words at bars, numbers in them, and what they are per cent of."""
    axis.set_yticks(range(len(shown)), [each.words for each in shown], fontsize=12)
    for y, value in enumerate(values):
        if value.value == value.value:
            axis.text(1.2, y, f"{100 * value.value:.0f} %", va="center", color="white",
                      fontsize=12, fontweight="bold")  # fmt: skip
    label(axis, "work that is left, in % of a robot without a shield", grid="x")
    axis.set_xlim(0, max([100.0, *(100 * each.high for each in values)]))
    for side in ("top", "right", "left"):
        axis.spines[side].set_visible(False)
    axis.tick_params(axis="y", length=0)
