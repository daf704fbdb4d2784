"""The declaration of the price study: question, columns and tables."""

from collections.abc import Sequence
from dataclasses import replace

from hrc_env.experiments.columns import Column
from hrc_env.experiments.price.metrics import PER
from hrc_env.experiments.price.setups import ELSEWHERE, FOUR, ONE, TRUTH, PriceSetup, list_setups
from hrc_env.experiments.price.shield import SHIELD
from hrc_env.experiments.report import Table

TITLE = "Cost of perception at one rate of contacts"
QUESTION = """\
How much throughput does a perception setup leave at one rate of contacts? Every setup gets the
shield margin with which the robot touches a worker while moving towards them {hourly:.1f} times an
hour ({level:g} times in 1,000 episodes of 10 s); the remaining goals are compared. The
margin is added to all protective distances of the `{shield}` shield (`margin_m` and
`hand_margin_m` of `ShieldConfig`) and may be negative, as the shield with its defaults is much
safer than that. It is found by bisection on {n_seeds} episodes, the same for all setups, and
confirmed on {n_fresh} others: the intervals contain the uncertainty of both the level and the
margin. Workers ignore {robot}; a contact is named by the robot's motion in the step before, and
touches within half a second of each other are one. Tasks with longer episodes have fewer of them;
a thousand episodes always stand for the same time.

This is one level and one shield, and detections are emulated. The rates of other contacts and the
severity of contacts are not equalized. With true joints the shield still has its own model of the
body around them. At a stricter level, or with another shield, the order may differ."""
_ROW, _FRESH = "{0}.{1}.", "confirmed."
"""Prefixes of metrics: task and perception setup, and statistics of the confirming episodes."""
PLAYED = Column(f"{_ROW}{_FRESH}margin_m", "tested margin [m]", 4, plain=True)
PER_HOUR = 60.0 / PER
"""Factor from contacts in 1,000 episodes of 10 s to contacts per hour."""
TOWARDS = Column(
    f"{_ROW}{_FRESH}towards", "contacts towards at tested margin [1/h]", 1, PER_HOUR, counted=True
)
SEVERE = Column(
    f"{_ROW}{_FRESH}above_force_limit",
    "contacts above the force limit at tested margin [%]",
    0,
    100,
    counted=True,
    shows="value of n",
)
LEFT = (
    Column(_ROW + "margin_m", "margin [m]", 3),
    Column(_ROW + "goals_per_min", "goals [1/min]"),
    Column(_ROW + "share", "throughput [% of unshielded]", 0, 100),
    Column(_ROW + "of_truth", "throughput [% of true joints]", 0, 100),
)
"""Columns of the metrics at the common rate of contacts."""
COLUMNS = (*LEFT, PLAYED, TOWARDS, SEVERE)
"""Columns of the tables in the documentation and in the report."""
MORE = (
    Column(f"{_ROW}{_FRESH}standing", "standing [1/h]", 1, PER_HOUR, counted=True),
    Column(f"{_ROW}{_FRESH}away", "fleeing [1/h]", 1, PER_HOUR, counted=True),
    Column(f"{_ROW}{_FRESH}contacts", "contacts [1/h]", 1, PER_HOUR, counted=True),
    Column(f"{_ROW}{_FRESH}interventions", "interventions [1/h]", 0, counted=True),
    Column(f"{_ROW}{_FRESH}goals_per_min", "goals at tested margin [1/min]"),
    Column(f"{_ROW}{_FRESH}cost", "true cost at tested margin"),
)
"""Further columns of the tables in the report."""
CONTRAST_LABELS = {
    "three_cameras": "the fourth camera", "two_cameras": "the third and the fourth camera",
    "one_camera": "the second to the fourth camera",
    "late_120ms": "images on time instead of 120 ms late, time-stamped",
    "late_200ms": "images on time instead of 200 ms late, time-stamped",
    "telling_120ms": "time stamps of images 120 ms late",
    "telling_200ms": "time stamps of images 200 ms late", "kalman": "particle instead of kalman",
    "paper_restarts": "particle instead of paper_restarts",
    "triangulation": "particle instead of triangulation",
    "calibration": "correct calibration instead of all cameras turned by 1 degree",
    "half_covariance": "covariances as estimated instead of halved",
    "twice_covariance": "covariances as estimated instead of doubled",
    "honesty_of_one": "with one camera: covariances as estimated instead of halved",
    "truth": "true joints instead of four cameras",
    "calibration_over_accuracy": "correct calibration over a better estimator "
    "(triangulation minus cameras turned by 1 degree)",
}  # fmt: skip
"""Labels of `CONTRASTS`."""
WORTH = Table(
    "worth",
    "Gain in throughput",
    {question: (label,) for question, label in CONTRAST_LABELS.items()},
    (Column("worth.{}", "gain [%]", 1, 100.0, signed=True),),
    ("improvement",),
    "Throughput gained by the improvement at the same rate of contacts, in percentage points of "
    "the throughput of an unshielded robot, on the same seeds. Intervals are those of single rows.",
)


