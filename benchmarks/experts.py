"""Scores of the scripted agents in all tasks.

    python -m benchmarks.experts

Success, time, cost and contacts are measured on the same seeds without workers, and with attentive
workers at several perception levels. Episodes at `pixels` are simulated one after the other.
"""

import sys
from itertools import product
from typing import NamedTuple

from benchmarks.command import main
from benchmarks.common import TASKS
from hrc_env.experiments.columns import Column, mean, rate, share_of_episodes
from hrc_env.experiments.report import Table
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.study import Row, Study
from hrc_env.tasks import BUILT_IN


class Way(NamedTuple):
    """Agent and perception level of an evaluation."""

    agent: str
    level: str
    """Perception level of the environment."""


WAYS = {
    "alone": Way("scripted", "none"),
    "truth": Way("scripted", "truth"),
    "keypoints": Way("scripted", "keypoints"),
    "slowed": Way("scripted_slowed", "keypoints"),
    "pixels": Way("scripted", "pixels"),
}
"""Agents and perception levels of the evaluations of each task, by the name in tables."""
NEEDS_WORKERS = ("HRCHandover-v0",)
"""Ids of tasks that require a worker."""


def _make_row(task: str, way: str) -> Row:
    """Return the row of a task for one of the `WAYS`."""
    (agent, level), is_pixels = WAYS[way], way == "pixels"
    env = {"task": task, **({"n_workers": 0} if way == "alone" else {})}
    return Row(f"{task}, {way}", 5 if is_pixels else 50, agent, PerceptionSetup(level), env,
               n_together=1 if is_pixels else 50)  # fmt: skip


STUDY = Study(
    name="experts",
    title="Scores of the scripted agents",
    about=(__doc__ or "").strip(),
    depends=("env", "tracker", "emulator", "detector", "motion", "agents"),
    first_seed=3_000_000,
    rows={
        f"{task}.{way}": _make_row(task, way)
        for way, task in product(WAYS, BUILT_IN)
        if way != "alone" or task not in NEEDS_WORKERS
    },
    columns=(
        share_of_episodes("success"), mean("seconds", unit="s"), mean("cost"), rate("contacts"),
    ),
    tables=(
        Table(
            "experts",
            "Scores of the scripted agents",
            {task: (f"`{task}`",) for task in TASKS},
            (
                Column("{}.alone.success", "no worker [%]", scale=100),
                Column("{}.truth.success", "`truth` [%]", scale=100),
                Column("{}.keypoints.success", "`keypoints` [%]", scale=100),
                Column("{}.pixels.success", "`pixels` [%]", 0, 100),
                Column("{}.slowed.success", "`scripted_slowed` [%]", scale=100),
                Column("{}.keypoints.cost", "cost"),
                Column("{}.slowed.cost", "cost, `scripted_slowed`"),
                Column("{}.keypoints.seconds", "duration [s]", plain=True),
            ),
            ("task",),
            "Share of {n[HRCReach-v0.alone.success]} episodes "
            "({n[HRCReach-v0.pixels.success]} at `pixels`) in which `scripted` completed the task "
            "without workers, and beside attentive workers with each perception; the columns of "
            "`scripted_slowed`, the cost per episode and the duration are at `keypoints`. 95 % "
            "intervals.",
        ),
    ),
    n_quick=2,
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(lambda: STUDY, __doc__))
