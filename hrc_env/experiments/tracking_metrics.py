"""From sums per sequence to numbers with intervals, bootstrapped over sequences."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from hrc_env.experiments.tracking_cells import DLT, FULL_STATE, MATCHED
from hrc_env.experiments.tracking_rigs import RIGS
from hrc_env.results import Metric, over
from hrc_env.typing import Floats

TIMING = "timing"
"""The condition under which `Parts` holds microseconds."""
Parts: TypeAlias = dict[tuple[str, str, str], dict[str, Any]]
"""(rig, condition, estimator) to what the cell gave."""
N_RESAMPLED = 1000
_Sums: TypeAlias = Mapping[str, Floats]


def metrics_of(parts: Parts, estimators: list[str]) -> dict[str, Metric]:
    """All metrics of the bench by their dotted names."""
    metrics: dict[str, Metric] = {}
    for (rig, condition, name), part in parts.items():
        if condition == TIMING:
            for batch, times in part.items():
                metrics[f"update_us.{name}.{batch}"] = over(times, "us")
            continue
        for window, sums in part.items():
            for kind, metric in _of_window(sums, name != DLT).items():
                metrics[f"{kind}.{rig}.{window}.{name}"] = metric
    for name in [*estimators, DLT, FULL_STATE]:
        cells = {rig: parts[rig, MATCHED, name][MATCHED] for rig in RIGS}
        metrics[f"ratio_to_bound.{name}"] = _ratio(list(cells.values()))
        for rig, cell in cells.items():
            metrics[f"ratio_to_bound_in.{rig}.{name}"] = _ratio([cell])
    return dict(sorted(metrics.items()))


def _squared_ratio(sums: _Sums) -> Floats:
    return sums["squared"] / sums["bound"]


def _rmse(sums: _Sums) -> Floats:
    return np.sqrt(sums["squared"] / sums["n"])


_WITHOUT_COVARIANCE: dict[str, tuple[str, Callable[[_Sums], Floats]]] = {
    "rmse_m": ("m", _rmse),
    "median_m": ("m", lambda sums: sums["median"] / sums["one"]),
    "mirrored": ("share", lambda sums: sums["mirrored"] / sums["n_frames"]),
}
_WITH_COVARIANCE: dict[str, tuple[str, Callable[[_Sums], Floats]]] = {
    "coverage95": ("share", lambda sums: sums["inside"] / sums["n"]),
    "std_over_rmse": ("-", lambda sums: np.sqrt(sums["trace"] / sums["squared"])),
    "nees": ("-", lambda sums: sums["nees"] / sums["n"] / 3),
}
"""Each as a function of sums over sequences. The median is the mean of the sequences' medians;
NEES is per degree of freedom, 1 if the covariance is right; mirrored is the share of frames in
which the torso's left is where its right is."""


def _of_window(sums: Mapping[str, Any], with_covariance: bool) -> dict[str, Metric]:
    """The metrics of one cell's window."""
    asked = {**_WITHOUT_COVARIANCE, **(_WITH_COVARIANCE if with_covariance else {})}
    out = {}
    for kind, (unit, statistic) in asked.items():
        value, resampled = _bootstrap(sums, statistic)
        low, high = np.percentile(resampled, (2.5, 97.5))
        out[kind] = Metric(value, float(low), float(high), unit, len(sums["n"]))
    return out


def _bootstrap(
    sums: Mapping[str, Any], statistic: Callable[[_Sums], Floats]
) -> tuple[float, Floats]:
    """A statistic of all sequences, and of 1000 draws of as many with replacement."""
    arrays = {name: np.array(v) for name, v in sums.items() if np.ndim(v) == 1}
    n = len(arrays["n"])
    arrays["one"] = np.ones(n)
    draws = np.random.default_rng(0).integers(n, size=(N_RESAMPLED, n))
    value = statistic({name: array.sum() for name, array in arrays.items()})
    return float(value), statistic({name: v[draws].sum(1) for name, v in arrays.items()})


def _ratio(cells: list[Mapping[str, Any]]) -> Metric:
    """RMSE over its bound: root of the mean of the squared ratios over rigs."""
    ratios = [_bootstrap(cell, _squared_ratio) for cell in cells]
    value = float(np.sqrt(np.mean([value for value, _ in ratios])))
    resampled = np.sqrt(np.mean([draws for _, draws in ratios], axis=0))
    low, high = np.percentile(resampled, (2.5, 97.5))
    return Metric(value, float(low), float(high), "-", sum(len(cell["n"]) for cell in cells))