def count_per_hour(level: float) -> float:
    """Convert a number of contacts in 1,000 episodes of 10 s to contacts per hour."""
    return PER_HOUR * level


def make_price_table(
    task: str,
    setups: Sequence[PriceSetup],
    robot: str,
    n_seeds: int,
    level: float,
    more: Sequence[Column] = (),
) -> Table:
    """Return the table of all perception setups in one task.

    Args:
        task: id of the environment.
        setups: setups in the order of the rows.
        robot: description of the robot, such as "the scripted robot".
        n_seeds: number of episodes per search step.
        level: contacts in 1,000 episodes of 10 s at which setups are compared.
        more: columns in addition to those of the documentation.
    """
    return Table(
        "price",
        f"Cost of perception at {count_per_hour(level):.1f} contacts towards per hour",
        {(task, each.name): (each.words,) for each in setups},
        (*COLUMNS, *more),
        ("perception",),
        f"Goals that {robot} reaches beside unaware workers, with emulated detections and "
        f"the `{SHIELD}` shield. Each setup has the margin with which the robot touches a worker "
        f"while moving towards them {count_per_hour(level):.1f} times per hour; other contacts "
        "and the severity of contacts are not equalized. Above the force limit: share of all "
        "contacts, by the estimated force and the limit of the touched body region. "
        "The margin is added to all protective distances; 0 is the default shield, and negative "
        f"margins let the robot come closer. It is found on {n_seeds} episodes and corrected by "
        f"{{n[{task}.{setups[0].name}.margin_m]}} others, which are played with the tested margin. "
        "True joints: the shield knows the joints and has its own model of the body around them.",
    )


def make_small_price_table(task: str) -> Table:
    """Return the table of an additional task, in which few setups are compared."""
    rows = {(task, name): (list_setups()[name].words,) for name in ELSEWHERE}
    return Table("price_in", task, rows, (*LEFT, TOWARDS, SEVERE), ("perception",))


def make_tasks_table(tasks: Sequence[str]) -> Table:
    """Return the table of all tasks, with one row per task."""
    words = {TRUTH: "true joints", FOUR: "four cameras", ONE: "one camera"}
    shares = [Column(f"{{}}.{name}.share", f"{words[name]} [%]", 0, 100) for name in ELSEWHERE]
    return Table(
        "price_elsewhere",
        "Cost of perception in all tasks",
        {task: (f"`{task}`",) for task in tasks},
        (*shares, Column("{}.ranking", "ranking holds [%]", 0, 100, plain=True)),
        ("task",),
        "Throughput as a share of that of an unshielded robot with true joints, at the same rate "
        "of contacts or, where that rate is not reached, at the lowest margin that was tried. "
        "Rows that do not reach the rate have fewer contacts; there the shield's speed limit near "
        "unseen areas, which does not depend on the margin, slows the robot with one camera. "
        "Ranking: share of bootstrap samples in which true joints give at least the throughput of "
        "four cameras, and four cameras at least that of one.",
    )


def _make_rate_columns(prefix: str) -> list[Column]:
    """Return the columns of the confirming episodes for metrics with another prefix."""
    return [
        replace(
            column,
            metric=prefix + column.metric.removeprefix(_ROW + _FRESH),
            heading=column.heading.replace(" at tested margin", ""),
        )
        for column in (TOWARDS, SEVERE, *MORE)
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
