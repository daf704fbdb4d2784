"""Ablations of rigs, detections and estimators: the experiment, setting by setting."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.results import Metric
from hrc_env.evaluation.counts import ERRORS_M
from hrc_env.evaluation.intervals import make_binned_quantile as make_quantile
from hrc_env.evaluation.intervals import estimate_binned_quantile as estimate_quantile
from hrc_env.evaluation.intervals import estimate_mean, compare_paired, estimate_rate, estimate_ratio, estimate_rmse
from hrc_env.experiments.ablations.ablation import Ablation, Setting
from hrc_env.experiments.ablations.declaration import ABLATIONS, shown
from hrc_env.experiments.ablations.play import Sums, play, walks_of
from hrc_env.experiments.ablations.report import report
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.report import Metrics, Report, Table, quick_words
from hrc_env.experiments.rigs import DT_S, WARM_UP_S
from hrc_env.experiments.runner import at_least_one, changed, is_as_short
from hrc_env.experiments.versions import key_of

Played = Mapping[str, Mapping[str, Sums]]
"""Sums by question and setting."""


@dataclass(frozen=True, slots=True)
class Ablations:
    """The experiment, and how much is played."""

    name = "ablations"
    depends = ("env", "tracker", "emulator", "motion")
    n_seeds: int = 30
    """Episodes of every setting."""
    first_seed: int = 2_000_000
    """Seed of the first episode; the others count up."""
    seconds: float = 10.0
    """How long each is, the warm-up included."""
    studies: tuple[str, ...] = tuple(ABLATIONS)
    """Which questions are asked."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot work."""
        at_least_one(self, "n_seeds")
        if not self.seconds > WARM_UP_S:
            raise ConfigError(
                f"Episodes must be longer than the warm-up of {WARM_UP_S:g} s, got {self.seconds}."
            )
        if not self.studies:
            raise ConfigError(f"--studies needs a name of {', '.join(ABLATIONS)}.")
        check_names("study", self.studies, ABLATIONS)

    @property
    def seeds(self) -> tuple[int, ...]:
        """One an episode."""
        return tuple(self.first_seed + k for k in range(self.n_seeds))

    @property
    def asked(self) -> tuple[Ablation, ...]:
        """The questions, in the order of the report."""
        return tuple(each for name, each in ABLATIONS.items() if name in self.studies)

    @property
    def n_parts(self) -> int:
        """Settings of all questions."""
        return sum(len(ablation.settings) for ablation in self.asked)

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a short run; "" if it is long enough."""
        is_short = is_as_short(self, QUICK)
        return quick_words(self.n_seeds, self.seconds) if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return what all numbers depend on; which questions are asked changes none of them."""
        return {name: value for name, value in asdict(self).items() if name != "studies"}

    def play(self, cache: PartCache) -> Played:
        """Return every setting's sums; those that share walks are played one after the other."""
        order = sorted(
            ((ablation.name, setting) for ablation in self.asked for setting in ablation.settings),
            key=lambda each: (each[1].scene, each[1].n_workers),
        )
        made = cache.parts([self._part(*each) for each in order], one_core=True)
        played: dict[str, dict[str, Sums]] = {ablation.name: {} for ablation in self.asked}
        for (name, setting), sums in zip(order, made, strict=True):
            played[name][setting.name] = sums
        return played

    def _part(self, name: str, setting: Setting) -> Part:
        made_of = self.settings() | {"setting": asdict(setting) | {"words": ""}}
        key = key_of(made_of, self.depends)
        return Part(f"{name}.{setting.name}", partial(part, self, setting), key)

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return every number."""
        return metrics_of(played)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table of the documentation."""
        return (shown(self.seconds),)

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Draw a figure for each question; return the tables beside them."""
        return report(figures, self.asked, self.shown_tables(), metrics)


QUICK = Ablations(n_seeds=4, seconds=5.0)
"""Every number, from little."""


def make_experiment(
    quick: bool = False, seeds: int | None = None, studies: Sequence[str] | None = None
) -> Ablations:
    """The settings that the command line asks for; None: as usual."""
    names = None if studies is None else tuple(dict.fromkeys(studies))
    return changed(QUICK if quick else Ablations(), n_seeds=seeds, studies=names)


def part(config: Ablations, setting: Setting, tick: PartProgress) -> Sums:
    """Sums of one setting's episodes."""
    n_steps = round(config.seconds / DT_S)
    walks = walks_of(setting.scene, setting.n_workers, config.seeds, n_steps)
    return play(setting, walks, config.seeds, tick)


def metrics_of(played: Played) -> dict[str, Metric]:
    """Every number. What never happened has none: joints that so many cameras see."""
    metrics: dict[str, Metric] = {}
    for name, of_settings in played.items():
        for setting, sums in of_settings.items():
            key = f"{name}.{setting}"
            metrics |= _of_joints(key, sums)
            metrics[f"lost.{key}"] = estimate_ratio(sums["lost"], sums["frames"], "share")
            if "idf1" in sums:
                minutes = np.array(sums["frames"]) * DT_S / 60
                metrics[f"id_switches.{key}"] = estimate_rate(sums["id_switches"], minutes, "1/min")
                metrics[f"idf1.{key}"] = estimate_mean(sums["idf1"], "share")
        for each, word in product(ABLATIONS[name].settings, ("median", "p95")):
            pair = each.name, ABLATIONS[name].reference(each)
            if pair[0] != pair[1] and set(pair) <= of_settings.keys():
                ours, theirs = (of_settings[setting]["errors"] for setting in pair)
                off = make_quantile(ERRORS_M, [*ours, *theirs], 0.5 if word == "median" else 0.95)
                metrics |= compare_paired(f"error_m.{name}.{each.name}.{word}", off, len(ours), "m", 1000)
        for seen, sums in _by_sight(of_settings).items():
            metrics |= _of_joints(f"{name}.{seen}", sums)
    return metrics


def _of_joints(key: str, sums: Mapping[str, Any]) -> dict[str, Metric]:
    """Errors of joints and how well they are reported."""
    return {
        f"error_m.{key}.median": estimate_quantile(ERRORS_M, sums["errors"], 0.5, "m"),
        f"error_m.{key}.p95": estimate_quantile(ERRORS_M, sums["errors"], 0.95, "m"),
        f"rmse_m.{key}": estimate_rmse(sums["squares"], sums["joints"], "m"),
        f"coverage95.{key}": estimate_ratio(sums["inside"], sums["joints"], "share"),
    }


def _by_sight(of_settings: Mapping[str, Sums]) -> dict[str, dict[str, Any]]:
    """Settings of a scene together, by how many cameras see a joint, as `<scene>_seen_<k>`;
    their episodes of one seed count as one."""
    found: dict[str, dict[str, Any]] = {}
    for setting, sums in of_settings.items():
        for what, values in sums.items():
            if what.startswith("seen_"):
                _, k, name = what.split("_")
                together = found.setdefault(f"{setting.split('_')[0]}_seen_{k}", {})
                together[name] = np.array(values) + together.get(name, 0)
    return {
        name: {what: values[sums["joints"] > 0] for what, values in sums.items()}
        for name, sums in sorted(found.items())
        if sums["joints"].any()
    }
