"""The site study, which films walks once and replays all estimators on the same films."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.records import PoseEstimate
from hrc_env.core.results import Metric
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats
from hrc_env.evaluation.intervals import (
    MIN_SEEDS,
    adjust_metrics,
    compare_paired,
    estimate_clustered_share,
    estimate_rmse,
    make_rmse,
)
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.recording import Recording, record, replay
from hrc_env.experiments.report import Metrics, Report, Table, describe_quick_run
from hrc_env.experiments.rigs import CHOICES, DT_S, MULTI, N_WARM_UP, make_turns
from hrc_env.experiments.runner import check_at_least_one, is_as_short, override
from hrc_env.experiments.site import declaration
from hrc_env.experiments.site.declaration import ALSO, ESTIMATORS
from hrc_env.experiments.site.report import make_report, make_site
from hrc_env.experiments.site.walk import walk
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import ESTIMATORS as KNOWN

HEAD = JOINT["nose"]
"""Index of the joint that represents the paper's "head", for which MediaPipe has no joint. The
choice of the nose is an assumption."""
CROPS = "particle"
"""Name of the estimator that the crops of the shared film follow."""
SETTINGS = HRCConfig(tracker=TrackerConfig(prior_std_m=3.0))
"""Configuration with a wide prior, because walks lead far away from the centre of the
workplaces."""
ALONE = "alone."
"""Prefix of the names of results that use only the cameras of their table row from the first frame
on, as in the paper."""
ROWS = tuple(CHOICES)
"""Names of the rigs: each camera alone, and all four."""


@dataclass(frozen=True, slots=True)
class Site:
    """The site study and its settings."""

    name = "site"
    depends = ("env", "tracker", "emulator", "detector", "motion")
    n_seeds: int = 9
    """Number of walks."""
    first_seed: int = 100
    """Seed of the first walk; it increases by one with each further walk."""
    seconds: float = 20.0
    """Duration of a walk [s]."""
    estimators: tuple[str, ...] = ESTIMATORS
    """Estimators in the table. They are also evaluated with crops that follow them."""
    n_closed: int = 2
    """Number of walks that are filmed again with crops that follow each estimator. These films take
    most of the time."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a setting is invalid."""
        check_at_least_one(self, "n_seeds", "n_closed")
        if not self.estimators:
            raise ConfigError(f"--estimator requires at least one of {', '.join(KNOWN)}.")
        check_names("estimator", self.estimators, KNOWN)

    @property
    def seeds(self) -> list[int]:
        """Seeds, one per walk."""
        return [self.first_seed + k for k in range(self.n_seeds)]

    @property
    def all_estimators(self) -> tuple[str, ...]:
        """All estimators that are replayed on the film."""
        return declaration.list_estimators(self.estimators)

    @property
    def n_parts(self) -> int:
        """Number of shared films plus number of films with crops that follow an estimator."""
        n_closed = len(self.seeds[: self.n_closed])
        return self.n_seeds + len(self.estimators) * len(ROWS) * n_closed

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a quick run; "" for other runs."""
        is_short = is_as_short(self, QUICK) or self.n_seeds < MIN_SEEDS
        return describe_quick_run(self.n_seeds, self.seconds) if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all numbers depend."""
        return {**asdict(self), "also": ALSO, "crops": CROPS}

    def play(self, cache: PartCache) -> "Played":
        """Film all walks once, and some again with crops that follow each estimator."""
        films = [Part(f"film.{seed}", partial(film_walk, self, seed)) for seed in self.seeds]
        rows = [*product(self.estimators, ROWS, self.seeds[: self.n_closed])]
        parts = [
            Part(f"closed.{name}.{row}.{seed}", partial(film_own_crops, self, name, row, seed))
            for name, row, seed in rows
        ]
        made = cache.make_parts([*films, *parts], one_core=True)
        closed: dict[str, dict[int, Walk]] = {}
        for (name, row, seed), part in zip(rows, made[len(films) :], strict=True):
            closed.setdefault(f"{name}.{row}", {})[seed] = part
        return Played(dict(zip(self.seeds, made[: len(films)], strict=True)), closed)

    def metrics(self, played: "Played") -> dict[str, Metric]:
        """Return all metrics by name."""
        return compute_metrics(self, played)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table for the documentation."""
        return (declaration.make_errors_table(self.estimators, self.seconds),)

    def report(self, played: "Played", metrics: Metrics, figures: Path) -> Report:
        """Draw the figures and return the report."""
        tables = (*self.shown_tables(), *declaration.make_comparison_tables(self.estimators))
        return make_report(figures, self.estimators, played.films, tables, metrics)


QUICK = Site(n_seeds=2, seconds=6.0, n_closed=1)
"""The quick form of the study, with fewer and shorter walks."""


def make_experiment(
    quick: bool = False, seeds: int | None = None, estimator: Sequence[str] = ESTIMATORS
) -> Site:
    """Return the experiment for the options of the command line."""
    names = tuple(dict.fromkeys(estimator))
    return override(QUICK if quick else Site(), estimators=names, n_seeds=seeds)


Walk = Mapping[str, Any]
"""Result of a completed part: paths of the head, by name."""


class Played(NamedTuple):
    """All walks of the study."""

    films: Mapping[int, Walk]
    """Films with shared crops, with the estimates of all estimators, by seed."""
    closed: Mapping[str, Mapping[int, Walk]]
    """Walks with crops that follow the estimator, by the row of the results and by seed."""


def film_walk(config: Site, seed: int, tick: PartProgress) -> dict[str, Any]:
    """Film one walk with the crops of the four-camera track, and return all estimates of it."""
    motions = walk(make_site(), seed, round(config.seconds / DT_S), DT_S)
    settings = SETTINGS
    recording = record(make_site(), motions, settings, CROPS, seed, lambda share: tick(0.7 * share))
    first = _find_first_detection(recording)
    keys = [(name, row, "") for name in config.all_estimators for row in ROWS]
    keys += [(name, row, ALONE) for name in config.estimators for row in ROWS]
    rows: dict[str, Any] = {}
    for name, row, protocol in keys:
        n_start = 0 if protocol else first + N_WARM_UP
        beliefs = replay(recording, name, CHOICES[row], n_start, seed)
        rows[f"{protocol}{name}.{row}"] = _extract_head_path(beliefs)
        tick(0.3 / len(keys))
    head = np.round(recording.joints_world[:, HEAD], 4).tolist()
    return {"truth": head, "rows": rows, "judged_from": first + N_WARM_UP}


def _find_first_detection(recording: Recording) -> int:
    """Return the index of the first frame in which a camera detects the worker."""
    return int(np.argmax((recording.keypoints.confidence > 0).any((1, 2, 3))))


def film_own_crops(
    config: Site, estimator: str, row: str, seed: int, tick: PartProgress
) -> dict[str, Any]:
    """Film a walk with crops that follow an estimator, and return its estimates.

    The cameras that do not belong to the row fail after the warm-up.
    """
    settings = replace(SETTINGS, faults=make_turns("site", [CHOICES[row]])[0].faults)
    motions = walk(make_site(), seed, round(config.seconds / DT_S), DT_S)
    recording = record(make_site(), motions, settings, estimator, seed, tick)
    return _extract_head_path(recording.beliefs)


def _extract_head_path(beliefs: PoseEstimate) -> dict[str, Any]:
    """Return the estimated path (T, 3) of the head [m] and the mask (T,) of tracked frames."""
    return {
        "head": np.round(beliefs.mean_world[:, 0, HEAD], 4).tolist(),
        "tracked": beliefs.tracked[:, 0].astype(int).tolist(),
    }


def compute_metrics(config: Site, played: Played) -> dict[str, Metric]:
    """Return all metrics of results.json by name."""
    films, closed = played.films, played.closed
    squared = {
        key: np.array([_square_m2(film, film["rows"][key]).sum() for film in films.values()])
        for key in films[config.first_seed]["rows"]
    }
    n_judged = [len(film["truth"][film["judged_from"] :]) for film in films.values()]
    metrics = {}
    for name, row in product(config.all_estimators, ROWS):
        for key in (f"{name}.{row}", f"{ALONE}{name}.{row}"):
            if key in squared:
                metrics[f"rmse_m.{key}"] = estimate_rmse(squared[key], n_judged, "m")
                tracked = [film["rows"][key]["tracked"] for film in films.values()]
                metrics[f"tracked.{key}"] = estimate_clustered_share(
                    [sum(frames) for frames in tracked], [len(frames) for frames in tracked]
                )
        if row != MULTI:
            one, multi = (squared[f"{name}.{cameras}"] for cameras in (row, MULTI))
            metrics[f"over_multi.{name}.{row}"] = estimate_rmse(one, multi, "ratio")
    first, *others = config.all_estimators
    for name, row, start in product(others, ROWS, ("", ALONE)):
        ours, theirs = f"{start}{first}.{row}", f"{start}{name}.{row}"
        if theirs in squared:
            both = np.concatenate([squared[ours], squared[theirs]])
            off = make_rmse(both, np.tile(n_judged, 2))
            metrics |= compare_paired(f"rmse_m.{theirs}", off, len(films), "m")
    for key, walks in closed.items():
        squares = [_square_m2(films[seed], row) for seed, row in walks.items()]
        sums, counts = [errors.sum() for errors in squares], [len(errors) for errors in squares]
        metrics[f"closed_rmse_m.{key}"] = estimate_rmse(sums, counts, "m")
    return metrics | adjust_metrics(metrics)


def _square_m2(film: Walk, row: Walk) -> Floats:
    """Return the squared errors (T,) of the head in the frames that are evaluated [m^2].

    If the track is lost, the last estimate or the prior is evaluated.
    """
    off_m = np.array(row["head"], float) - np.array(film["truth"], float)
    return (off_m**2).sum(-1)[film["judged_from"] :]
