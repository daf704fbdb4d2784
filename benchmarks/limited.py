"""Comparison of training with a cost limit and evaluation with a shield.

    python -m benchmarks.limited

For each seed, PPO-Lagrangian is trained with a cost limit, and PPO without any safety term. For
PPO-Lagrangian, the table shows when the limit was reached and how closely it was kept, based on the
true cost of the mean actions in separate episodes, in windows of 250,000 steps. Both policies are
evaluated on the same fixed seeds; the policy of PPO is also evaluated with a shield. Learners are
compared by the interquartile mean over all seeds with its stratified bootstrap interval.
"""

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
import tyro

from benchmarks.command import StudyArguments, run_study
from benchmarks.common import make_exact
from benchmarks.learning import SAFETY_OF_POLICY, Training, summarize_runs
from hrc_env.agents.callbacks import Curve
from hrc_env.agents.learner_settings import COST_LIMITS
from hrc_env.cli.entry import show_errors
from hrc_env.core.results import Metric, over
from hrc_env.evaluation.episodes import EVALUATION_SEED
from hrc_env.evaluation.intervals import MIN_RUNS
from hrc_env.evaluation.sums import COST_UNIT
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import SHIELD_CHOSEN_ON, Conditions, Metrics, Table, format_seeds
from hrc_env.experiments.stage import WORKER
from hrc_env.experiments.study import Row, Study
from hrc_env.experiments.versions import make_key
from hrc_env.tasks import DEFAULT

TRAINED_ON = ("env", "tracker", "emulator", "motion", "agents")
"""Names of the subsystems on which trained policies depend."""
WINDOW_STEPS, N_WINDOWS = 250_000, 2
"""Length of a window of the learning curve [environment steps], and number of windows at its end
that are evaluated.
"""
REACHED = 1.1
"""Multiple of the cost limit at which the limit counts as reached."""


class Variant(NamedTuple):
    """A variant of training and evaluation, which has one row per seed."""

    words: str
    """Description of the variant in tables."""
    shield: str | None
    """Name of the shield in the evaluation, or None."""


WORDS = {
    "limited": Variant("PPO-Lagrangian", None),
    "fast": Variant("PPO without a safety term, evaluated with `qp`", "qp"),
    "bare": Variant("the same policies, evaluated without a shield", None),
}
"""Variants of training and evaluation, by name."""
TITLE = "Cost limit or shield"
Trainings = Mapping[tuple[str, int], Training]
"""Training runs by learner and seed."""


@dataclass(frozen=True)
class LimitedArguments(StudyArguments):
    """Train with a cost limit on several seeds; with --quick, for a few thousand steps only."""

    out: Path = Path("out/limited")
    """Folder for the runs, results.json and the report."""
    seeds: tuple[int, ...] = (0, 1, 2, 3, 4)
    """Seeds of environments and learner."""
    cost_limit: float = COST_LIMITS[DEFAULT]
    """Maximum mean cost of an episode."""
    timesteps: int = 3_000_000
    """Number of environment steps of a training run with the cost limit (quick: 8192)."""
    fast_timesteps: int = 1_000_000
    """Number of environment steps of a training run without a cost limit (quick: 8192)."""


def make_trainings(arguments: LimitedArguments) -> Trainings:
    """Return the training runs of both learners for each seed."""
    limit, trainings = arguments.cost_limit, {}
    for seed in arguments.seeds:
        for name, timesteps, options in (
            ("limited", arguments.timesteps, {"algorithm": "ppo_lagrangian", "cost-limit": limit}),
            ("fast", arguments.fast_timesteps, {"proximity": 0}),
        ):
            timesteps = 8192 if arguments.quick else timesteps
            made_of = {"timesteps": timesteps, "cost_limit": options.get("cost-limit")}
            folder = arguments.out / f"{name}-{seed}-{make_key(made_of, TRAINED_ON)}"
            given = {**options, "seed": seed, "timesteps": timesteps}
            trainings[name, seed] = Training(folder, given)
    return trainings


