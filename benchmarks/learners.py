"""Scores of policies that are trained for each task.

    python -m benchmarks.learners

For each task, policies are trained with five seeds by the command on the task's page, `python -m
hrc_env train --task ID`. Their success, cost and contacts are compared with those of the scripted
agent on the same fixed seeds, and the time of the training is measured. For policies, the table
shows the interquartile mean over the training seeds with its stratified bootstrap interval, and the
rate of contacts of all policies together with its exact interval.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import torch
import tyro

from benchmarks.command import StudyArguments, run_study
from benchmarks.common import TASKS, make_exact
from benchmarks.learning import Training, pool_rates
from hrc_env.agents.recipes import fill_in
from hrc_env.agents.requests import TrainingRequest
from hrc_env.cli.entry import show_errors
from hrc_env.core.errors import check_names
from hrc_env.core.results import Metric, over
from hrc_env.evaluation.episodes import EVALUATION_SEED
from hrc_env.evaluation.intervals import MIN_RUNS, estimate_run_iqm
from hrc_env.experiments.columns import Column, mean, rate, share_of_tries
from hrc_env.experiments.report import Metrics, Table
from hrc_env.experiments.study import Row, Study
from hrc_env.experiments.versions import make_key
from hrc_env.tasks import BUILT_IN

DEPENDS = ("env", "tracker", "emulator", "motion", "agents")
"""Names of the subsystems on which policies and the results of parts depend."""
MEASURED = ("success", "cost")
"""Metrics of which the interquartile mean over the training seeds is computed."""
Trainings = Mapping[str, list[Training]]
"""Training runs by task, one per seed."""


@dataclass(frozen=True)
class LearnersArguments(StudyArguments):
    """Train policies for each task; with --quick, a single seed for a few thousand steps."""

    out: Path = Path("out/learners")
    """Folder for results.json, the report, policies and cached results of completed parts."""
    ids: tuple[str, ...] = TASKS
    """Ids of the tasks."""
    seeds: tuple[int, ...] = (0, 1, 2, 3, 4)
    """Seeds of the training runs."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for an unknown task."""
        super().__post_init__()
        check_names("task", self.ids, BUILT_IN)


def make_trainings(arguments: LearnersArguments) -> Trainings:
    """Return the training runs of all tasks."""
    key = make_key({"quick": arguments.quick}, DEPENDS)
    more: dict[str, Any] = {} if arguments.threads is None else {"threads": arguments.threads}
    if arguments.quick:
        more |= {"timesteps": 4096, "num-envs": 8, "demonstrations": 0}
    seeds = arguments.seeds[:1] if arguments.quick else arguments.seeds
    return {
        task: [
            Training(
                arguments.out / "policies" / f"{task}-{seed}-{key}",
                {"task": task, "seed": seed, **more},
            )
            for seed in seeds
        ]
        for task in arguments.ids
    }


def make_study(trainings: Trainings) -> Study:
    """Return the study of the trained policies and the scripted agents."""
    rows = {}
    for task, runs in trainings.items():
        env = fill_in(TrainingRequest(task=task)).keywords() | {"config": {}}  # the default reward
        for name in ("perception", "estimator", "num_threads"):
            env.pop(name, None)
        rows[f"{task}.scripted"] = Row(task, 128, env=env)
        for k, run in enumerate(runs):
            if run.policy.exists():
                rows[f"{task}.policy_{k}"] = Row(task, 128, str(run.policy), env=env)
    return Study(
        name="learners",
        title=TITLE,
        about=(__doc__ or "").strip(),
        depends=DEPENDS,
        first_seed=EVALUATION_SEED,
        rows=rows,
        columns=(share_of_tries(), mean("cost"), rate("contacts")),
        tables=(
            Table("learners", TITLE, {task: (f"`{task}`",) for task in trainings}, COLUMNS,
                  ("task",), NOTE, fewest=MIN_RUNS),
        ),
        derive=partial(summarize, trainings=trainings),
    )  # fmt: skip


def summarize(metrics: Metrics, trainings: Trainings) -> dict[str, Metric]:
    """Summarize the metrics and the training times over the seeds of each task."""
    summary = {}
    for task, runs in trainings.items():
        seeds = [f"{task}.policy_{k}" for k, run in enumerate(runs) if run.is_finished]
        if not seeds:
            continue
        for name in MEASURED:
            values = [metrics[f"{seed}.{name}"] for seed in seeds]
            summary[f"{task}.learnt.{name}"] = estimate_run_iqm(
                [[value.value for value in values]], values[0].unit
            )
        contacts = [metrics[f"{seed}.contacts"] for seed in seeds]
        summary[f"{task}.learnt.all_contacts"] = pool_rates(contacts)
        minutes = [run.score["processor_s"] / 60 for run in runs if run.is_finished]
        summary[f"{task}.minutes"] = over(minutes, "min")
        learnt = summary[f"{task}.learnt.success"].value
        share = learnt / metrics[f"{task}.scripted.success"].value
        summary[f"{task}.share_of_expert"] = make_exact(share, "share", len(seeds))
    return summary


def make_default(out: Path) -> Study:
    """Return the study with default arguments and the policies in the folder `out`."""
    return make_study(make_trainings(LearnersArguments(out)))


def main() -> int:
    """Train and evaluate the policies, print the report, and return the exit status."""
    arguments = tyro.cli(LearnersArguments, description=__doc__)
    torch.set_num_threads(1)  # two threads are slower for such small networks
    trainings = make_trainings(arguments)
    for runs in trainings.values():
        for training in runs:
            training.run()
    return run_study(make_study(trainings), arguments)


TITLE = "Learnt policies in every task"
NOTE = (
    "Means over {n[HRCReach-v0.scripted.success]} episodes beside attentive workers at "
    "`keypoints`. Success: share of an episode's goals, studs, screws or loads that were achieved; "
    "cost and contacts per episode. Learnt: interquartile mean over "
    "{n[HRCReach-v0.learnt.success]} policies of different seeds, each trained by `python -m "
    "hrc_env train --task ID`, with a 95 % stratified bootstrap interval from five seeds on; "
    "contacts of all of them, with an exact interval. Scripted: the agent `scripted`. Training: "
    "median over the seeds."
)
COLUMNS = (
    Column("{}.learnt.success", "success", 2),
    Column("{}.scripted.success", "success, scripted", 2, plain=True),
    Column("{}.learnt.cost", "cost"),
    Column("{}.scripted.cost", "cost, scripted", plain=True),
    Column("{}.learnt.all_contacts", "contacts", 2, counted=True),
    Column("{}.scripted.contacts", "contacts, scripted", 2, counted=True),
    Column("{}.minutes", "training [core min]", 0, plain=True),
)

if __name__ == "__main__":
    sys.exit(show_errors(main))
