"""What the benches share: normalised errors, cells of tables, a way to show results."""

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
"""All built-in tasks in the order of tables."""
CHI2_95_3D = 7.815
"""95 % of a three-dimensional normal variable lies within this squared distance."""


def exactly(value: float, unit: str, n: int = 1) -> Metric:
    """A number without a spread."""
    return Metric(float(value), float(value), float(value), unit, n)


def normalised_square(offset: Points3, cov: Covariances3) -> Floats:
    """Squared errors (...,) of (..., 3) in units of covariances (..., 3, 3)."""
    return np.einsum("...i,...ij,...j->...", offset, np.linalg.inv(cov), offset)


def keys(metrics: Iterable[str], start: str) -> list[str]:
    """What comes after `start` in the names that begin so."""
    return [name.removeprefix(start) for name in metrics if name.startswith(start)]


def format_cell(metric: Metric | None, scale: float = 1.0, digits: int = 1, interval: bool = False) -> str:
    """A number as tables show it, with its interval if asked; nothing of what is not known."""
    if metric is None:
        return ""
    ends = (metric.low, metric.high) if interval else (metric.value, metric.value)
    return format_interval(*(scale * each for each in (metric.value, *ends)), digits)
