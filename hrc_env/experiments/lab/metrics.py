"""From films to numbers: errors, joints missed, and those that four cameras bring back."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.results import Metric
from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Bools, Floats
from hrc_env.experiments.lab.motions import MOTIONS
from hrc_env.experiments.lab.sides import MISSED_SHARE
from hrc_env.experiments.study.intervals import quantile_over, ratio_over

COLUMNS = (*(f"camera_{k + 1}" for k in range(4)), "multi")
ALL = "all"
"""All motions together."""
QUANTILES = {"median": 0.5, "p95": 0.95}
Film = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Parts:
    """Everything that was filmed."""

    films: Mapping[tuple[str, int], Film]
    """By motion and seed."""
    estimators: tuple[str, ...]


def metrics_of(parts: Parts) -> dict[str, Metric]:
    """Every number of results.json."""
    metrics: dict[str, Metric] = {}
    for motion in (*MOTIONS, ALL):
        films = films_of(parts, motion)
        for estimator in parts.estimators:
            for column in COLUMNS:
                errors = [errors_m(film, estimator, column).ravel() for film in films]
                for word, q in QUANTILES.items():
                    key = f"error_m.{estimator}.{column}.{motion}.{word}"
                    metrics[key] = quantile_over([each.tolist() for each in errors], q, "m")
        metrics |= _misses(films, motion, parts.estimators[0])
    metrics |= _by_joint(parts)
    return metrics


def films_of(parts: Parts, motion: str) -> list[Film]:
    """Those of one motion, or all of them."""
    return [film for (name, _), film in parts.films.items() if motion in (name, ALL)]


def errors_m(film: Film, estimator: str, column: str) -> Floats:
    """(T, J) distances of the estimate from the truth [m]."""
    return np.asarray(film["errors_m"][f"{estimator}.{column}"], float)


def recovered(film: Film, estimator: str) -> Bools:
    """(T, J) which joints the estimate of all cameras has near enough."""
    return errors_m(film, estimator, "multi") <= MISSED_SHARE * film["stature_m"]


def _misses(films: list[Film], motion: str, estimator: str) -> dict[str, Metric]:
    """Shares of joints missed, on the far side apart, and of these the share brought back."""
    metrics = {}
    for c, column in enumerate(COLUMNS[:4]):
        counts = np.array([_counts(film, c, estimator) for film in films], float)
        missed, n, far_missed, far, back = counts.T
        metrics[f"missed.{column}.{motion}"] = ratio_over(missed, n, "share")
        metrics[f"missed_far.{column}.{motion}"] = ratio_over(far_missed, far, "share")
        metrics[f"recovered_far.{column}.{motion}"] = ratio_over(back, far_missed, "share")
    lost = [float((~recovered(film, estimator)).sum()) for film in films]
    total = [float(recovered(film, estimator).size) for film in films]
    metrics[f"missed.multi.{motion}"] = ratio_over(lost, total, "share")
    return metrics


def _counts(film: Film, c: int, estimator: str) -> list[float]:
    """Of camera c: missed, looked at, missed on the far side, far side, of those brought back."""
    missed = np.asarray(film["missed"], bool)[:, c]
    away = np.asarray(film["away"], bool)[:, c]
    back = recovered(film, estimator)
    lost = missed & away
    return [
        float(each)
        for each in (missed.sum(), missed.size, lost.sum(), away.sum(), (lost & back).sum())
    ]


def _by_joint(parts: Parts) -> dict[str, Metric]:
    """Median errors of every joint, the first estimator, all motions."""
    films, metrics = films_of(parts, ALL), {}
    for j, joint in enumerate(JOINTS):
        for column in COLUMNS:
            errors = [errors_m(film, parts.estimators[0], column)[:, j].tolist() for film in films]
            metrics[f"error_m.by_joint.{column}.{joint}.median"] = quantile_over(errors, 0.5, "m")
    return metrics
