"""The declaration of the price study: question, columns and tables."""

from collections.abc import Sequence
from dataclasses import replace

from hrc_env.experiments.columns import Column
from hrc_env.experiments.price.eyes import ELSEWHERE, FOUR, ONE, TRUTH, Eyes, list_eyes
from hrc_env.experiments.price.metrics import PER
from hrc_env.experiments.price.shield import SHIELD
from hrc_env.experiments.report import Table

TITLE = "Cost of perception at one rate of contacts"
QUESTION = """\
A perception setup that sees less needs more distance, and distance costs throughput. Every setup
gets the shield margin with which the robot touches a worker while moving towards them {level:g}
times in 1,000 episodes of 10 s, {hourly:.1f} times an hour; the remaining goals are compared. The
margin is added to all protective distances of the `{shield}` shield (`margin_m` and
`hand_margin_m` of `ShieldConfig`) and may be negative, as the shield with its defaults is much
safer than that. It is found by bisection on {n_seeds} episodes, the same for all setups, and
confirmed on {n_fresh} others: the intervals contain the uncertainty of both the level and the
margin. Workers ignore {robot}; a contact is named by the robot's motion in the step before, and
touches within half a second of each other are one. Tasks with longer episodes have fewer of them;
a thousand episodes always stand for the same time.

This is one level, one shield and one body of the worker, and detections are emulated. The rates of
other contacts are not equalized. With true joints the shield still has its own model of the body
around them. At a stricter level, or with another shield, the order may differ."""
_ROW, _FRESH = "{0}.{1}.", "confirmed."
"""Prefixes of metrics: task and perception setup, and counts of fresh episodes."""
PLAYED = Column(f"{_ROW}{_FRESH}margin_m", "margin played [m]", 4, plain=True)
TOWARDS = Column(f"{_ROW}{_FRESH}towards", "contacts towards with it [per 1,000]", 0, counted=True)
LEFT = (
    Column(_ROW + "margin_m", "margin [m]", 3),
    Column(_ROW + "goals_per_min", "goals [1/min]"),
    Column(_ROW + "share", "share of unshielded [%]", 0, 100),
    Column(_ROW + "of_truth", "share of true joints [%]", 0, 100),
)
"""Columns of the metrics at the rate of contacts."""
COLUMNS = (*LEFT, PLAYED, TOWARDS)
"""Columns of the documentation and of the report."""
MORE = (
    Column(f"{_ROW}{_FRESH}standing", "standing [per 1,000]", 0, counted=True),
    Column(f"{_ROW}{_FRESH}away", "fleeing [per 1,000]", 0, counted=True),
    Column(f"{_ROW}{_FRESH}goals_per_min", "goals with it [1/min]"),
    Column(f"{_ROW}{_FRESH}cost", "true cost with it"),
)
"""Further columns of the report."""
CONTRAST_LABELS = {
    "three_cameras": "the fourth camera", "two_cameras": "the third and the fourth camera",
    "one_camera": "all cameras but one", "late_120ms": "images on time, not 120 ms late (known)",
    "late_200ms": "images on time, not 200 ms late (known)",
    "telling_120ms": "time stamps of images 120 ms late",
    "telling_200ms": "time stamps of images 200 ms late", "kalman": "particle rather than kalman",
    "paper_restarts": "particle rather than paper_restarts",
    "triangulation": "particle rather than triangulation",
    "calibration": "cameras that are not turned by 1 degree",
    "half_covariance": "covariances as estimated, not half as large",
    "twice_covariance": "covariances as estimated, not twice as large",
    "honesty_of_one": "with one camera: covariances as estimated, not half as large",
    "truth": "true joints rather than four cameras",
    "calibration_over_accuracy": "calibrated cameras more than a better estimator "
    "(triangulation minus cameras turned by 1 degree)",
}  # fmt: skip
"""Labels of `CONTRASTS`."""
"""Labels of `CONTRASTS`."""
WORTH = Table(
    "worth",
    "Gain in throughput",
    {question: (label,) for question, label in CONTRAST_LABELS.items()},
    (Column("worth.{}", "gain [%]", 1, 100.0, signed=True),),
    ("improvement",),
    "Throughput gained by the improvement at that rate of contacts and with this shield, in "
    "percent of an unshielded robot's; the same seeds. A dot marks an interval that excludes zero. "
    "Intervals are not corrected for the number of rows.",
)


