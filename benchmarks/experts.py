"""What the scripted agents of all tasks are worth: python -m benchmarks.experts

By success, time, cost and contacts on the same seeds: without workers, and beside attentive ones
at perception levels. Episodes at `pixels` are played one by one.
"""

import sys
from itertools import product

from benchmarks.command import main
from benchmarks.common import TASKS
from hrc_env.experiments.columns import Column, mean, rate, share_of_episodes
from hrc_env.experiments.report import Table
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.study import Row, Study
from hrc_env.tasks import BUILT_IN

WAYS = {
    "alone": ("scripted", "none"),
    "truth": ("scripted", "truth"),
    "keypoints": ("scripted", "keypoints"),
    "slowed": ("scripted_slowed", "keypoints"),
    "pixels": ("scripted", "pixels"),
}
"""Agents and perception levels, by name as in the table."""
NEEDS_WORKERS = ("HRCHandover-v0",)
"""Tasks that nobody can do alone."""


def _row(task: str, way: str) -> Row:
    """Return one way to do a task."""
    (agent, level), is_pixels = WAYS[way], way == "pixels"
    env = {"task": task, **({"n_workers": 0} if way == "alone" else {})}
    return Row(f"{task}, {way}", 5 if is_pixels else 50, agent, PerceptionSetup(level), env,
               n_together=1 if is_pixels else 50)  # fmt: skip


STUDY = Study(
    name="experts",
    title="What scripted agents are worth",
    about=(__doc__ or "").strip(),
    depends=("env", "tracker", "emulator", "detector", "motion", "agents"),
    first_seed=3_000_000,
    rows={
        f"{task}.{way}": _row(task, way)
        for way, task in product(WAYS, BUILT_IN)
        if way != "alone" or task not in NEEDS_WORKERS
    },
    columns=(
        share_of_episodes("success"), mean("seconds", unit="s"), mean("cost"), rate("contacts"),
    ),
    tables=(
        Table(
            "experts",
            "What scripted agents are worth",
            {task: (f"`{task}`",) for task in TASKS},
            (
                Column("{}.alone.success", "no worker [%]", scale=100),
                Column("{}.truth.success", "`truth` [%]", scale=100),
                Column("{}.keypoints.success", "`keypoints` [%]", scale=100),
                Column("{}.slowed.success", "`keypoints`, slowed [%]", scale=100),
                Column("{}.pixels.success", "`pixels` [%]", 0, 100),
                Column("{}.keypoints.cost", "cost, `keypoints`"),
                Column("{}.slowed.cost", "slowed"),
                Column("{}.keypoints.seconds", "time, `keypoints` [s]", plain=True),
            ),
            ("task",),
            "Successful episodes of {n[HRCReach-v0.alone.success]} "
            "({n[HRCReach-v0.pixels.success]} at `pixels`) beside attentive workers, and alone; "
            "cost an episode. 95 % intervals.",
        ),
    ),
    n_quick=2,
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(lambda: STUDY, __doc__))
