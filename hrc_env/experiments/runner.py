"""The runner of experiments. It computes missing parts and writes metrics and reports."""

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Protocol, TypeVar

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.engines.engine import Engine
from hrc_env.experiments.cache import PartCache, Progress, claim_folder
from hrc_env.experiments.report import Report
from hrc_env.experiments.versions import make_key

PlayedT = TypeVar("PlayedT")
RecordT = TypeVar("RecordT")


class Experiment(Protocol[PlayedT]):
    """Interface of an experiment for the runner; the fields of an experiment are its settings.

    `hrc_env.experiments.study.Study` implements it for studies with whole episodes as their parts.
    """

    @property
    def name(self) -> str:
        """Name of the experiment in its folder and in its results."""
        ...

    @property
    def depends(self) -> tuple[str, ...]:
        """Subsystems on which the numbers depend; the keys of parts contain their versions."""
        ...

    @property
    def seeds(self) -> Sequence[int]:
        """Seeds from which all random numbers are generated."""
        ...

    @property
    def n_parts(self) -> float:
        """Total weight of the parts in the progress."""
        ...

    def settings(self) -> Mapping[str, Any]:
        """Return all settings on which the numbers depend, as JSON values."""
        ...

    def play(self, cache: PartCache) -> PlayedT:
        """Return the results of all parts; compute those that are not in the cache."""
        ...

    def metrics(self, played: PlayedT) -> dict[str, Metric]:
        """Return all metrics by name."""
        ...

    def report(self, played: PlayedT, metrics: dict[str, Metric], figures: Path) -> Report:
        """Draw the figures into a folder and return the report.

        An experiment that may be too short for comparisons returns a warning, as `Report.quick` or
        as the attribute `quick_note`. The method `shown_tables` returns the tables that also appear
        in the documentation.
        """
        ...


def describe_experiment(experiment: Experiment[Any]) -> dict[str, Any]:
    """Return the settings of an experiment with its name, as results.json contains them."""
    return {"experiment": experiment.name, **experiment.settings()}


def make_cache(
    experiment: Experiment[Any], parts: Path, progress: Progress, engine: Engine | None = None
) -> PartCache:
    """Return the cache of an experiment's parts in a folder."""
    key = make_key(describe_experiment(experiment), experiment.depends)
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
        experiment: the experiment.
        out: folder of results and parts; parts of an earlier run with the same settings and
            versions are not computed again.
        progress: callback that receives the increase of the completed fraction and the label of the
            current part.
        overwrite: whether to delete results of another study or of other settings in the folder.
        engine: engine that computes the parts, without effect on the results; None: the fastest on
            this machine.

    Returns:
        All metrics by name.

    Raises:
        ConfigError: the folder contains results of another study or of other settings; the message
            lists the differences.
    """
    out = Path(out)
    claim_folder(out, experiment.name, overwrite, experiment.settings())
    with nullcontext() if engine is None else engine.opened():
        played = experiment.play(make_cache(experiment, out / "parts", progress, engine))
    metrics = experiment.metrics(played)
    report = experiment.report(played, metrics, out / "figures")
    report = replace(report, quick=getattr(experiment, "quick_note", report.quick))
    report.write(out, describe_experiment(experiment), experiment.seeds, metrics)
    return metrics


def is_as_short(config: Any, quick: Any) -> bool:
    """Return whether an experiment is as short as its quick form.

    This holds if any of the numbers that the quick form reduces is at most the number in that form.

    Args:
        config: the settings, a dataclass whose fields all have defaults.
        quick: the settings of the quick form.
    """
    usual = type(quick)()
    names = [field.name for field in fields(quick)]
    values = [(getattr(usual, n), getattr(quick, n), getattr(config, n)) for n in names]
    return any(
        _get_size(value) <= _get_size(short) < _get_size(most) for most, short, value in values
    )


def _get_size(value: Any) -> float:
    """Return a number, or the length of a list; 0 for other values."""
    if isinstance(value, tuple | list):
        return len(value)
    return float(value) if isinstance(value, int | float) else 0.0


def override(record: RecordT, **values: Any) -> RecordT:
    """Return a copy of a record with the given values; a value of None leaves a field unchanged."""
    given = {name: value for name, value in values.items() if value is not None}
    return replace(record, **given)  # type: ignore[type-var]


def check_at_least_one(record: Any, *names: str) -> None:
    """Raise `ConfigError` if one of the named fields of a record is below 1."""
    for name in names:
        if getattr(record, name) < 1:
            option = "--seeds" if name == "n_seeds" else name
            raise ConfigError(f"{option} must be at least 1, got {getattr(record, name)}.")
