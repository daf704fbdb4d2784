"""Runs an experiment: plays the parts that are not there yet, then writes numbers and report."""

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Protocol, TypeVar

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.engines.engine import Engine
from hrc_env.experiments.cache import PartCache, Progress, own_folder
from hrc_env.experiments.report import Report
from hrc_env.experiments.versions import key_of

PlayedT = TypeVar("PlayedT")
RecordT = TypeVar("RecordT")


class Experiment(Protocol[PlayedT]):
    """What the runner asks of an experiment, whose fields are its settings.

    `hrc_env.experiments.study.Study` is one for whole episodes. Others play parts of their own.
    """

    @property
    def name(self) -> str:
        """As its folder and its results are called."""
        ...

    @property
    def depends(self) -> tuple[str, ...]:
        """Subsystems that its numbers depend on; their versions are in the parts' keys."""
        ...

    @property
    def seeds(self) -> Sequence[int]:
        """Of everything that is drawn."""
        ...

    @property
    def n_parts(self) -> float:
        """How many parts the progress is made of."""
        ...

    def settings(self) -> Mapping[str, Any]:
        """Return all that its numbers depend on, as JSON can hold it."""
        ...

    def play(self, cache: PartCache) -> PlayedT:
        """Return what all parts came to, each from the cache or anew."""
        ...

    def metrics(self, played: PlayedT) -> dict[str, Metric]:
        """Return every number."""
        ...

    def report(self, played: PlayedT, metrics: dict[str, Metric], figures: Path) -> Report:
        """Draw the figures into a folder; return the report.

        An experiment that may be too short to compare anything warns here, as `Report.quick`,
        or by `quick_note`. Tables that the documentation shows, too, are those of `shown_tables`.
        """
        ...


def settings_of(experiment: Experiment[Any]) -> dict[str, Any]:
    """Return the settings of an experiment with its name, as results.json has them."""
    return {"experiment": experiment.name, **experiment.settings()}


def cache_of(
    experiment: Experiment[Any], parts: Path, progress: Progress, engine: Engine | None = None
) -> PartCache:
    """Return the cache of an experiment's parts in a folder."""
    key = key_of(settings_of(experiment), experiment.depends)
    return PartCache(parts, key, experiment.n_parts, progress, engine=engine)


def run_experiment(
    experiment: Experiment[Any],
    out: Path | str,
    progress: Progress = lambda share, label: None,
    overwrite: bool = False,
    engine: Engine | None = None,
) -> dict[str, Metric]:
    """Run an experiment, and write results.json, figures/, report.html and report.md.

    Args:
        experiment: what is played and counted.
        out: folder of the results, and of parts: those that an earlier run with the same settings
            and versions finished there are not played again.
        progress: called with the growth of the share that is done, and its part.
        overwrite: delete the results of something else, or with other settings, in the folder.
        engine: where parts are played, which changes none of them; None: where it is fastest on
            this machine.

    Returns:
        Every number by its name.

    Raises:
        ConfigError: the folder holds the results of something else, or with other settings: what
            differs is said.
    """
    out = Path(out)
    own_folder(out, experiment.name, overwrite, experiment.settings())
    with nullcontext() if engine is None else engine.opened():
        played = experiment.play(cache_of(experiment, out / "parts", progress, engine))
    metrics = experiment.metrics(played)
    report = experiment.report(played, metrics, out / "figures")
    report = replace(report, quick=getattr(experiment, "quick_note", report.quick))
    report.write(out, settings_of(experiment), experiment.seeds, metrics)
    return metrics


def is_as_short(config: Any, quick: Any) -> bool:
    """Return whether a number in the settings of an experiment is no greater than in its short
    form, of those that this makes smaller.

    Args:
        config: the settings, a dataclass of which every field has a default.
        quick: its short form.
    """
    usual = type(quick)()
    names = [each.name for each in fields(quick)]
    values = [(getattr(usual, n), getattr(quick, n), getattr(config, n)) for n in names]
    return any(_size(now) <= _size(short) < _size(most) for most, short, now in values)


def _size(value: Any) -> float:
    """A number, or how many a list holds; of anything else 0."""
    if isinstance(value, tuple | list):
        return len(value)
    return float(value) if isinstance(value, int | float) else 0.0


def changed(record: RecordT, **values: Any) -> RecordT:
    """Return a record with the values that are given; None leaves a field as it is."""
    given = {name: value for name, value in values.items() if value is not None}
    return replace(record, **given)  # type: ignore[type-var]


def at_least_one(record: Any, *names: str) -> None:
    """Raise `ConfigError` unless these fields of a record are at least 1."""
    for name in names:
        if getattr(record, name) < 1:
            option = "--seeds" if name == "n_seeds" else name
            raise ConfigError(f"{option} must be at least 1, got {getattr(record, name)}.")
