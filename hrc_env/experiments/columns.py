"""Columns of tables, each with its metric, the computation of the metric, and its format.

For example, `mean("cost", "cost")` is the mean cost of a row's episodes. Its heading is "cost", and
its name in results.json is `ROW.cost`. All intervals are 95 % intervals
(`hrc_env.evaluation.intervals`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypedDict, Unpack

import numpy as np

from hrc_env.core.errors import check_names
from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.evaluation import intervals
from hrc_env.evaluation.sums import ACHIEVED, FAILED, STATISTICS, UNITS

Episodes = Sequence[Mapping[str, float]]
"""Statistics of episodes (`hrc_env.evaluation.sums`), in the order of their seeds."""
Key = str | tuple[str, ...]
"""Key of a row, which replaces `{}`, or `{0}` and `{1}`, in the names of its metrics."""
Measure = Callable[[Episodes, Episodes], Metric]
"""Function that computes a metric from the episodes of a row and of its baseline, which have the
same seeds."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table."""

    metric: str
    """Name of the metric, with the placeholder `{}` for the row's key, or `{0}` and `{1}` for the
    parts of the key."""
    heading: str = ""
    """Heading with the unit, as "cost [1/min]"; "" for a metric that only results.json contains."""
    digits: int = 1
    """Number of decimals."""
    scale: float = 1.0
    """Factor that converts the unit of the metric to that of the heading."""
    signed: bool = False
    """Whether the metric is a difference, which is always shown with a sign."""
    marked: bool = True
    """Whether a difference is marked with a dot if its interval excludes zero."""
    counted: bool = False
    """Whether the metric counts rare events. The interval of such a metric is always shown."""
    plain: bool = False
    """Whether the interval is never shown."""
    shows: Literal["value", "n", "count"] = "value"
    """Number to show: the value, the number of observations, or a fraction in the form "8 of 9"."""
    beside: str = ""
    """Name of another metric, the value of which is shown in brackets instead of an interval."""
    measure: Measure | None = None
    """Function that computes the metric; None: the study or another column computes it."""
    is_paired: bool = False
    """Whether `measure` compares the row with its baseline."""

    def list_metrics(self, row: Key) -> list[str]:
        """Return the names of a row's metrics: that of the column and, if any, `beside`.

        Args:
            row: key of the row.
        """
        keys = (row,) if isinstance(row, str) else row
        return [each.format(*keys) for each in (self.metric, self.beside) if each]


class Shown(TypedDict, total=False):
    """Fields of `Column` that determine its format."""

    digits: int
    scale: float
    counted: bool
    plain: bool


def mean(
    statistic: str,
    heading: str = "",
    name: str = "",
    unit: str | None = None,
    **shown: Unpack[Shown],
) -> Column:
    """Return a column with the mean of a statistic over episodes.

    Args:
        statistic: one of `STATISTICS`.
        heading: heading of the column; "" hides the column in tables.
        name: name of the metric (default: that of the statistic).
        unit: unit of the metric (default: that of the statistic).
        shown: fields of `Column`.
    """
    check_names("statistic", [statistic], STATISTICS)
    metric_unit = UNITS.get(statistic, "1") if unit is None else unit
    return _make_column(
        name or statistic,
        heading,
        lambda own, _: intervals.estimate_mean(_get_values(own, statistic), metric_unit),
        **shown,
    )


def per_minute(
    statistic: str,
    heading: str = "",
    name: str = "",
    unit: str | None = None,
    **shown: Unpack[Shown],
) -> Column:
    """Return a column with the sum of a statistic over episodes, per minute of their duration.

    Args:
        statistic: one of `STATISTICS`. For the achievements of a task
            (`hrc_env.evaluation.sums.ACHIEVED`), the interval of a rate of zero is exact.
        heading: heading of the column; "" hides the column in tables.
        name: name of the metric (default: `STATISTIC_per_minute`).
        unit: unit of the metric (default: that of the statistic, per minute).
        shown: fields of `Column`.
    """
    check_names("statistic", [statistic], STATISTICS)
    over = intervals.estimate_goal_rate if statistic == ACHIEVED else None
    counted_in = f"{UNITS.get(statistic, '1')}/min" if unit is None else unit

    def measure(own: Episodes, _: Episodes) -> Metric:
        values, minutes = _get_values(own, statistic), _get_values(own, "seconds") / 60
        return (
            over(values, minutes) if over else intervals.estimate_ratio(values, minutes, counted_in)
        )

    return _make_column(name or f"{statistic}_per_minute", heading, measure, **shown)


