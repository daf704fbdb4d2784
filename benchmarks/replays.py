"""Replays of the parts of each study, with the settings of its command.

A replay runs an unchanged experiment with a special cache (`benchmarks.verify.ReplayCache`), which
computes the sampled parts again and returns an empty result for all others. This module does not
depend on the content of parts. Replays that need a trained policy use the one in the study's
folder; if there is none, the parts that need it are skipped.
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
class ReplayInput:
    """Input of a replay."""

    cache: PartCache
    """Cache from which the experiment requests its parts."""
    out: Path
    """Folder of the study, which may contain trained policies."""
    notes: Mapping[str, Mapping[str, float]]
    """Recorded notes of the sampled parts, by label."""


@dataclass(frozen=True, slots=True)
class Replay:
    """Function that replays a study, and labels of parts that need special treatment."""

    walk: Callable[[ReplayInput], None]
    """Function that requests all parts of the study from the cache."""
    timed: tuple[str, ...] = ()
    """Prefixes of labels of parts that contain measured times."""
    trainings: tuple[str, ...] = ()
    """Labels of parts that are training runs; a label that ends with a dot is a prefix."""
    learnt: tuple[str, ...] = ()
    """Substrings of the labels of parts that need a file of a training run."""
    row_words: int = 1
    """Number of dot-separated words at the beginning of a label that identify its row."""

    def is_training(self, label: str) -> bool:
        """Return whether a part is a training run."""
        return label in self.trainings or label.startswith(
            tuple(name for name in self.trainings if name.endswith("."))
        )

    def is_repeatable(self, label: str) -> bool:
        """Return whether a part is reproducible: neither a training run nor measured times."""
        return not (self.is_training(label) or label.startswith(self.timed))

    def is_learnt(self, label: str) -> bool:
        """Return whether a part needs a file of a training run."""
        return any(word in label for word in self.learnt)


def walk(experiment: Experiment[Any], given: ReplayInput) -> None:
    """Run an experiment with the cache of a replay."""
    usual = make_cache(experiment, given.cache.folder, given.cache.progress)
    experiment.play(replace(given.cache, key=usual.key, n_parts=usual.n_parts))


def walk_command(command: str, given: ReplayInput) -> None:
    """Run the experiment of a command with the cache of a replay."""
    walk(_make_experiment(command, given), given)


def _make_experiment(command: str, given: ReplayInput) -> Any:
    made = COMMANDS[command].made
    if made is None:
        raise AssertionError(f"{command} is not an experiment, and cannot be replayed")
    return made.make(given.out)


def _replay_impact(given: ReplayInput) -> None:
    from hrc_env.experiments.impact.policies import PPO

    impact = _make_experiment("impact", given)
    if not all((given.cache.folder / f"{PPO}.{kind}").exists() for kind in ("zip", "json")):
        impact = replace(impact, policies=tuple(name for name in impact.policies if name != PPO))
    walk(impact, given)


def _replay_price(given: ReplayInput) -> None:
    from hrc_env.experiments.price.experiment import replay

    replay(_make_experiment("price", given), given.cache, given.notes)


def _replay_trueness(given: ReplayInput) -> None:
    from assets.emulator import holdout
    from hrc_env.config import HRCConfig
    from hrc_env.perception.emulator import EmulatorConfig

    path = holdout.find_calibration(given.out, holdout.ROUNDS)
    if path.exists():
        emulator = EmulatorConfig(calibration=str(path))
        config = replace(HRCConfig(), emulator=emulator)
        holdout.judged(given.cache, config, holdout.ROUNDS, None)


def _replay_command(command: str, **known: Any) -> Replay:
    return Replay(partial(walk_command, command), **known)


REPLAYS: dict[str, Replay] = {
    **{name: _replay_command(name) for name in ("footage", "facing", "site", "lab", "shielded")},
    "ablations": _replay_command("ablations"),
    "tracking": _replay_command("tracking", timed=("timing.",)),
    "perception": _replay_command("perception", timed=("speed.", "network.")),
    "trueness": Replay(_replay_trueness, learnt=("",)),
    "baselines": _replay_command("baselines", learnt=(".ppo",)),
    "experts": _replay_command("experts"),
    "learners": _replay_command("learners", learnt=(".policy_",)),
    "limited": _replay_command("limited", learnt=("",)),
    "under_shield": _replay_command("under_shield", learnt=("",)),
    "kept": _replay_command("kept", row_words=3),
    "budgets": _replay_command("budgets", row_words=2),
    "ranks": _replay_command("ranks"),
    "rare": _replay_command("rare"),
    "adversary": _replay_command("adversary", row_words=2),
    "impact": Replay(_replay_impact, trainings=("ppo",), learnt=("ppo",)),
    "price": Replay(_replay_price, row_words=2),
}
"""Replays by the name of the command; commands without parts have none."""


def find_row(name: str, label: str) -> str:
    """Return the name of the row of a part, which consists of the first words of its label."""
    n_words = REPLAYS[name].row_words if name in REPLAYS else 1
    return ".".join(label.split(".")[:n_words])
