"""From what was said to numbers: RMSE, ratios of a single camera's to four cameras', tracks."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.experiments.site.rows import MULTI, Row, rows_of, squared_m2
from hrc_env.experiments.study.intervals import mean_over, rmse_over

SIZES = {2: "two", 3: "three"}
Said = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Parts:
    """Everything that was run."""

    films: Mapping[int, Said]
    """By seed: the truth, and what everybody made of the shared film."""
    closed: Mapping[tuple[str, int], Said]
    """By name of a row and seed, of some walks: what came of crops of one's own."""
    dt_s: float
    estimators: tuple[str, ...]
    also: tuple[str, ...]


def metrics_of(parts: Parts) -> dict[str, Metric]:
    """Every number of results.json."""
    metrics = {}
    everybody = (*parts.estimators, *parts.also)
    for row in rows_of(everybody, (1, 4)):
        metrics[f"rmse_m.{row.name}"] = _rmse(parts, [row])
        metrics[f"tracked.{row.name}"] = mean_over(
            [float(np.mean(film["rows"][row.name]["tracked"])) for film in parts.films.values()],
            "share",
        )
    for estimator in everybody:
        for k in range(4):
            ratio = f"over_multi.{estimator}.camera_{k + 1}"
            metrics[ratio] = _over_multi(parts, Row(estimator, (k,)))
    for estimator in parts.estimators:
        for size, word in SIZES.items():
            metrics[f"rmse_m.{estimator}.{word}"] = _rmse(parts, rows_of([estimator], [size]))
    for row in rows_of(parts.estimators, (1, 4)):
        metrics[f"closed_rmse_m.{row.name}"] = _closed(parts, row)
    for k in range(4):
        metrics[f"found.camera_{k + 1}"] = mean_over(
            [film["found"][k] for film in parts.films.values()], "share"
        )
    return metrics


def best(metrics: Mapping[str, Metric], camera: str, estimators: Iterable[str]) -> str:
    """Whose RMSE with one camera is the smallest."""
    return min(estimators, key=lambda name: metrics[f"rmse_m.{name}.{camera}"].value)


def _rmse(parts: Parts, rows: list[Row]) -> Metric:
    """Over all frames of some rows together."""
    of_seeds = [
        np.concatenate([squared_m2(film, film["rows"][row.name], parts.dt_s) for row in rows])
        for film in parts.films.values()
    ]
    return _from(of_seeds)


def _closed(parts: Parts, row: Row) -> Metric:
    return _from(
        [
            squared_m2(parts.films[seed], said, parts.dt_s)
            for (name, seed), said in parts.closed.items()
            if name == row.name
        ]
    )


def _from(of_seeds: list[Floats]) -> Metric:
    return rmse_over([each.sum() for each in of_seeds], [each.size for each in of_seeds], "m")


def _over_multi(parts: Parts, row: Row) -> Metric:
    """How many times worse than the same estimator with four cameras, walk by walk."""

    def total(name: str) -> Callable[[Said], float]:
        return lambda film: float(squared_m2(film, film["rows"][name], parts.dt_s).sum())

    films = list(parts.films.values())
    multi = f"{row.estimator}.{MULTI}"
    above, below = list(map(total(row.name), films)), list(map(total(multi), films))
    return rmse_over(above, below, "ratio")