def make_study(trainings: Trainings, limit: float) -> Study:
    """Return the study of the trained policies."""
    rows, shown = dict[str, Row](), dict[str, tuple[str, ...]]()
    of_learner = {learner: list[str]() for learner in WORDS}
    seeds = list(dict.fromkeys(seed for _, seed in trainings))
    for learner, (words, shield) in WORDS.items():
        shown[learner] = (words, "all")
        for seed in seeds:
            policy = trainings["limited" if learner == "limited" else "fast", seed].policy
            name, cells = name_row(learner, seed), (words, str(seed))
            shown[name] = cells
            if policy.exists():
                env = {"shield": shield, "config": {"worker": WORKER}}
                rows[name] = Row(cells, 1000, str(policy), env=env)
                of_learner[learner].append(name)
    return Study(
        name="limited",
        title=TITLE,
        about=(__doc__ or "").strip(),
        depends=("env", "tracker", "emulator", "motion", "shield", "agents"),
        first_seed=EVALUATION_SEED,
        rows=rows,
        columns=SAFETY_OF_POLICY,
        tables=(
            Table("limited", TITLE, shown, COLUMNS, ("learner", "seed"), NOTE, fewest=MIN_RUNS,
                  trained=[name for name in shown if name not in WORDS]),
        ),
        derive=partial(judge, rows=of_learner, trainings=trainings, limit=limit),
        conditions=Conditions(
            people="`attentive`", scene="`lab`", perception="`keypoints`",
            chosen_on=f"policies were trained on seeds {', '.join(map(str, seeds))}, with the body "
            f"`worker_1`; {SHIELD_CHOSEN_ON}",
            worker=WORKER,
            seeds=format_seeds(range(EVALUATION_SEED, EVALUATION_SEED + 1000)),
        ),
        n_quick=2,
    )  # fmt: skip


def name_row(learner: str, seed: int) -> str:
    """Return the name of the row of a variant and seed in results.json."""
    if learner == "limited":
        return f"limited_{seed}"
    return f"fast_{seed}.{'qp' if learner == 'fast' else 'none'}"


def judge(
    metrics: Metrics, rows: Mapping[str, list[str]], trainings: Trainings, limit: float
) -> dict[str, Metric]:
    """Summarize the policies of each learner, and judge how closely limits were kept."""
    return {**summarize_runs(metrics, rows), **judge_limits(trainings, limit)}


def judge_limits(trainings: Trainings, limit: float) -> dict[str, Metric]:
    """Compute from the learning curves how closely each PPO-Lagrangian run kept its limit."""
    return {
        f"limited_{seed}.{name}": metric
        for (learner, seed), training in trainings.items()
        if learner == "limited"
        for name, metric in judge_curve(
            json.loads((training.folder / "curve.json").read_text()), limit
        ).items()
    }


def judge_curve(curve: Curve, limit: float, n_windows: int = N_WINDOWS) -> dict[str, Metric]:
    """Compute how closely a training run kept its cost limit.

    Args:
        curve: learning curve of the run.
        limit: maximum mean cost of an episode.
        n_windows: number of windows at the end of the curve that are evaluated.

    Returns:
        Number of steps until the smoothed cost was first at most `REACHED` times the full limit
        (infinite if never), mean cost in the last windows, maximum relative deviation of a window's
        mean cost from the limit, and goals per minute in the last windows.
    """
    whole = (point for point in curve if point["safety_share"] == 1)
    near = (point["steps"] for point in whole if point["cost"] <= REACHED * limit)
    reached = next(near, np.inf)
    steps = np.array([point["steps"] for point in curve])
    age = (steps[-1] - steps) // WINDOW_STEPS
    last = [[p for p, k in zip(curve, age, strict=True) if k == w] for w in range(n_windows)]
    costs = [float(np.mean([point["cost"] for point in window])) for window in last if window]
    goals = [point["goals_per_minute"] for window in last for point in window]
    furthest = max(abs(cost / limit - 1) for cost in costs)
    return {
        "learning.reached_at_steps": make_exact(reached, "1"),
        "learning.cost": over(costs, COST_UNIT),
        "learning.furthest": make_exact(furthest, "share", len(costs)),
        "learning.goals_per_minute": make_exact(float(np.mean(goals)), "1/min"),
    }


def make_default(out: Path) -> Study:
    """Return the study with default arguments and the policies in the folder `out`."""
    arguments = LimitedArguments(out)
    return make_study(make_trainings(arguments), arguments.cost_limit)


def main() -> int:
    """Train and evaluate the policies, print the report, and return the exit status."""
    arguments = tyro.cli(LimitedArguments, description=__doc__)
    torch.set_num_threads(1)
    trainings = make_trainings(arguments)
    for training in trainings.values():
        training.run()
    return run_study(make_study(trainings, arguments.cost_limit), arguments)


NOTE = (
    "`HRCReach-v0`; 1,000 episodes of each policy with its mean actions. All seeds: interquartile "
    "mean of goals, cost and interventions per hour over the policies, with 95 % stratified "
    "bootstrap intervals from five seeds on; contacts towards and above the force limit of the "
    "touched body region of all policies together, with exact intervals. Cost in training: of "
    "mean actions, median of the last two windows of 250,000 steps. Greatest deviation: of one of "
    "these windows from the limit."
)
COLUMNS: tuple[Any, ...] = (
    *(column for column in SAFETY_OF_POLICY if column.heading),
    Column("{}.learning.cost", "cost in training", plain=True),
    Column("{}.learning.reached_at_steps", "limit reached after [steps]", 0, plain=True),
    Column("{}.learning.furthest", "greatest deviation [%]", 0, 100, plain=True),
)

if __name__ == "__main__":
    sys.exit(show_errors(main))
