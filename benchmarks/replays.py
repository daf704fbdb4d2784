"""How the parts of each study are asked for again, with the settings of its command.

A replay plays a study as it is, and gives it a cache (`benchmarks.verify.ReplayCache`) that makes
the parts that were drawn and hands out an empty one for each of the others. So nothing here looks
into a part. Whatever wants a policy that a training made takes the one that is kept in the
study's folder, and leaves out its parts where there is none.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.defaults import MADE
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.runner import Study
from hrc_env.experiments.versions import key_of

Walk = Callable[["Replayed"], None]


@dataclass(frozen=True, slots=True)
class Replayed:
    """What a replay is given."""

    cache: PartCache
    out: Path
    """The study's folder, where policies may be."""
    notes: Mapping[str, Mapping[str, float]]
    """Notes of the parts that were drawn, by label."""


@dataclass(frozen=True, slots=True)
class Replay:
    """How a study is replayed, and which of its parts cannot be."""

    walk: Walk
    """Asks the cache for every part."""
    timed: tuple[str, ...] = ()
    """Beginnings of the labels of parts that hold times of a clock."""
    trainings: tuple[str, ...] = ()
    """Labels of parts that are trainings; one that ends with a point stands for all that follow."""
    learnt: tuple[str, ...] = ()
    """Words in the labels of parts that want something that a training keeps."""
    row_words: int = 1
    """How many words at the beginning of a label name its row."""

    def is_training(self, label: str) -> bool:
        """Return whether a part is a training."""
        return label in self.trainings or label.startswith(
            tuple(each for each in self.trainings if each.endswith("."))
        )

    def is_repeatable(self, label: str) -> bool:
        """Return whether another run of a part gives the same: no training, no times."""
        return not (self.is_training(label) or label.startswith(self.timed))

    def is_learnt(self, label: str) -> bool:
        """Return whether a part wants something that a training keeps."""
        return any(word in label for word in self.learnt)


def walk_study(study: Study[Any, Any], config: Any, given: Replayed) -> None:
    """Play a study with the cache of a replay."""
    key = key_of({"experiment": study.name, **study.settings(config)}, study.depends)
    study.play(config, replace(given.cache, key=key, n_parts=study.n_parts(config)))


def walk_usual(command: str, given: Replayed) -> None:
    """Play a study as its command does, with the cache of a replay."""
    walk_study(*MADE[command](), given)


def _impact(given: Replayed) -> None:
    from hrc_env.experiments.impact.policies import PPO

    study, config = MADE["impact"]()
    if not all((given.cache.folder / f"{PPO}.{kind}").exists() for kind in ("zip", "json")):
        kept = tuple(name for name in config.policies if name != PPO)
        config = replace(config, policies=kept)
    walk_study(study, config, given)


def _price(command: str, given: Replayed) -> None:
    from hrc_env.experiments.price.experiment import replay

    margins_m = {label: notes["margin_m"] for label, notes in given.notes.items()}
    replay(MADE[command]()[1], given.cache, margins_m)


def _experts(given: Replayed) -> None:
    from benchmarks import experts

    arguments = experts.Arguments(out=given.out)
    cache = replace(given.cache, key=experts.key(arguments), n_parts=len(experts.ROWS))
    for task, way in experts.ROWS:
        experts.played(cache, arguments, task, way)


def _shielded(given: Replayed) -> None:
    from benchmarks import shielded

    arguments = shielded.Arguments(out=given.out)
    cache = replace(given.cache, key=shielded.key(arguments))
    for name, row in shielded.ROWS.items():
        shielded.episodes_of(name, row, cache, arguments)


def _baselines(given: Replayed) -> None:
    from benchmarks import baselines

    arguments = baselines.Arguments(out=given.out)
    cache = replace(given.cache, key=baselines.key(arguments))
    for level in baselines.ORDER:
        for agent in baselines.ROWS:
            is_learnt = agent in baselines.PPO
            policy = baselines.policy_of(arguments, level, agent) if is_learnt else None
            if policy is None or policy.exists():
                baselines.played(cache, arguments, level, agent, policy)


def _learners(given: Replayed) -> None:
    from benchmarks import learners

    arguments = learners.Arguments(out=given.out)
    cache = replace(given.cache, key=learners.key(arguments))
    for task in arguments.ids:
        learners.played(cache, arguments, task)
        for seed in arguments.seeds:
            policy = learners.folder_of(arguments, task, seed) / "policy.zip"
            if policy.exists():
                learners.played(cache, arguments, task, policy)


def _limited(given: Replayed) -> None:
    from benchmarks import limited

    arguments = limited.Arguments(out=given.out)
    cache = replace(given.cache, key=limited.key(arguments))
    for seed in arguments.seeds:
        for row, name, shield in limited.rows(arguments, seed):
            folder = limited.folder_of(arguments, name, seed)
            if (folder / "policy.zip").exists():
                limited.played(cache, arguments, row, folder, shield)


def _kept(given: Replayed) -> None:
    from benchmarks import kept

    arguments = kept.Arguments(out=given.out)
    cache = replace(given.cache, key=kept.key(arguments))
    for row in kept.rows():
        kept.played(cache, arguments, row)


def _facing(given: Replayed) -> None:
    from benchmarks import facing

    arguments = facing.Arguments(out=given.out)
    facing.played(replace(given.cache, key=facing.key(arguments)), arguments)


def _trueness(given: Replayed) -> None:
    from assets.emulator import holdout
    from hrc_env.config import HRCConfig
    from hrc_env.perception.emulator import EmulatorConfig

    path = holdout.calibration_of(given.out, holdout.ROUNDS)
    if path.exists():
        emulator = EmulatorConfig(calibration=str(path))
        config = replace(HRCConfig(), emulator=emulator)
        holdout.judged(given.cache, config, holdout.ROUNDS, None)


REPLAYS: dict[str, Replay] = {
    "footage": Replay(partial(walk_usual, "footage")),
    "facing": Replay(_facing),
    "site": Replay(partial(walk_usual, "site")),
    "lab": Replay(partial(walk_usual, "lab")),
    "tracking": Replay(partial(walk_usual, "tracking"), timed=("timing.",)),
    "perception": Replay(partial(walk_usual, "perception"), timed=("speed.", "network.")),
    "trueness": Replay(_trueness, learnt=("",)),
    "baselines": Replay(_baselines, learnt=(".ppo",)),
    "experts": Replay(_experts),
    "learners": Replay(_learners, learnt=(".policy.",)),
    "shielded": Replay(_shielded),
    "limited": Replay(_limited, learnt=("",)),
    "kept": Replay(_kept, row_words=3),
    "ablations": Replay(partial(walk_usual, "ablations")),
    "impact": Replay(_impact, trainings=("ppo",), learnt=("ppo",)),
    "price": Replay(partial(_price, "price"), row_words=2),
    "frontier": Replay(partial(_price, "frontier"), trainings=("training.",), row_words=2),
}
"""By command of a study; one that is not here keeps no parts."""


def row_of(name: str, label: str) -> str:
    """Return the row of a study's part: the first words of its label."""
    n_words = REPLAYS[name].row_words if name in REPLAYS else 1
    return ".".join(label.split(".")[:n_words])
