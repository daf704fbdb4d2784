"""Computation of metrics from sums per sequence, with bootstrap intervals over sequences."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from benchmarks.tracking.names import DEFAULT, EVERYTHING, Selection
from benchmarks.tracking.sequences import MATCHED
from hrc_env.core.results import Metric, over
from hrc_env.core.typing import Floats
from hrc_env.evaluation.intervals import (
    estimate_clustered_share,
    estimate_rate,
    make_percentile_metric,
)

TIMING = "timing"
"""Name that replaces the condition in those keys of `Parts` that hold times per update [us]."""
Parts: TypeAlias = dict[tuple[str, str, str], dict[str, Any]]
"""Results of the cells, by rig, condition and name of the estimator."""
N_RESAMPLED = 1000
_Sums: TypeAlias = Mapping[str, Floats]


def compute_metrics(parts: Parts, selection: Selection = EVERYTHING) -> dict[str, Metric]:
    """Compute all metrics of the benchmark, by their names with dots."""
    metrics = _times(parts)
    for rig, condition, window in selection.rows():
        drawn = {
            name: resample_sums(parts[rig, condition, name][window])
            for name in selection.names_of(condition)
        }
        for name, sums in drawn.items():
            sequences = parts[rig, condition, name][window]
            for kind, (unit, statistic) in STATISTICS.items():
                if _NEEDS.get(kind, "n") in sums:
                    metrics[f"{kind}.{rig}.{window}.{name}"] = (
                        COUNTS[kind](sequences)
                        if kind in COUNTS
                        else metric(statistic(sums), unit, sums)
                    )
        default = _rmse(drawn[DEFAULT])
        for name in selection.rivals():
            ratio = default / _rmse(drawn[name])
            metrics[f"default_over.{rig}.{window}.{name}"] = metric(ratio, "-", drawn[name])
    if rigs := selection.rigs_of(MATCHED):
        for name in selection.names_of(MATCHED):
            metrics |= _bounds(parts, name, rigs)
    return dict(sorted(metrics.items()))


def _rmse(sums: _Sums) -> Floats:
    return np.sqrt(sums["squared"] / sums["n"])


STATISTICS: dict[str, tuple[str, Callable[[_Sums], Floats]]] = {
    "rmse_m": ("m", _rmse),
    "median_m": ("m", lambda sums: sums["median"] / sums["one"]),
    "facing_wrong": ("share", lambda sums: sums["wrong_way"] / sums["n_frames"]),
    "coverage95": ("share", lambda sums: sums["inside"] / sums["n"]),
    "std_over_rmse": ("-", lambda sums: np.sqrt(sums["trace"] / sums["squared"])),
    "identity_swaps": (
        "per 100 sequences",
        lambda sums: 100 * sums["identity_swaps"] / sums["one"],
    ),
}
"""Unit of each metric, and function that computes it from sums over sequences, by name.

The metric "median_m" is the mean over the sequences of the median error in each. "facing_wrong" is
the fraction of frames in which left and right of the torso are swapped.
"""
COUNTS: dict[str, Callable[[Mapping[str, Any]], Metric]] = {
    "facing_wrong": lambda each: estimate_clustered_share(each["wrong_way"], each["n_frames"]),
    "coverage95": lambda each: estimate_clustered_share(each["inside"], each["n"]),
    "identity_swaps": lambda each: estimate_rate(
        each["identity_swaps"], len(each["n"]) / 100, STATISTICS["identity_swaps"][0]
    ),
}
"""Functions that compute the metrics that are counts, with exact intervals, by name."""
_NEEDS = {
    **dict.fromkeys(("coverage95", "std_over_rmse"), "inside"),
    "identity_swaps": "identity_swaps",
}


def resample_sums(sums: Mapping[str, Any]) -> dict[str, Floats]:
    """Return sums (1001, ...) over all sequences, and over 1000 bootstrap samples of them.

    The samples depend only on the number of sequences, and are the same for all estimators.
    """
    arrays = {name: np.array(values, float) for name, values in sums.items()}
    n = len(arrays["n"])
    arrays["one"] = np.ones(n)
    picked = np.random.default_rng(0).integers(n, size=(N_RESAMPLED, n))
    counts = np.ones((N_RESAMPLED + 1, n))
    for k in range(n):
        counts[1:, k] = (picked == k).sum(1)
    return {name: np.tensordot(counts, values, 1) for name, values in arrays.items()}


def metric(values: Floats, unit: str, sums: _Sums, factor: int = 1) -> Metric:
    """Return a metric with the first value, and the central 95 % interval of the others."""
    n = round(float(sums["one"][0]))
    return replace(make_percentile_metric(float(values[0]), values[1:], unit, n), n=factor * n)


def _times(parts: Parts) -> dict[str, Metric]:
    return {
        f"update_us.{name}.{batch}": over(times, "us")
        for (_, condition, name), part in parts.items()
        if condition == TIMING
        for batch, times in part.items()
    }


def _bounds(parts: Parts, name: str, rigs: Sequence[str]) -> dict[str, Metric]:
    """Compute the ratio of the RMSE to its lower bound on each rig, and the RMS of these ratios."""
    drawn = {rig: resample_sums(parts[rig, MATCHED, name][MATCHED]) for rig in rigs}
    squared = {rig: sums["squared"] / sums["bound"] for rig, sums in drawn.items()}
    both = np.sqrt(np.mean(list(squared.values()), axis=0))
    return {
        **{
            f"ratio_to_bound_in.{rig}.{name}": metric(np.sqrt(values), "-", drawn[rig])
            for rig, values in squared.items()
        },
        f"ratio_to_bound.{name}": metric(both, "-", drawn[rigs[0]], len(rigs)),
    }
