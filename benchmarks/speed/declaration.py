"""Configurations, columns and tables of the speed benchmark."""

from collections.abc import Iterable, Sequence

from benchmarks.speed.organs import ORGANS, REST, TOTAL
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Table
from hrc_env.tasks import BUILT_IN, DEFAULT

ASKED = "How long does a step take, alone and in a batch, and which parts take the time?"
SINGLE = "single"
"""Name of the configuration with an environment of `gymnasium.make`."""
REACHER = "reacher"
"""Name of Gymnasium's Reacher, which is used in place of a perception level."""
SHOWN = (SINGLE, "16.1", "64.1", "64.2")
"""Configurations for which the documentation shows the parts of a step."""
RESETS = {
    "reset_one": Column("reset_ms.1_of_1", plain=True),
    "reset_some": Column("reset_ms.8_of_64", plain=True),
}
TASKS = Table(
    "speed_tasks",
    "Speed of every task",
    {task: (f"`{task}`",) for task in BUILT_IN},
    (
        Column("task_steps_per_s.{}", "environment steps [1/s]", 0),
        Column("task_share.{}", f"of `{DEFAULT}` [%]", 0, 100),
    ),
    ("task",),
    "`keypoints`, one worker, 64 environments on 2 threads, random actions; tasks take turns of 20 "
    "steps. Median, smallest and largest value of the rounds.",
    fewest=1,
)


def title(configuration: str) -> str:
    """Return the description of a configuration.

    Args:
        configuration: `SINGLE`, or "<num_envs>.<threads>".
    """
    if configuration == SINGLE:
        return SINGLE
    size, threads = configuration.split(".")
    return f"{size} on {threads} thread{'s' if threads != '1' else ''}"


def make_steps_table(levels: Sequence[str], configurations: Iterable[str]) -> Table:
    """Return the table of steps per second.

    Args:
        levels: perception levels.
        configurations: configurations in the order of the rows.
    """
    own = [Column(f"env_steps_per_s.{each}.{{}}", f"`{each}` [1/s]", 0) for each in levels]
    return Table(
        "speed",
        "Environment steps per second",
        {each: (title(each),) for each in configurations},
        (Column(f"env_steps_per_s.{REACHER}.{{}}", "Gymnasium's Reacher-v5 [1/s]", 0), *own),
        ("environments",),
        "Random actions over whole episodes; resets are included and every info is read. Median, "
        "smallest and largest value of "
        f"{{n[env_steps_per_s.{REACHER}.{SINGLE}]}} rounds in which configurations take turns. "
        f"`{SINGLE}` is an environment of `gymnasium.make`, the others are batches. The machine is "
        "shared: compare ratios.",
        fewest=1,
    )


def make_organs_table(configurations: Iterable[str]) -> Table:
    """Return the table of the times of the parts of a step.

    Args:
        configurations: configurations in the order of the columns.
    """
    return Table(
        "speed_organs",
        "Time of the parts of a step, `keypoints`",
        {each: (each,) for each in (*ORGANS, REST, TOTAL)},
        [Column(f"us_per_env_step.{{}}.{each}", f"{title(each)} [us]") for each in configurations],
        ("part",),
        "Per environment and step. With two threads the time of a part is divided by two, so that "
        "every column is wall-clock time. A reset takes {reset_one} ms; that of 8 of 64 "
        "environments takes {reset_some} ms.",
        RESETS,
    )