def count_per_hour(level: float) -> float:
    """Return the contacts per hour for a number of contacts in 1,000 episodes of 10 s."""
    return 60 * level / PER


def make_price_table(
    task: str,
    eyes: Sequence[Eyes],
    robot: str,
    n_seeds: int,
    level: float,
    more: Sequence[Column] = (),
) -> Table:
    """Return the table of all perception setups in one task.

    Args:
        task: id of the environment.
        eyes: setups in the order of the rows.
        robot: description of the robot, as "the scripted robot".
        n_seeds: number of episodes per search step.
        level: contacts in 1,000 episodes of 10 s at which setups are compared.
        more: columns besides those of the documentation.
    """
    return Table(
        "price",
        f"Cost of perception at {level:g} contacts in 1,000 episodes",
        {(task, each.name): (each.words,) for each in eyes},
        (*COLUMNS, *more),
        ("perception",),
        f"Goals that {robot} reaches beside workers of one body who ignore it, with emulated "
        f"detections, with the `{SHIELD}` shield and the margin at which it touches a worker while "
        f"moving towards them {level:g} times in 1,000 episodes of 10 s, "
        f"{count_per_hour(level):.1f} times an hour. Rates of other contacts are not equalized. "
        "The margin is added to all protective distances; 0 is the shield with its defaults. True "
        f"joints: the shield has its own body around them. Margins are found on {n_seeds} episodes "
        f"and corrected by {{n[{task}.{eyes[0].name}.margin_m]}} others.",
    )


def make_small_price_table(task: str) -> Table:
    """Return the table of another task, which has few setups."""
    rows = {(task, name): (list_eyes()[name].words,) for name in ELSEWHERE}
    return Table("price_in", task, rows, (*LEFT, TOWARDS), ("perception",))


def make_tasks_table(tasks: Sequence[str]) -> Table:
    """Return the table of all tasks, with one row per task."""
    words = {TRUTH: "true joints", FOUR: "four cameras", ONE: "one camera"}
    shares = [Column(f"{{}}.{eyes}.share", f"{words[eyes]} [%]", 0, 100) for eyes in ELSEWHERE]
    return Table(
        "price_elsewhere",
        "Cost of perception in all tasks",
        {task: (f"`{task}`",) for task in tasks},
        (*shares, Column("{}.ranking", "ranking holds [%]", 0, 100, plain=True)),
        ("task",),
        "Share of the throughput of an unshielded robot with true joints, at that rate of contacts "
        "or, if it is not reached, at the least margin tried. Such rows have fewer and unequal "
        "numbers of contacts; there the shield's speed limit near unseen areas, which the margin "
        "does not change, slows the robot with one camera. Ranking: the share of draws in which "
        "true joints keep at least as much as four cameras, and these as much as one.",
    )


def _make_rate_columns(prefix: str) -> list[Column]:
    """Return the columns of counts on fresh episodes, for metrics with another prefix."""
    return [
        replace(
            column,
            metric=prefix + column.metric.removeprefix(_ROW + _FRESH),
            heading=column.heading.replace(" with it", ""),
        )
        for column in (TOWARDS, *MORE)
    ]


def make_unshielded_table(task: str) -> Table:
    """Return the table of the robot without a shield."""
    columns = _make_rate_columns("{}.unshielded.")
    return Table("price_unshielded", "Without a shield", {task: ("no shield",)}, columns)


IMAGES = Table(
    "price_images",
    "Emulator and rendered images",
    {"keypoints": ("the emulator",), "pixels": ("rendered images and the network",)},
    _make_rate_columns("slice.{}."),
    ("level",),
)
