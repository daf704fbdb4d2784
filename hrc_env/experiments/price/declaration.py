"""The study of what sight costs as it is declared: question, columns and tables."""

from collections.abc import Sequence
from dataclasses import replace

from hrc_env.experiments.columns import Column
from hrc_env.experiments.price.eyes import ELSEWHERE, FOUR, ONE, TRUTH, Eyes, all_eyes
from hrc_env.experiments.price.metrics import PER
from hrc_env.experiments.price.shield import SHIELD
from hrc_env.experiments.report import Table

TITLE = "What sight costs at one rate of contacts"
ASKED = """\
Eyes that see less need more distance, and distance costs work. Every pair of eyes gets the shield
margin with which the robot touches a worker while moving towards them {level:g} times in 1,000
episodes of 10 s, {hourly:.1f} times an hour; the goals that are left are compared. The margin is
added to all protective distances of the `{shield}` shield (`margin_m` and `hand_margin_m`
of `ShieldConfig`) and may be negative: the shield as it
comes is much safer than that. It is found by bisection on {n_seeds} episodes, the same for all
eyes, and confirmed on {n_fresh} others: the uncertainty of the level and of the margin is in the
intervals. Workers take no notice of {robot}; a touch is called by what the robot did in the step
before, and touches within half a second of each other are one. In tasks with longer episodes there
are fewer, and a thousand episodes are as much time.

This is one level, one shield and one body of the worker, and detections are emulated. Other touches
are not made equal. With true joints the shield still has its own model of the body around them. At
a stricter level, or with another shield, the order may be another one."""
_ROW, _FRESH = "{0}.{1}.", "confirmed."
"""Before the names of metrics: task and eyes; and what was counted on fresh episodes."""
PLAYED = Column(f"{_ROW}{_FRESH}margin_m", "played with [m]", 4, plain=True)
TOWARDS = Column(f"{_ROW}{_FRESH}towards", "contacts towards there [per 1,000]", 0, counted=True)
LEFT = (
    Column(_ROW + "margin_m", "margin [m]", 3),
    Column(_ROW + "goals_per_min", "goals [1/min]"),
    Column(_ROW + "share", "of an unshielded robot's [%]", 0, 100),
    Column(_ROW + "of_truth", "of true joints' [%]", 0, 100),
)
"""What is left at the rate of contacts."""
COLUMNS = (*LEFT, PLAYED, TOWARDS)
"""Of the documentation, and of the report."""
MORE = (
    Column(f"{_ROW}{_FRESH}standing", "standing [per 1,000]", 0, counted=True),
    Column(f"{_ROW}{_FRESH}away", "fleeing [per 1,000]", 0, counted=True),
    Column(f"{_ROW}{_FRESH}goals_per_min", "goals there [1/min]"),
    Column(f"{_ROW}{_FRESH}cost", "true cost there"),
)
"""Of the report besides."""
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
    "lost without it; the same seeds. A dot: the interval leaves out zero. Intervals are not "
    "corrected for the number of rows.",
)


def an_hour(level: float) -> float:
    """Return contacts in an hour, of those in 1,000 episodes of 10 s."""
    return 60 * level / PER


def prices(
    task: str,
    eyes: Sequence[Eyes],
    robot: str,
    n_seeds: int,
    level: float,
    more: Sequence[Column] = (),
) -> Table:
    """Return the table of all eyes in one task.

    Args:
        task: id of the environment.
        eyes: in the order of the rows.
        robot: in words, as "the scripted robot".
        n_seeds: episodes of every step of the search.
        level: contacts in 1,000 episodes of 10 s at which they are compared.
        more: columns besides those of the documentation.
    """
    return Table(
        "price",
        f"What sight costs at {level:g} contacts in 1,000 episodes",
        {(task, each.name): (each.words,) for each in eyes},
        (*COLUMNS, *more),
        ("eyes",),
        f"Goals that {robot} reaches beside workers of one body who take no notice of it, "
        f"detections emulated, under the `{SHIELD}` shield with the margin at which it touches a "
        f"worker while moving towards them {level:g} times in 1,000 episodes of 10 s, "
        f"{an_hour(level):.1f} times an hour. Other contacts are not made equal. The margin is "
        "added to all protective distances; 0 is the shield as it comes. True joints: the shield "
        f"has its own body around them. Sought on {n_seeds} episodes, corrected by "
        f"{{n[{task}.{eyes[0].name}.margin_m]}} others.",
    )


def prices_in(task: str) -> Table:
    """Return the table of the few eyes of another task."""
    rows = {(task, e): (all_eyes()[e].words,) for e in ELSEWHERE}
    return Table("price_in", task, rows, (*LEFT, TOWARDS), ("eyes",))


def elsewhere(tasks: Sequence[str]) -> Table:
    """Return the table of all tasks, a row for each."""
    words = {TRUTH: "true joints", FOUR: "four cameras", ONE: "one camera"}
    shares = [Column(f"{{}}.{eyes}.share", f"{words[eyes]} [%]", 0, 100) for eyes in ELSEWHERE]
    return Table(
        "price_elsewhere",
        "The same in other tasks",
        {task: (f"`{task}`",) for task in tasks},
        (*shares, Column("{}.ranking", "ranking holds [%]", 0, 100, plain=True)),
        ("task",),
        "Of the throughput of an unshielded robot with true joints, at that rate of contacts or, "
        "where it is not reached, at the least margin tried. These rows have fewer contacts, and "
        "not equally many; there the shield's limit of speed near the unseen, which the margin "
        "does not move, slows one camera. Ranking: in so many draws true joints keep as much as "
        "four cameras, and these as much as one.",
    )


def _rates(start: str) -> list[Column]:
    """Return the columns of what was counted on fresh episodes, with other names."""
    found = [TOWARDS, *MORE]
    return [
        replace(
            each,
            metric=start + each.metric.removeprefix(_ROW + _FRESH),
            heading=each.heading.replace(" there", ""),
        )
        for each in found
    ]


def unshielded(task: str) -> Table:
    """Return the table of the robot without a shield."""
    return Table(
        "price_unshielded", "Without a shield", {task: ("no shield",)}, _rates("{}.unshielded.")
    )


IMAGES = Table(
    "price_images",
    "The emulator beside images",
    {"keypoints": ("the emulator",), "pixels": ("rendered images and the network",)},
    _rates("slice.{}."),
    ("level",),
)
