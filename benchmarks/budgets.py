"""Cost per episode of agents that learn nothing, from which the budgets of the tasks were chosen.

    python -m benchmarks budgets

The default cost limit of a task in `python -m hrc_env train --algorithm ppo_lagrangian`
(`hrc_env.agents.learner_settings.COST_LIMITS`) is between the cost of the scripted agent with the
shield `qp` and without one, if these differ. In `HRCHandover-v0`, bringing the tool to the hand
costs about the same with every agent; in `HRCDelivery-v0`, only `random` costs anything. Episodes
that end early, because the task is done, cost less.
"""

from itertools import product
from typing import NamedTuple

from benchmarks.common import TASKS, make_exact
from hrc_env.agents.learner_settings import COST_LIMITS
from hrc_env.core.results import Metric
from hrc_env.experiments.columns import Column, mean, share_of_tries
from hrc_env.experiments.report import SHIELD_CHOSEN_ON, Conditions, Metrics, Table, format_seeds
from hrc_env.experiments.stage import WORKER
from hrc_env.experiments.study import Row, Study

FIRST_SEED, N_EPISODES = 18_100_000, 32
"""First seed, and number of episodes of each row."""


class Behaviour(NamedTuple):
    """An agent and its shield."""

    agent: str
    shield: str | None
    words: str
    """Heading of the column."""


BEHAVIOURS = {
    "random": Behaviour("random", None, "`random`"),
    "scripted": Behaviour("scripted", None, "`scripted`"),
    "slowed": Behaviour("scripted_slowed", None, "`scripted_slowed`"),
    "shielded": Behaviour("scripted", "qp", "`scripted`, shield `qp`"),
}
"""Behaviours that are compared, by the name in results.json."""


def make_study(n_episodes: int = N_EPISODES) -> Study:
    """Return the study of all tasks.

    Args:
        n_episodes: number of episodes of each row.
    """
    rows = {
        f"{task}.{name}": Row(
            (f"`{task}`", each.words),
            n_episodes,
            each.agent,
            env={"task": task, "shield": each.shield, "config": {"worker": WORKER}},
            n_together=N_EPISODES,
        )
        for task, (name, each) in product(TASKS, BEHAVIOURS.items())
    }
    return Study(
        name="budgets",
        title="Budgets of the cost",
        about=(__doc__ or "").strip(),
        depends=("env", "tracker", "emulator", "motion", "shield", "agents"),
        first_seed=FIRST_SEED,
        rows=rows,
        columns=(mean("cost"), mean("cost_steps"), share_of_tries()),
        tables=(make_table(n_episodes),),
        derive=list_limits,
        conditions=Conditions(
            people="`attentive`", scene="that of the task", perception="`keypoints`",
            chosen_on=f"budgets were chosen on the same seeds; {SHIELD_CHOSEN_ON}", worker=WORKER,
            seeds=format_seeds(range(FIRST_SEED, FIRST_SEED + n_episodes)),
        ),
        n_quick=2,
    )  # fmt: skip


def make_table(n_episodes: int) -> Table:
    """Return the table of all tasks.

    Args:
        n_episodes: number of episodes of each row.
    """
    columns = [Column(f"{{}}.{name}.cost", each.words) for name, each in BEHAVIOURS.items()]
    return Table(
        "budgets",
        "Budgets of the cost",
        {task: (f"`{task}`",) for task in TASKS},
        (*columns, Column("{}.budget", "budget", 1, plain=True)),
        ("task",),
        f"Cost per episode of {n_episodes} episodes, 95 % intervals. Budget: the default of "
        "`--cost-limit`.",
    )


def list_limits(metrics: Metrics) -> dict[str, Metric]:
    """Return the budget of each task, as a metric without an interval."""
    del metrics
    return {
        f"{task}.budget": make_exact(limit, "control steps") for task, limit in COST_LIMITS.items()
    }
