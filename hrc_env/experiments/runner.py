"""Runs a study: plays the parts that are not there yet, then writes numbers, figures, report."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.experiments.cache import PartCache, Progress, own_folder
from hrc_env.experiments.report import Report
from hrc_env.experiments.versions import check_subsystems, key_of

ConfigT = TypeVar("ConfigT")
PlayedT = TypeVar("PlayedT")
Settings = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Study(Generic[ConfigT, PlayedT]):
    """A question asked of simulated episodes with some configuration."""

    name: str
    depends: tuple[str, ...]
    """Subsystems that all numbers depend on; their versions are in the parts' key."""
    settings: Callable[[ConfigT], Settings]
    """What all numbers depend on."""
    seeds: Callable[[ConfigT], Sequence[int]]
    n_parts: Callable[[ConfigT], float]
    play: Callable[[ConfigT, PartCache], PlayedT]
    """All parts, each from the cache or anew."""
    metrics: Callable[[ConfigT, PlayedT], dict[str, Metric]]
    report: Callable[[ConfigT, PlayedT, dict[str, Metric], Path], Report]
    """Draws the figures into a folder; what is to be read."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` unless subsystems are named, and exist."""
        check_subsystems(self.depends)


def run(
    study: Study[ConfigT, Any],
    config: ConfigT,
    out: Path,
    progress: Progress,
    overwrite: bool = False,
) -> dict[str, Metric]:
    """Play what an earlier run with the same settings and versions did not finish in `out`; write
    results.json, figures/, report.html and report.md there, over other results only if asked."""
    own_folder(out, study.name, overwrite)
    settings = {"experiment": study.name, **study.settings(config)}
    key = key_of(settings, study.depends)
    played = study.play(config, PartCache(out / "parts", key, study.n_parts(config), progress))
    metrics = study.metrics(config, played)
    report = study.report(config, played, metrics, out / "figures")
    report.write(out, settings, study.seeds(config), metrics)
    return metrics


def changed(config: ConfigT, **values: Any) -> ConfigT:
    """A configuration with the values that are given; None leaves a field as it is."""
    given = {name: value for name, value in values.items() if value is not None}
    return replace(config, **given)  # type: ignore[type-var]


def at_least_one(config: Any, *names: str) -> None:
    """Raise `ConfigError` unless these fields of a configuration are at least 1."""
    for name in names:
        if getattr(config, name) < 1:
            option = "--seeds" if name == "n_seeds" else name
            raise ConfigError(f"{option} must be at least 1, got {getattr(config, name)}.")