def rate(
    statistics: str | Sequence[str],
    heading: str = "",
    name: str = "",
    per: str = "episode",
    **shown: Unpack[Shown],
) -> Column:
    """Return a column with the rate of rare events and its exact interval.

    Args:
        statistics: one of `STATISTICS`, or several that are added.
        heading: heading of the column; "" hides the column in tables.
        name: name of the metric (default: that of the first statistic).
        per: name of the exposure in `EXPOSURES`.
        shown: fields of `Column`.
    """
    names = (statistics,) if isinstance(statistics, str) else tuple(statistics)
    check_names("statistic", names, STATISTICS)
    check_names("exposure", [per], EXPOSURES)
    exposure = EXPOSURES[per]

    def measure(own: Episodes, _: Episodes) -> Metric:
        counts = np.sum([_get_values(own, name) for name in names], axis=0)
        return intervals.estimate_rate(counts, exposure.measure(own), exposure.unit)

    return _make_column(name or names[0], heading, measure, **{"counted": True, **shown})


class Exposure(NamedTuple):
    """The amount of time, or the number of episodes, in which rare events are counted."""

    unit: str
    """Unit of a count divided by the exposure."""
    measure: Callable[[Episodes], float | Floats]
    """Function that returns the exposure of episodes."""


EXPOSURES: dict[str, Exposure] = {
    "episode": Exposure("1", len),
    "1000 episodes": Exposure("per 1000", lambda episodes: len(episodes) / 1000),
    "hour": Exposure("1/h", lambda episodes: _get_values(episodes, "seconds") / 3600),
}
"""Exposures for rates of rare events, by name."""


def share_of_episodes(statistic: str, heading: str = "", **shown: Unpack[Shown]) -> Column:
    """Return a column with the fraction of episodes in which a statistic is not zero.

    Args:
        statistic: one of `STATISTICS`.
        heading: heading of the column; "" hides the column in tables.
        shown: fields of `Column`.
    """
    check_names("statistic", [statistic], STATISTICS)

    def measure(own: Episodes, _: Episodes) -> Metric:
        return intervals.estimate_share([bool(each[statistic]) for each in own])

    return _make_column(statistic, heading, measure, **shown)


def share_of_tries(heading: str = "", clustered: bool = True, **shown: Unpack[Shown]) -> Column:
    """Return the column "success", the fraction of a task's attempts that succeeded.

    Args:
        heading: heading of the column; "" hides the column in tables.
        clustered: whether attempts in one episode are dependent and the interval is computed over
            episodes; otherwise every attempt counts as a trial.
        shown: fields of `Column`.
    """

    def measure(own: Episodes, _: Episodes) -> Metric:
        achieved, failed = _get_values(own, ACHIEVED), _get_values(own, FAILED)
        if clustered:
            return intervals.estimate_success(achieved, achieved + failed)
        return intervals.estimate_share([True] * int(achieved.sum()) + [False] * int(failed.sum()))

    return _make_column("success", heading, measure, **shown)


def share_of_baseline(
    statistic: str, heading: str = "", name: str = "share", **shown: Unpack[Shown]
) -> Column:
    """Return a column with a sum over episodes, divided by that of the baseline on the same seeds.

    Args:
        statistic: one of `STATISTICS`.
        heading: heading of the column; "" hides the column in tables.
        name: name of the metric.
        shown: fields of `Column`.
    """
    check_names("statistic", [statistic], STATISTICS)

    def measure(own: Episodes, theirs: Episodes) -> Metric:
        return intervals.estimate_ratio(
            _get_values(own, statistic), _get_values(theirs, statistic), "share"
        )

    return _make_column(name, heading, measure, is_paired=True, **shown)


def difference_from_baseline(
    statistic: str, heading: str = "", name: str = "", unit: str = "1", **shown: Unpack[Shown]
) -> Column:
    """Return a column with the mean difference from the baseline on the same seeds.

    Args:
        statistic: one of `STATISTICS`.
        heading: heading of the column; "" hides the column in tables.
        name: name of the metric (default: `difference.STATISTIC`).
        unit: unit of the metric.
        shown: fields of `Column`.
    """
    check_names("statistic", [statistic], STATISTICS)

    def measure(own: Episodes, theirs: Episodes) -> Metric:
        both = [*_get_values(own, statistic), *_get_values(theirs, statistic)]
        ratio = intervals.make_ratio(both, np.ones(len(both)))
        return intervals.compare_paired("it", ratio, len(own), unit)["difference.it"]

    name = name or f"difference.{statistic}"
    return _make_column(name, heading, measure, is_paired=True, signed=True, **shown)


def _make_column(
    name: str,
    heading: str,
    measure: Measure,
    is_paired: bool = False,
    signed: bool = False,
    **shown: Unpack[Shown],
) -> Column:
    """Return a column for the metric `ROW.name`."""
    return Column(
        f"{{}}.{name}", heading, measure=measure, is_paired=is_paired, signed=signed, **shown
    )


def _get_values(episodes: Episodes, statistic: str) -> Floats:
    """Return the values (n,) of a statistic, one per episode."""
    return np.array([each[statistic] for each in episodes], float)
