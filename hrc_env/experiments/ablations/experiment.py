"""The experiment that runs all settings of the ablations."""

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
from hrc_env.evaluation.intervals import (
    MIN_SEEDS,
    adjust_metrics,
    compare_paired,
    estimate_clustered_share,
    estimate_mean,
    estimate_rate,
    estimate_rmse,
)
from hrc_env.evaluation.intervals import estimate_binned_quantile as estimate_quantile
from hrc_env.evaluation.intervals import make_binned_quantile as make_quantile
from hrc_env.experiments.ablations.ablation import Ablation, Setting
from hrc_env.experiments.ablations.declaration import ABLATIONS, make_table
from hrc_env.experiments.ablations.play import Sums, make_walks, play
from hrc_env.experiments.ablations.report import make_report
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.report import Metrics, Report, Table, describe_quick_run
from hrc_env.experiments.rigs import DT_S, WARM_UP_S
from hrc_env.experiments.runner import check_at_least_one, is_as_short, override
from hrc_env.experiments.versions import make_key

Played = Mapping[str, Mapping[str, Sums]]
"""Sums over episodes, by ablation and setting."""


@dataclass(frozen=True, slots=True)
class Ablations:
    """The ablations to run, with the number and duration of their episodes."""

    name = "ablations"
    depends = ("env", "tracker", "emulator", "motion")
    n_seeds: int = 30
    """Number of episodes per setting."""
    first_seed: int = 2_000_000
    """Seed of the first episode; it increases by one with each further episode."""
    seconds: float = 10.0
    """Duration of an episode, including the warm-up [s]."""
    studies: tuple[str, ...] = tuple(ABLATIONS)
    """Names of the ablations to run."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a setting is invalid."""
        check_at_least_one(self, "n_seeds")
        if not self.seconds > WARM_UP_S:
            raise ConfigError(
                f"Episodes must be longer than the warm-up of {WARM_UP_S:g} s, got {self.seconds}."
            )
        if not self.studies:
            raise ConfigError(f"--studies requires at least one of {', '.join(ABLATIONS)}.")
        check_names("study", self.studies, ABLATIONS)

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds, one per episode."""
        return tuple(self.first_seed + k for k in range(self.n_seeds))

    @property
    def ablations(self) -> tuple[Ablation, ...]:
        """The ablations to run, in the order of the report."""
        return tuple(each for name, each in ABLATIONS.items() if name in self.studies)

    @property
    def n_parts(self) -> int:
        """Number of settings of all ablations."""
        return sum(len(ablation.settings) for ablation in self.ablations)

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a quick run; "" for other runs."""
        is_short = is_as_short(self, QUICK) or self.n_seeds < MIN_SEEDS
        return describe_quick_run(self.n_seeds, self.seconds) if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all numbers depend.

        The choice of ablations is not included, because it does not affect the numbers.
        """
        return {name: value for name, value in asdict(self).items() if name != "studies"}

    def play(self, cache: PartCache) -> Played:
        """Return the sums of every setting. Settings with the same walks are played in sequence."""
        order = sorted(
            (
                (ablation.name, setting)
                for ablation in self.ablations
                for setting in ablation.settings
            ),
            key=lambda item: (item[1].scene, item[1].n_workers),
        )
        made = cache.make_parts([self._make_part(*item) for item in order], one_core=True)
        played: dict[str, dict[str, Sums]] = {ablation.name: {} for ablation in self.ablations}
        for (name, setting), sums in zip(order, made, strict=True):
            played[name][setting.name] = sums
        return played

    def _make_part(self, name: str, setting: Setting) -> Part:
        made_of = self.settings() | {"setting": asdict(setting) | {"words": ""}}
        key = make_key(made_of, self.depends)
        return Part(f"{name}.{setting.name}", partial(play_setting, self, setting), key)

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return all metrics by name."""
        return compute_metrics(played)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table for the documentation."""
        return (make_table(self.seconds),)

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Draw a figure for each ablation and return the report."""
        return make_report(figures, self.ablations, self.shown_tables(), metrics)


QUICK = Ablations(n_seeds=4, seconds=5.0)
"""The quick form of the experiment, with few and short episodes."""


def make_experiment(
    quick: bool = False, seeds: int | None = None, studies: Sequence[str] | None = None
) -> Ablations:
    """Return the experiment for the options of the command line; None keeps a default."""
    names = None if studies is None else tuple(dict.fromkeys(studies))
    return override(QUICK if quick else Ablations(), n_seeds=seeds, studies=names)


def play_setting(config: Ablations, setting: Setting, tick: PartProgress) -> Sums:
    """Play the episodes of a setting and return their sums."""
    n_steps = round(config.seconds / DT_S)
    walks = make_walks(setting.scene, setting.n_workers, config.seeds, n_steps)
    return play(setting, walks, config.seeds, tick)


def compute_metrics(played: Played) -> dict[str, Metric]:
    """Return all metrics by name; groups that contain no joints have no metrics."""
    metrics: dict[str, Metric] = {}
    for name, of_settings in played.items():
        for setting, sums in of_settings.items():
            key = f"{name}.{setting}"
            metrics |= _measure_joints(key, sums)
            metrics[f"lost.{key}"] = estimate_clustered_share(sums["lost"], sums["frames"])
            if "idf1" in sums:
                minutes = np.array(sums["frames"]) * DT_S / 60
                metrics[f"id_switches.{key}"] = estimate_rate(sums["id_switches"], minutes, "1/min")
                metrics[f"idf1.{key}"] = estimate_mean(sums["idf1"], "share")
        for each, word in product(ABLATIONS[name].settings, ("median", "p95")):
            pair = each.name, ABLATIONS[name].find_reference(each)
            if pair[0] != pair[1] and set(pair) <= of_settings.keys():
                ours, theirs = (of_settings[setting]["errors"] for setting in pair)
                off = make_quantile(ERRORS_M, [*ours, *theirs], 0.5 if word == "median" else 0.95)
                metrics |= compare_paired(
                    f"error_m.{name}.{each.name}.{word}", off, len(ours), "m", 1000
                )
        for seen, sums in _group_by_sight(of_settings).items():
            metrics |= _measure_joints(f"{name}.{seen}", sums)
    return metrics | adjust_metrics(metrics)


def _measure_joints(key: str, sums: Mapping[str, Any]) -> dict[str, Metric]:
    """Return the errors of joints, and how often the reported 95 % regions contain the truth."""
    return {
        f"error_m.{key}.median": estimate_quantile(ERRORS_M, sums["errors"], 0.5, "m"),
        f"error_m.{key}.p95": estimate_quantile(ERRORS_M, sums["errors"], 0.95, "m"),
        f"rmse_m.{key}": estimate_rmse(sums["squares"], sums["joints"], "m"),
        f"coverage95.{key}": estimate_clustered_share(sums["inside"], sums["joints"]),
    }


def _group_by_sight(of_settings: Mapping[str, Sums]) -> dict[str, dict[str, Any]]:
    """Add up the sums of a scene's settings by the number of cameras that see a joint.

    The names of the results are `<scene>_seen_<k>`; episodes with the same seed count as one.
    """
    groups: dict[str, dict[str, Any]] = {}
    for setting, sums in of_settings.items():
        for key, values in sums.items():
            if key.startswith("seen_"):
                _, k, name = key.split("_")
                group = groups.setdefault(f"{setting.split('_')[0]}_seen_{k}", {})
                group[name] = np.array(values) + group.get(name, 0)
    return {
        name: {key: values[sums["joints"] > 0] for key, values in sums.items()}
        for name, sums in sorted(groups.items())
        if sums["joints"].any()
    }
