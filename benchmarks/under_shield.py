"""Comparison of learners under a shield, before a shield, and with a cost limit.

    python -m benchmarks.under_shield

PPO is trained under a shield, with its changes of the command and forecasts of people in the
observation and a penalty on these changes: under `qp`, under `ssm` with the walking speed of ISO
13855, and under `sara`, which verifies that the robot can brake. Beside these, PPO is trained
without safety term and shield, and evaluated with and without `qp`, and PPO-Lagrangian is trained
with a cost limit. Every learner is trained with five seeds and the same number of steps, and all
policies are evaluated on the same seeds, which no training uses. CPO is not compared: FSRL, which
has it, is no dependency of this package (`examples/ppo_lagrangian_fsrl.py` shows its use).
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
from benchmarks.learning import SAFETY_OF_POLICY, Training, summarize_runs
from hrc_env.cli.checks import check_at_least
from hrc_env.cli.entry import show_errors
from hrc_env.core.errors import check_names
from hrc_env.core.vacancy import WALKING_M_S
from hrc_env.evaluation.intervals import MIN_RUNS
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import SHIELD_CHOSEN_ON, Conditions, Table, format_seeds
from hrc_env.experiments.stage import WORKER
from hrc_env.experiments.study import Row, Study
from hrc_env.experiments.versions import make_key

TRAINED_ON = ("env", "tracker", "emulator", "motion", "shield", "agents")
"""Names of the subsystems on which trained policies depend."""
FIRST_SEED = 18_600_000
"""Seed of the first episode of the evaluation."""
FORECAST_S = (0.2, 0.4)
"""Horizons of the observed forecasts of policies that are trained under a shield [s]."""
CHANGE_WEIGHT = 0.5
"""Weight of the penalty on changes of the command by the shield during training."""
STANDARD_SSM = {"kind": "ssm", "worker_speed_m_s": WALKING_M_S}
"""Speed and separation monitoring with the walking speed of ISO 13855."""
OBSERVED = {"observe_shield": True, "forecast_s": FORECAST_S}
"""Settings of the environment of policies that are trained under a shield."""


def _train_under(shield: str) -> dict[str, Any]:
    """Return the options of a training under a shield."""
    return {
        "shield": shield, "observe-shield": True, "forecast-s": FORECAST_S,
        "shield-change": CHANGE_WEIGHT, "proximity": 0,
    }  # fmt: skip


LEARNERS: dict[str, dict[str, Any]] = {
    "qp": _train_under("qp"),
    "bare": {"proximity": 0},
    "limited": {"algorithm": "ppo_lagrangian", "cost-limit": 30},
    "ssm": _train_under(f'{{"kind": "ssm", "worker_speed_m_s": {WALKING_M_S}}}'),
    "sara": _train_under("sara"),
}
"""Options of the training of each learner."""


@dataclass(frozen=True, slots=True)
class Arm:
    """Policies of a learner, evaluated with or without a shield."""

    words: str
    """Description in tables."""
    learner: str
    """Name of the learner in `LEARNERS`."""
    shield: Any = None
    """Shield of the evaluation."""

    @property
    def env(self) -> dict[str, Any]:
        """Arguments of the environment of the evaluation."""
        observed = OBSERVED if "observe-shield" in LEARNERS[self.learner] else {}
        return {"shield": self.shield, "config": {"worker": WORKER, **observed}}


ARMS = {
    "qp": Arm("PPO under `qp`", "qp", "qp"),
    "then_qp": Arm("PPO without a shield, evaluated with `qp`", "bare", "qp"),
    "limited": Arm("PPO-Lagrangian, limit 30", "limited"),
    "ssm": Arm("PPO under `ssm` at 1.6 m/s", "ssm", STANDARD_SSM),
    "sara": Arm("PPO under `sara`", "sara", "sara"),
    "bare": Arm("PPO without a shield", "bare"),
}
"""Arms of the comparison, by name."""
Trainings = Mapping[tuple[str, int], Training]
"""Training runs by learner and seed."""


@dataclass(frozen=True)
class UnderShieldArguments(StudyArguments):
    """Train each learner with several seeds; with --quick, for a few thousand steps only."""

    out: Path = Path("out/under_shield")
    """Folder for the runs, results.json, the report and cached results of completed parts."""
    learners: tuple[str, ...] = tuple(LEARNERS)
    """Learners to train and evaluate."""
    seeds: tuple[int, ...] = (0, 1, 2, 3, 4)
    """Seeds of environments and learner."""
    timesteps: int = 2_000_000
    """Number of environment steps of a training run (quick: 2048)."""
    episodes: int = 2000
    """Number of episodes of the evaluation of each policy."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for an unknown learner or an invalid number."""
        super().__post_init__()
        check_names("learner", self.learners, LEARNERS)
        check_at_least("--timesteps", self.timesteps, 1)
        check_at_least("--episodes", self.episodes, 1)


