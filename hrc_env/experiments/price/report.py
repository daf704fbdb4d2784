"""The report: bars of the work that is left, the margins behind them, questions."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from hrc_env.experiments.plots import ends, label, new_figure, save
from hrc_env.experiments.price import declaration
from hrc_env.experiments.price.declaration import MORE, an_hour
from hrc_env.experiments.price.eyes import FOUR, GROUPS, QUICK, Eyes, all_eyes
from hrc_env.experiments.price.metrics import Played, Row
from hrc_env.experiments.price.shield import SHIELD
from hrc_env.experiments.report import Metrics, Report, picture

COLOURS = {
    "truth": "0.25", "estimator": "#2f6db3", "cameras": "#3a9a8f", "latency": "#d1793b",
    "calibration": "#b23a48", "covariance": "#8a6bb8", "fault": "#8c7a4f",
}  # fmt: skip


def report(figures: Path, config: Any, played: Played, metrics: Metrics) -> Report:
    """Draw the figure; return the tables beside it.

    Args:
        figures: folder.
        config: of the study.
        played: of its episodes.
        metrics: of the study.
    """
    task, table = config.task, played.table
    eyes = [all_eyes()[name] for name in table[task]]
    draw_price(figures / "price.png", metrics, task, eyes, config.level)
    parts = [
        picture(figures / "price.png", "Goals that are left at that rate of contacts, in per cent "
                "of those of a robot without a shield; whiskers are 95 % intervals."),
        config.prices(MORE).markdown(metrics),
        declaration.unshielded(task).markdown(metrics),
        _open_ended(task, table[task], metrics), declaration.WORTH.markdown(metrics),
    ]  # fmt: skip
    if config.others:
        parts += ["## Other tasks", declaration.elsewhere(config.tasks).markdown(metrics)]
        parts += [declaration.prices_in(each).markdown(metrics) for each in config.others]
    if played.pixels:
        parts += [
            f"## The emulator beside images\n\n{config.n_pixels} episodes with the margin of "
            f"`{FOUR}`; too few for a bar, the same for both.",
            declaration.IMAGES.markdown(metrics),
        ]
    asked = declaration.ASKED.format(
        level=config.level, hourly=an_hour(config.level), shield=SHIELD, n_seeds=config.n_seeds,
        n_fresh=config.n_fresh, robot=config.driver.words,
    )  # fmt: skip
    return Report(declaration.TITLE, asked, [*filter(None, parts)])


def _open_ended(task: str, rows: Mapping[str, Row], metrics: Metrics) -> str:
    margins_m = {name: metrics[f"{task}.{name}.margin_m"].value for name in rows}
    beyond = [f"`{name}`" for name, row in rows.items() if row.ends_at(margins_m[name])]
    if not beyond:
        return ""
    unsure = [
        f"`{name}` ({row.margin_m:+.3f} m)"
        for name, row in rows.items()
        if row.ends_at(margins_m[name]) and abs(row.margin_m - margins_m[name]) > 1e-6
    ]
    elsewhere = (
        f" Fresh seeds of {', '.join(unsure)} were played with that margin, where the search "
        "supposed the level; they contradict it, and are too few to place it."
    )
    return (
        f"The level lies beyond the margins that were tried for {', '.join(beyond)}: theirs is "
        f"the last one tried, and their price a bound.{elsewhere if unsure else ''}"
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
        f"Work retained at {an_hour(level):.1f} collisions with people per hour\n"
        "emulated detections, one body, one shield with the margin adjusted", fontsize=13,
    )  # fmt: skip
    save(figure, path)


def _say(axis: Axes, shown: Sequence[Eyes], values: Sequence[Any]) -> None:
    """Words at bars, numbers in them, and what they are per cent of."""
    axis.set_yticks(range(len(shown)), [each.words for each in shown], fontsize=12)
    for y, value in enumerate(values):
        if value.value == value.value:
            axis.text(1.2, y, f"{100 * value.value:.0f} %", va="center", color="white",
                      fontsize=12, fontweight="bold")  # fmt: skip
    label(axis, "work retained [% of a robot without a shield]", grid="x")
    axis.set_xlim(0, max([100.0, *(100 * each.high for each in values)]))
    for side in ("top", "right", "left"):
        axis.spines[side].set_visible(False)
    axis.tick_params(axis="y", length=0)
