"""Common functions of the benchmarks for normalized errors, tables and names of metrics."""

from collections.abc import Iterable

import numpy as np

from hrc_env.core.results import Metric
from hrc_env.core.typing import Covariances3, Floats, Points3
from hrc_env.experiments.report import format_interval
from hrc_env.tasks import BUILT_IN

TASKS = tuple(dict.fromkeys((
    "HRCReach-v0", "HRCReachGoal-v0", "HRCPickPlace-v0", "HRCPickPlaceGoal-v0", "HRCHandover-v0",
    "HRCDrywall-v0", "HRCDelivery-v0", *BUILT_IN,
)))  # fmt: skip
"""Ids of all built-in tasks, in their order in tables."""
CHI2_95_3D = 7.815
"""Squared Mahalanobis radius of the 95 % region of a normal distribution in three dimensions."""


def make_exact(value: float, unit: str, n: int = 1) -> Metric:
    """Return a metric without a confidence interval."""
    return Metric(float(value), float(value), float(value), unit, n)


def compute_normalized_square(offset: Points3, cov: Covariances3) -> Floats:
    """Return squared Mahalanobis distances (...,) of offsets (..., 3), given their covariances."""
    return np.einsum("...i,...ij,...j->...", offset, np.linalg.inv(cov), offset)


def list_endings(metrics: Iterable[str], start: str) -> list[str]:
    """Return the names that begin with `start`, with this prefix removed."""
    return [name.removeprefix(start) for name in metrics if name.startswith(start)]


def format_number(
    metric: Metric | None, scale: float = 1.0, digits: int = 1, interval: bool = False
) -> str:
    """Format a metric for a table, with its interval if requested; return "" for None."""
    if metric is None:
        return ""
    ends = (metric.low, metric.high) if interval else (metric.value, metric.value)
    low, high = (scale * end for end in ends)
    return format_interval(scale * metric.value, low, high, digits)
