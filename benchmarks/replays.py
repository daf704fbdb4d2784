"""How the parts of each study are asked for again, with the settings of its command.

A replay plays an experiment as it is, and gives it a cache (`benchmarks.verify.ReplayCache`) that
makes the parts that were drawn and hands out an empty one for each of the others. So nothing here
looks into a part. Whatever wants a policy that a training made takes the one that is kept in the
study's folder, and leaves out its parts where there is none.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.studies import COMMANDS
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.runner import Experiment, make_cache


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

    walk: Callable[[Replayed], None]
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


def walk(experiment: Experiment[Any], given: Replayed) -> None:
    """Play an experiment with the cache of a replay."""
    usual = make_cache(experiment, given.cache.folder, given.cache.progress)
    experiment.play(replace(given.cache, key=usual.key, n_parts=usual.n_parts))


def walk_command(command: str, given: Replayed) -> None:
    """Play an experiment as its command does, with the cache of a replay."""
    walk(_made(command, given), given)


def _made(command: str, given: Replayed) -> Any:
    made = COMMANDS[command].made
    if made is None:
        raise AssertionError(f"{command} is no experiment, and is not replayed")
    return made.make(given.out)


def _impact(given: Replayed) -> None:
    from hrc_env.experiments.impact.policies import PPO

    impact = _made("impact", given)
    if not all((given.cache.folder / f"{PPO}.{kind}").exists() for kind in ("zip", "json")):
        impact = replace(impact, policies=tuple(name for name in impact.policies if name != PPO))
    walk(impact, given)


def _price(command: str, given: Replayed) -> None:
    from hrc_env.experiments.price.experiment import replay

    margins_m = {label: notes["margin_m"] for label, notes in given.notes.items()}
    replay(_made(command, given), given.cache, margins_m)


def _trueness(given: Replayed) -> None:
    from assets.emulator import holdout
    from hrc_env.config import HRCConfig
    from hrc_env.perception.emulator import EmulatorConfig

    path = holdout.calibration_of(given.out, holdout.ROUNDS)
    if path.exists():
        emulator = EmulatorConfig(calibration=str(path))
        config = replace(HRCConfig(), emulator=emulator)
        holdout.judged(given.cache, config, holdout.ROUNDS, None)


def _usual(command: str, **known: Any) -> Replay:
    return Replay(partial(walk_command, command), **known)


REPLAYS: dict[str, Replay] = {
    **{name: _usual(name) for name in ("footage", "facing", "site", "lab", "shielded")},
    "ablations": _usual("ablations"),
    "tracking": _usual("tracking", timed=("timing.",)),
    "perception": _usual("perception", timed=("speed.", "network.")),
    "trueness": Replay(_trueness, learnt=("",)),
    "baselines": _usual("baselines", learnt=(".ppo",)),
    "experts": _usual("experts"),
    "learners": _usual("learners", learnt=(".policy_",)),
    "limited": _usual("limited", learnt=("",)),
    "kept": _usual("kept", row_words=3),
    "impact": Replay(_impact, trainings=("ppo",), learnt=("ppo",)),
    "price": Replay(partial(_price, "price"), row_words=2),
    "frontier": Replay(partial(_price, "frontier"), row_words=2),
}
"""By command of a study; one that is not here keeps no parts."""


def row_of(name: str, label: str) -> str:
    """Return the row of a study's part: the first words of its label."""
    n_words = REPLAYS[name].row_words if name in REPLAYS else 1
    return ".".join(label.split(".")[:n_words])