def make_trainings(arguments: UnderShieldArguments) -> Trainings:
    """Return the training runs of all learners."""
    more: dict[str, Any] = {"timesteps": arguments.timesteps, "config": f"worker={WORKER}"}
    if arguments.quick:
        more |= {"timesteps": 2048, "num-envs": 8}
    key = make_key({**more, "learners": LEARNERS}, TRAINED_ON)
    threads = {} if arguments.threads is None else {"threads": arguments.threads}
    return {
        (learner, seed): Training(
            arguments.out / "policies" / f"{learner}-{seed}-{key}",
            {**LEARNERS[learner], **more, **threads, "seed": seed},
        )
        for learner in arguments.learners
        for seed in arguments.seeds
    }


def make_study(trainings: Trainings, n_episodes: int = 2000) -> Study:
    """Return the study of the trained policies.

    Args:
        trainings: training runs by learner and seed.
        n_episodes: number of episodes of each policy.
    """
    shown = {
        f"{name}_{seed}": (arm.words, str(seed))
        for name, arm in ARMS.items()
        for learner, seed in trainings
        if learner == arm.learner
    }
    rows, of_arm = dict[str, Row](), {name: list[str]() for name in ARMS}
    for name, arm in ARMS.items():
        for (learner, seed), training in trainings.items():
            if learner == arm.learner and training.is_finished:
                row = f"{name}_{seed}"
                of_arm[name].append(row)
                rows[row] = Row(shown[row], n_episodes, str(training.policy), env=arm.env)
    seeds = ", ".join(dict.fromkeys(str(seed) for _, seed in trainings))
    return Study(
        name="under_shield",
        title=TITLE,
        about=(__doc__ or "").strip(),
        depends=TRAINED_ON,
        first_seed=FIRST_SEED,
        rows=rows,
        columns=SAFETY_OF_POLICY,
        tables=(
            Table("under_shield", TITLE, {name: (arm.words,) for name, arm in ARMS.items()},
                  COLUMNS, ("learner",), NOTE, fewest=MIN_RUNS),
            Table("under_shield_seeds", f"{TITLE}, by seed", shown, COLUMNS,
                  ("learner", "seed"), NOTE_ON_SEEDS, trained=tuple(shown)),
        ),
        derive=partial(summarize_runs, rows=of_arm),
        conditions=Conditions(
            people="`attentive`", scene="`lab`", perception="`keypoints`",
            chosen_on=f"policies were trained on seeds {seeds}; the weight of the penalty and the "
            f"horizons were tried in one training on seed 18,500,000; {SHIELD_CHOSEN_ON}",
            worker=WORKER, seeds=format_seeds(range(FIRST_SEED, FIRST_SEED + n_episodes)),
        ),
        n_quick=2,
    )  # fmt: skip


def make_default(out: Path) -> Study:
    """Return the study with default arguments and the policies in the folder `out`."""
    return make_study(make_trainings(UnderShieldArguments(out)))


def main() -> int:
    """Train and evaluate the policies, print the report, and return the exit status."""
    arguments = tyro.cli(UnderShieldArguments, description=__doc__)
    torch.set_num_threads(1)  # two threads are slower for such small networks
    trainings = make_trainings(arguments)
    for training in trainings.values():
        training.run()
    return run_study(make_study(trainings, arguments.episodes), arguments)


TITLE = "Learning under a shield"
NOTE = (
    "`HRCReach-v0`, mean actions. Goals, cost per episode and interventions per hour: "
    "interquartile mean over the policies of all seeds, with 95 % stratified bootstrap intervals "
    "from five seeds on. Contacts towards the worker and those above the force limit: of all "
    "policies together, with exact intervals."
)
NOTE_ON_SEEDS = "`HRCReach-v0`, mean actions, one policy in each row; exact intervals of counts."
COUNT = Column("{}.towards", "contacts towards [episodes]", shows="count", counted=True)
"""Number of contacts towards the worker, of the number of episodes."""
COLUMNS = (
    SAFETY_OF_POLICY[0],
    COUNT,
    *(column for column in SAFETY_OF_POLICY[1:] if column.heading),
)

if __name__ == "__main__":
    sys.exit(show_errors(main))
