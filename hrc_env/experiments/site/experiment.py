"""The paper's simulation, again: walks are filmed once, everybody is given the same film."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.records import PoseEstimate
from hrc_env.core.results import Metric
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats
from hrc_env.evaluation.intervals import estimate_mean, compare_paired, make_rmse, estimate_rmse
from hrc_env.experiments.cache import Part as CachedPart
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.recording import Recording, record, replay
from hrc_env.experiments.report import Metrics, Report, Table, quick_words
from hrc_env.experiments.rigs import CHOICES, DT_S, MULTI, N_WARM_UP, left_of
from hrc_env.experiments.runner import at_least_one, changed, is_as_short
from hrc_env.experiments.site import declaration
from hrc_env.experiments.site.declaration import ALSO, ESTIMATORS
from hrc_env.experiments.site.report import report, site
from hrc_env.experiments.site.walk import walk
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import ESTIMATORS as KNOWN

HEAD = JOINT["nose"]
"""The paper's "head"; MediaPipe has no joint of that name (judgement: the nose)."""
CROPS = "particle"
"""The estimator that the crops of the shared film follow."""
SETTINGS = HRCConfig(tracker=TrackerConfig(prior_std_m=3.0))
"""Unknown people may be far from the middle of the work: walks go all over the place."""
ALONE = "alone."
"""In keys: cameras that are alone from the first frame on, as the paper's were."""
ROWS = tuple(CHOICES)
"""Each camera alone, and all four."""


@dataclass(frozen=True, slots=True)
class Site:
    """The experiment, and how much is run."""

    name = "site"
    depends = ("env", "tracker", "emulator", "detector", "motion")
    n_seeds: int = 9
    """Walks."""
    first_seed: int = 100
    """Seed of the first walk; the others count up."""
    seconds: float = 20.0
    """How long each is."""
    estimators: tuple[str, ...] = ESTIMATORS
    """Those of the table, which also make crops of their own."""
    n_closed: int = 2
    """So many of the walks are filmed again for everybody's own crops, which costs most."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot work."""
        at_least_one(self, "n_seeds", "n_closed")
        if not self.estimators:
            raise ConfigError(f"--estimator needs a name of {', '.join(KNOWN)}.")
        check_names("estimator", self.estimators, KNOWN)

    @property
    def seeds(self) -> list[int]:
        """One a walk."""
        return [self.first_seed + k for k in range(self.n_seeds)]

    @property
    def everybody(self) -> tuple[str, ...]:
        """All who are given the film."""
        return declaration.everybody(self.estimators)

    @property
    def n_parts(self) -> int:
        """Films, and own crops."""
        n_closed = len(self.seeds[: self.n_closed])
        return self.n_seeds + len(self.estimators) * len(ROWS) * n_closed

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a short run; "" if it is long enough."""
        is_short = is_as_short(self, QUICK)
        return quick_words(self.n_seeds, self.seconds) if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return what all numbers depend on."""
        return {**asdict(self), "also": ALSO, "crops": CROPS}

    def play(self, cache: PartCache) -> "Played":
        """Return all walks, filmed once for everybody; some again with everybody's own crops."""
        films = [CachedPart(f"film.{seed}", partial(film, self, seed)) for seed in self.seeds]
        rows = [*product(self.estimators, ROWS, self.seeds[: self.n_closed])]
        parts = [
            CachedPart(f"closed.{name}.{row}.{seed}", partial(closed_loop, self, name, row, seed))
            for name, row, seed in rows
        ]
        made = cache.parts([*films, *parts], one_core=True)
        closed: dict[str, dict[int, Mapping[str, Any]]] = {}
        for (name, row, seed), part in zip(rows, made[len(films) :], strict=True):
            closed.setdefault(f"{name}.{row}", {})[seed] = part
        filmed = dict(zip(self.seeds, made[: len(films)], strict=True))
        return filmed, closed

    def metrics(self, played: "Played") -> dict[str, Metric]:
        """Return every number of results.json."""
        return metrics_of(self, played)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table of the documentation."""
        return (declaration.errors(self.estimators, self.seconds),)

    def report(self, played: "Played", metrics: Metrics, figures: Path) -> Report:
        """Draw the figures; return the tables beside them."""
        tables = (*self.shown_tables(), *declaration.comparisons(self.estimators))
        return report(figures, self.estimators, played[0], tables, metrics)


QUICK = Site(n_seeds=2, seconds=6.0, n_closed=1)
"""Every number, from fewer and shorter walks."""


def make_experiment(
    quick: bool = False, seeds: int | None = None, estimator: Sequence[str] = ESTIMATORS
) -> Site:
    """The settings that the command line asks for."""
    names = tuple(dict.fromkeys(estimator))
    return changed(QUICK if quick else Site(), estimators=names, n_seeds=seeds)


Part = Mapping[str, Any]
Played = tuple[Mapping[int, Part], Mapping[str, Mapping[int, Part]]]
"""Shared films, with what everybody made of them, by seed; own crops in some, by row and seed."""


def film(config: Site, seed: int, tick: PartProgress) -> dict[str, Any]:
    """One walk, filmed with the crops of the four-camera track, and everybody's word on it."""
    motions = walk(site(), seed, round(config.seconds / DT_S), DT_S)
    taken = record(site(), motions, SETTINGS, CROPS, seed, lambda share: tick(0.7 * share))
    begin = _first_seen(taken)
    asked = [(name, row, "") for name in config.everybody for row in ROWS]
    asked += [(name, row, ALONE) for name in config.estimators for row in ROWS]
    said: dict[str, Any] = {}
    for name, row, protocol in asked:
        beliefs = replay(taken, name, CHOICES[row], 0 if protocol else begin + N_WARM_UP, seed)
        said[f"{protocol}{name}.{row}"] = _head_path(beliefs)
        tick(0.3 / len(asked))
    head = np.round(taken.joints_world[:, HEAD], 4).tolist()
    return {"truth": head, "rows": said, "judged_from": begin + N_WARM_UP}


