"""Learning with a limit, or fast and then under a shield: python -m benchmarks.limited

For each seed PPO-Lagrangian learns with a limit of cost, and PPO without any care. Of the first
the table shows when it reached its limit and how well it stayed there: the cost of its noisy
actions, on the truth, over windows of 250,000 steps, which are 1,000 episodes. Both are judged on
the same fixed seeds, the second also under a shield.
"""

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
import tyro

from benchmarks.command import StudyArguments, run_study
from benchmarks.common import exactly
from benchmarks.learning import Training
from hrc_env.agents.callbacks import Curve
from hrc_env.cli.entry import show_errors
from hrc_env.core.results import Metric, over
from hrc_env.evaluation.episodes import EVALUATION_SEED
from hrc_env.evaluation.sums import ACHIEVED, COST_UNIT
from hrc_env.experiments.columns import Column, mean, per_minute, rate
from hrc_env.experiments.report import Metrics, Table
from hrc_env.experiments.study import Row, Study
from hrc_env.experiments.versions import make_key

TRAINED_ON = ("env", "tracker", "emulator", "motion", "agents")
"""Subsystems that policies depend on."""
WINDOW_STEPS, N_WINDOWS = 250_000, 2
"""Length of a window, and how many of the last ones count."""
REACHED = 1.1
"""Times the limit: below that it is reached."""
WORDS = {
    "limited": ("PPO-Lagrangian, limit 30", None),
    "fast": ("PPO without care, then `qp`", "qp"),
    "bare": ("the same without a shield", None),
}
"""Rows of a seed: words, and the shield under which its policy is judged."""
TITLE = "A limit, or a shield"
Trainings = Mapping[tuple[str, int], Training]
"""By learner and seed."""


@dataclass(frozen=True)
class LimitedArguments(StudyArguments):
    """Learn with a limit on several seeds; with --quick for some thousand steps."""

    out: Path = Path("out/limited")
    """Folder for the runs, results.json and the report."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of environments and learner."""
    cost_limit: float = 30.0
    """Of an episode."""
    timesteps: int = 3_000_000
    """Of who learns with the limit; 8192 if quick."""
    fast_timesteps: int = 1_000_000
    """Of who learns without care; 8192 if quick."""


def trainings_of(arguments: LimitedArguments) -> Trainings:
    """Return the trainings of both learners."""
    limit, found = arguments.cost_limit, {}
    for seed in arguments.seeds:
        for name, timesteps, options in (
            ("limited", arguments.timesteps, {"algorithm": "ppo_lagrangian", "cost-limit": limit}),
            ("fast", arguments.fast_timesteps, {"proximity": 0}),
        ):
            timesteps = 8192 if arguments.quick else timesteps
            made_of = {"timesteps": timesteps, "cost_limit": options.get("cost-limit")}
            folder = arguments.out / f"{name}-{seed}-{make_key(made_of, TRAINED_ON)}"
            given = {**options, "seed": seed, "timesteps": timesteps}
            found[name, seed] = Training(folder, given)
    return found


def make_study(trainings: Trainings, limit: float) -> Study:
    """Return the study of the policies that have learnt."""
    rows, shown = dict[str, Row](), dict[str, tuple[str, ...]]()
    seeds = list(dict.fromkeys(seed for _, seed in trainings))
    for learner, (words, shield) in WORDS.items():
        for seed in seeds:
            policy = trainings["limited" if learner == "limited" else "fast", seed].policy
            name, cells = name_row(learner, seed), (words, str(seed))
            shown[name] = cells
            if policy.exists():
                rows[name] = Row(cells, 1000, str(policy), env={"shield": shield})
    return Study(
        name="limited",
        title=TITLE,
        about=(__doc__ or "").strip(),
        depends=("env", "tracker", "emulator", "motion", "shield", "agents"),
        first_seed=EVALUATION_SEED,
        rows=rows,
        columns=MEASURED,
        tables=(Table("limited", TITLE, shown, COLUMNS, ("learner", "seed"), NOTE),),
        derive=partial(judge_limits, trainings=trainings, limit=limit),
        n_quick=2,
    )


def name_row(learner: str, seed: int) -> str:
    """Return the name of a row in results.json."""
    if learner == "limited":
        return f"limited_{seed}"
    return f"fast_{seed}.{'qp' if learner == 'fast' else 'none'}"


def judge_limits(metrics: Metrics, trainings: Trainings, limit: float) -> dict[str, Metric]:
    """Return how every learner with a limit kept it, from its curve."""
    del metrics
    return {
        f"limited_{seed}.{name}": metric
        for (learner, seed), training in trainings.items()
        if learner == "limited"
        for name, metric in judge_curve(
            json.loads((training.folder / "curve.json").read_text()), limit
        ).items()
    }


def judge_curve(curve: Curve, limit: float, n_windows: int = N_WINDOWS) -> dict[str, Metric]:
    """Return how a limit was kept.

    Args:
        curve: points of a training.
        limit: of the cost of an episode.
        n_windows: how many of the last windows count.

    Returns:
        When the smoothed cost first was near the whole limit (infinite: never), the mean cost of
        the last windows, and how far from the limit the furthest of them is, as a share of it.
    """
    whole = (each for each in curve if each["safety_share"] == 1)
    reached = next((each["steps"] for each in whole if each["cost"] <= REACHED * limit), np.inf)
    steps = np.array([each["steps"] for each in curve])
    age = (steps[-1] - steps) // WINDOW_STEPS
    last = [[each for each, k in zip(curve, age, strict=True) if k == w] for w in range(n_windows)]
    costs = [float(np.mean([each["cost"] for each in window])) for window in last if window]
    goals = [each["goals_per_minute"] for window in last for each in window]
    furthest = max(abs(cost / limit - 1) for cost in costs)
    return {
        "learning.reached_at_steps": exactly(reached, "1"),
        "learning.cost": over(costs, COST_UNIT),
        "learning.furthest": exactly(furthest, "share", len(costs)),
        "learning.goals_per_minute": exactly(float(np.mean(goals)), "1/min"),
    }


def make_usual(out: Path) -> Study:
    """Return the study as the command makes it, with the policies that are in a folder."""
    arguments = LimitedArguments(out)
    return make_study(trainings_of(arguments), arguments.cost_limit)


def main() -> int:
    """Learn, judge, show."""
    arguments = tyro.cli(LimitedArguments, description=__doc__)
    torch.set_num_threads(1)
    trainings = trainings_of(arguments)
    for training in trainings.values():
        training.run()
    return run_study(make_study(trainings, arguments.cost_limit), arguments)


NOTE = (
    "HRCReach-v0 at `keypoints`; mean actions, 1,000 episodes, with 95 % intervals, of contacts "
    "exact ones. While learning: noisy actions, the last two windows of 1,000 episodes, and how "
    "far the furthest of them is from the limit. "
)
MEASURED = (
    per_minute(ACHIEVED, "goals [1/min]", "goals_per_minute"),
    mean("cost", "cost", "cost_per_episode"),
    rate("contacts_towards", "contacts towards [in 1,000]", "towards", "1000 episodes"),
    mean("r", name="return"),
    rate("contacts", name="contacts_per_episode"),
)
COLUMNS: tuple[Any, ...] = (
    *(column for column in MEASURED if column.heading),
    Column("{}.learning.cost", "cost while learning"),
    Column("{}.learning.reached_at_steps", "limit reached after [steps]", 0, plain=True),
    Column("{}.learning.furthest", "furthest from it [%]", 0, 100, plain=True),
)

if __name__ == "__main__":
    sys.exit(show_errors(main))
