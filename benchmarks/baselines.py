"""Scores of simple agents and PPO at every perception level.

    python -m benchmarks.baselines

Random actions, the scripted reaching agent without and with slowing down near people, and PPO
without and with the safety term are compared on the same seeds: return, goals per minute, cost and
contacts. PPO is trained at the level of its evaluation. At `pixels`, which is too slow for
training, the policy of `keypoints` is evaluated. The reward of all evaluations is the default one,
which includes the safety term.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import NamedTuple

import torch
import tyro

from benchmarks.command import StudyArguments, run_study
from benchmarks.learning import Training
from hrc_env.agents.registry import AGENTS
from hrc_env.cli.checks import check_at_least
from hrc_env.cli.entry import show_errors
from hrc_env.evaluation.episodes import EVALUATION_SEED
from hrc_env.evaluation.sums import ACHIEVED
from hrc_env.experiments.columns import mean, per_minute, rate, share_above_force_limit
from hrc_env.experiments.report import Conditions, Table, format_seeds
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.study import Row, Study
from hrc_env.experiments.versions import make_key

TRAINED_ON = ("env", "tracker", "emulator", "motion", "agents")
"""Names of the subsystems on which trained policies depend."""
LEVELS = ("truth", "keypoints", "none", "pixels")
"""Perception levels of the evaluations."""
NOTE = """\
Means over {n[truth.random.return]} episodes of 10 s ({n[pixels.random.return]} at `pixels`). Cost \
per episode and contacts per hour are computed from the truth; the return depends on the robot's \
belief, so compare it within one perception level only. 95 % intervals are exact for contacts and \
bootstraps over episodes otherwise. PPO: one trained policy per row."""
PER_HOUR = 360
"""Factor from contacts in an episode of 10 s to contacts per hour."""
COLUMNS = (
    mean("r", "return", "return"),
    per_minute(ACHIEVED, "goals [1/min]", "goals_per_minute"),
    mean("cost", "cost", "cost_per_episode", digits=2),
    rate("contacts", "contacts [1/h]", "contacts_per_episode", digits=0, scale=PER_HOUR),
    share_above_force_limit(),
)


class Variant(NamedTuple):
    """A variant of PPO, with or without the safety term."""

    words: str
    """Description of the variant in tables."""
    weight: float
    """Weight of the safety term during training."""


PPO = {
    "ppo": Variant("PPO without the safety term", 0.0),
    "ppo_safety": Variant("PPO with the safety term", 2.0),
}
"""Variants of PPO, by name."""
AGENTS_SHOWN = {
    **{name: f"`{name}`" for name in AGENTS},
    **{name: variant.words for name, variant in PPO.items()},
}
"""Descriptions of agents in tables, by name."""


@dataclass(frozen=True)
class BaselinesArguments(StudyArguments):
    """Evaluate the baselines; with --quick, policies are trained for a few thousand steps only."""

    out: Path = Path("out/baselines")
    """Folder for results.json, a report, policies and cached results of completed parts."""
    timesteps: int = 500_000
    """Number of environment steps of each training run (quick: 4096)."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a number is invalid."""
        super().__post_init__()
        check_at_least("--timesteps", self.timesteps, 1)


def make_trainings(
    arguments: BaselinesArguments, levels: tuple[str, ...] = LEVELS
) -> dict[tuple[str, str], Training]:
    """Return the training run of each perception level and variant of PPO.

    At `none`, all workers are unknown and the safety term does not depend on the actions; both
    variants therefore share a policy.
    """
    timesteps, trainings = 4096 if arguments.quick else arguments.timesteps, {}
    key = make_key({"timesteps": timesteps}, TRAINED_ON)
    for level, (name, variant) in product(levels, PPO.items()):
        on = "keypoints" if level == "pixels" else level
        weight = 0.0 if level == "none" else variant.weight
        options = {"timesteps": timesteps, "perception": on, "proximity": weight}
        if arguments.threads is not None:
            options["threads"] = arguments.threads
        folder = arguments.out / "policies" / f"{on}-{weight:g}-{key}"
        trainings[level, name] = Training(folder, options)
    return trainings


def make_study(trainings: Mapping[tuple[str, str], Training]) -> Study:
    """Return the study of all agents and existing policies at all perception levels."""
    levels = dict.fromkeys(level for level, _ in trainings)
    shown = {
        f"{level}.{agent}": (f"`{level}`", words)
        for level in levels
        for agent, words in AGENTS_SHOWN.items()
    }
    rows = {}
    for name, words in shown.items():
        level, agent = name.split(".")
        player = agent if agent in AGENTS else str(trainings[level, agent].policy)
        if agent in AGENTS or Path(player).exists():
            n_episodes = 5 if level == "pixels" else 128
            rows[name] = Row(words, n_episodes, player, PerceptionSetup(level))
    return Study(
        name="baselines",
        title="Baselines",
        about=(__doc__ or "").strip(),
        depends=("env", "tracker", "emulator", "detector", "motion", "agents"),
        first_seed=EVALUATION_SEED,
        rows=rows,
        columns=COLUMNS,
        tables=(
            Table("baselines", "Baselines", shown, COLUMNS, ("perception", "agent"), NOTE,
                  trained=[name for name in shown if name.split(".")[1] in PPO]),
        ),
        conditions=Conditions(
            people="`attentive`", scene="`lab`", perception="in the rows", worker="worker_1",
            chosen_on="policies were trained on seed 0",
            seeds=format_seeds(range(EVALUATION_SEED, EVALUATION_SEED + 128)),
        ),
        n_quick=8,
    )  # fmt: skip


def make_default(out: Path) -> Study:
    """Return the study with default arguments and the policies in the folder `out`."""
    return make_study(make_trainings(BaselinesArguments(out)))


def main() -> int:
    """Train and evaluate the policies, print the report, and return the exit status."""
    arguments = tyro.cli(BaselinesArguments, description=__doc__)
    torch.set_num_threads(1)  # two threads are slower for such small networks
    trainings = make_trainings(arguments)
    for training in trainings.values():
        training.run()
    return run_study(make_study(trainings), arguments)


if __name__ == "__main__":
    sys.exit(show_errors(main))