def _first_seen(taken: Recording) -> int:
    """The first frame in which a camera shows the worker: walks may begin out of sight of all."""
    return int(np.argmax((taken.keypoints.confidence > 0).any((1, 2, 3))))


def closed_loop(
    config: Site, estimator: str, row: str, seed: int, tick: PartProgress
) -> dict[str, Any]:
    """The same walk with crops of one's own; after a second some cameras are lost."""
    settings = replace(SETTINGS, faults=left_of("site", [CHOICES[row]])[0].faults)
    motions = walk(site(), seed, round(config.seconds / DT_S), DT_S)
    return _head_path(record(site(), motions, settings, estimator, seed, tick).beliefs)


def _head_path(beliefs: PoseEstimate) -> dict[str, Any]:
    """What is kept of a row: where the head was thought to be (T, 3) [m], and whether tracked."""
    return {
        "head": np.round(beliefs.mean_world[:, 0, HEAD], 4).tolist(),
        "tracked": beliefs.tracked[:, 0].astype(int).tolist(),
    }


def metrics_of(config: Site, played: Played) -> dict[str, Metric]:
    """Every number of results.json."""
    films, closed = played
    squared = {
        key: np.array([_squared_m2(each, each["rows"][key]).sum() for each in films.values()])
        for key in films[config.first_seed]["rows"]
    }
    n_judged = [len(each["truth"][each["judged_from"] :]) for each in films.values()]
    metrics = {}
    for name, row in product(config.everybody, ROWS):
        for key in (f"{name}.{row}", f"{ALONE}{name}.{row}"):
            if key in squared:
                metrics[f"rmse_m.{key}"] = estimate_rmse(squared[key], n_judged, "m")
                tracked = [float(np.mean(each["rows"][key]["tracked"])) for each in films.values()]
                metrics[f"tracked.{key}"] = estimate_mean(tracked, "share")
        if row != MULTI:
            one, multi = (squared[f"{name}.{each}"] for each in (row, MULTI))
            metrics[f"over_multi.{name}.{row}"] = estimate_rmse(one, multi, "ratio")
    first, *others = config.everybody
    for name, row, start in product(others, ROWS, ("", ALONE)):
        ours, theirs = f"{start}{first}.{row}", f"{start}{name}.{row}"
        if theirs in squared:
            both = np.concatenate([squared[ours], squared[theirs]])
            off = make_rmse(both, np.tile(n_judged, 2))
            metrics |= compare_paired(f"rmse_m.{theirs}", off, len(films), "m")
    for key, own in closed.items():
        squares = [_squared_m2(films[seed], said) for seed, said in own.items()]
        sums, counts = zip(*((each.sum(), len(each)) for each in squares), strict=True)
        metrics[f"closed_rmse_m.{key}"] = estimate_rmse(sums, counts, "m")
    return metrics


def _squared_m2(film: Part, row: Part) -> Floats:
    """Squared errors of the head [m^2] in the frames that are judged; where the track is lost, the
    estimator's last word, or its prior, is its answer."""
    off_m = np.array(row["head"], float) - np.array(film["truth"], float)
    return (off_m**2).sum(-1)[film["judged_from"] :]
