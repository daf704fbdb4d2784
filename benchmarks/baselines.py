"""What simple agents and PPO are worth at every perception level: python -m benchmarks.baselines

Random actions, the scripted reacher without and with yielding, and PPO without and with the safety
term, by return, goals a minute, cost and contacts on the same seeds. PPO learns at the level that
it is judged at; at `pixels`, which is too slow for that, the policy of `keypoints` acts. Everybody
is judged by the default reward, safety term included.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import torch
import tyro

from benchmarks.command import StudyArguments, run_study
from benchmarks.learning import Training
from hrc_env.agents.registry import AGENTS
from hrc_env.cli.checks import check_at_least
from hrc_env.cli.entry import show_errors
from hrc_env.evaluation.episodes import EVALUATION_SEED
from hrc_env.evaluation.sums import ACHIEVED
from hrc_env.experiments.columns import mean, per_minute, rate
from hrc_env.experiments.report import Table
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.study import Row, Study
from hrc_env.experiments.versions import make_key

TRAINED_ON = ("env", "tracker", "emulator", "motion", "agents")
"""Subsystems that policies depend on."""
LEVELS = ("truth", "keypoints", "none", "pixels")
NOTE = """\
Means of {n[truth.random.return]} episodes of 10 s ({n[pixels.random.return]} at `pixels`, whose \
rows compare with each other only); intervals are 95 %, of contacts exact, else bootstraps over \
episodes. Return is what the robot is rewarded for, by its belief: compare it within a level only. \
Cost and contacts are counted on the truth. PPO: one policy each; at `none` whoever is there is \
unknown, the safety term is constant, and one policy stands in both rows."""
COLUMNS = (
    mean("r", "return", "return"),
    per_minute(ACHIEVED, "goals [1/min]", "goals_per_minute"),
    mean("cost", "cost", "cost_per_episode", digits=2),
    rate("contacts", "contacts", "contacts_per_episode", digits=2),
)
PPO = {"ppo": ("PPO without the safety term", 0.0), "ppo_safety": ("PPO with it", 2.0)}
"""Policies: words, and the weight of the safety term in what each learns from."""
AGENTS_SHOWN = {**{name: f"`{name}`" for name in AGENTS}, **{k: w for k, (w, _) in PPO.items()}}


@dataclass(frozen=True)
class BaselinesArguments(StudyArguments):
    """Judge the baselines; with --quick policies have hardly learnt."""

    out: Path = Path("out/baselines")
    """Folder for results.json, a report, policies and finished parts."""
    timesteps: int = 500_000
    """Environment steps that a policy learns; 4096 if quick."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for numbers that cannot work."""
        super().__post_init__()
        check_at_least("--timesteps", self.timesteps, 1)


def trainings_of(
    arguments: BaselinesArguments, levels: tuple[str, ...] = LEVELS
) -> dict[tuple[str, str], Training]:
    """Return the training of each level and policy.

    At `none` whoever is there is unknown: the safety term is the same whatever the robot does, and
    both policies are.
    """
    timesteps, found = 4096 if arguments.quick else arguments.timesteps, {}
    key = make_key({"timesteps": timesteps}, TRAINED_ON)
    for level, (name, (_, weight)) in product(levels, PPO.items()):
        on, weight = "keypoints" if level == "pixels" else level, 0.0 if level == "none" else weight
        options = {"timesteps": timesteps, "perception": on, "proximity": weight}
        if arguments.threads is not None:
            options["threads"] = arguments.threads
        folder = arguments.out / "policies" / f"{on}-{weight:g}-{key}"
        found[level, name] = Training(folder, options)
    return found


def make_study(trainings: Mapping[tuple[str, str], Training]) -> Study:
    """Return the study of agents at all levels, and of the policies that have learnt."""
    levels = dict.fromkeys(level for level, _ in trainings)
    shown = {
        f"{level}.{agent}": (f"`{level}`", words)
        for level in levels
        for agent, words in AGENTS_SHOWN.items()
    }
    rows = {}
    for name, words in shown.items():
        level, agent = name.split(".")
        who = agent if agent in AGENTS else str(trainings[level, agent].policy)
        if agent in AGENTS or Path(who).exists():
            n_episodes = 5 if level == "pixels" else 128
            rows[name] = Row(words, n_episodes, who, PerceptionSetup(level))
    return Study(
        name="baselines",
        title="Baselines",
        about=(__doc__ or "").strip(),
        depends=("env", "tracker", "emulator", "detector", "motion", "agents"),
        first_seed=EVALUATION_SEED,
        rows=rows,
        columns=COLUMNS,
        tables=(Table("baselines", "Baselines", shown, COLUMNS, ("perception", "agent"), NOTE),),
        n_quick=8,
    )


def make_usual(out: Path) -> Study:
    """Return the study as the command makes it, with the policies that are in a folder."""
    return make_study(trainings_of(BaselinesArguments(out)))


def main() -> int:
    """Learn, judge, show."""
    arguments = tyro.cli(BaselinesArguments, description=__doc__)
    torch.set_num_threads(1)  # two are slower in networks as small as these
    trainings = trainings_of(arguments)
    for training in trainings.values():
        training.run()
    return run_study(make_study(trainings), arguments)


if __name__ == "__main__":
    sys.exit(show_errors(main))
