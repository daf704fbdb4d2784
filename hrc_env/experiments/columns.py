"""Columns of tables, each with its metric, the computation of the metric, and its format.

For example, `mean("cost", "cost")` is the mean cost of a row's episodes. Its heading is "cost", and
its name in results.json is `ROW.cost`. All intervals are 95 % intervals
(`hrc_env.evaluation.intervals`). Statistics that count rare events (`RARE`) have exact intervals in
every kind of column, never bootstraps.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, TypedDict, Unpack

import numpy as np

from hrc_env.core.errors import check_names
from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.evaluation import intervals
from hrc_env.evaluation.sums import (
    ABOVE,
    ACHIEVED,
    APPROACHES,
    FAILED,
    INTERVENTIONS,
    RARE,
    RATED,
    STATISTICS,
    UNITS,
)
from hrc_env.safety.incidents import KINDS

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
    """Whether a difference is marked with a dot if its p-value, adjusted for all contrasts of the
    study, is below .05 (`hrc_env.evaluation.intervals.adjust_holm`)."""
    counted: bool = False
    """Whether the metric counts rare events. The interval of such a metric is always shown."""
    plain: bool = False
    """Whether the interval is never shown."""
    shows: Literal["value", "n", "count", "value of n"] = "value"
    """Number to show: the value, the number of observations, a fraction in the form "8 of 9", or
    the value with its interval and the number of observations, "2.4 (0.1 to 12.9) of 41"."""
    beside: str = ""
    """Name of another metric, the value of which is shown in brackets instead of an interval."""
    measure: Measure | None = None
    """Function that computes the metric; None: the study or another column computes it."""
    is_paired: bool = False
    """Whether `measure` compares the row with its baseline."""
    test: Measure | None = None
    """Function that computes the p-value of a difference; None: there is no test."""

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

    def measure(own: Episodes, _: Episodes) -> Metric:
        values, ones = _get_values(own, statistic), np.ones(len(own))
        if statistic == "success":
            return replace(intervals.estimate_share_of(values, ones), unit=metric_unit)
        return _estimate(statistic, values, ones, metric_unit)

    return _make_column(name or statistic, heading, measure, **shown)


def per_minute(
    statistic: str,
    heading: str = "",
    name: str = "",
    unit: str | None = None,
    **shown: Unpack[Shown],
) -> Column:
    """Return a column with the sum of a statistic over episodes, per minute of their duration.

    Args:
        statistic: one of `STATISTICS`.
        heading: heading of the column; "" hides the column in tables.
        name: name of the metric (default: `STATISTIC_per_minute`).
        unit: unit of the metric (default: that of the statistic, per minute).
        shown: fields of `Column`.
    """
    check_names("statistic", [statistic], STATISTICS)
    counted_in = f"{UNITS.get(statistic, '1')}/min" if unit is None else unit

    def measure(own: Episodes, _: Episodes) -> Metric:
        minutes = _get_values(own, "seconds") / 60
        return _estimate(statistic, _get_values(own, statistic), minutes, counted_in)

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
        known = [each[statistic] for each in own if not math.isnan(each[statistic])]
        return intervals.estimate_share([bool(value) for value in known])

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
            return intervals.estimate_clustered_share(achieved, achieved + failed, "1")
        return intervals.estimate_share_of(achieved, achieved + failed)

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
        ours, others = _get_values(own, statistic), _get_values(theirs, statistic)
        if statistic in RARE:
            return intervals.estimate_rate_ratio(ours, others, len(own), len(theirs))
        return intervals.estimate_ratio(ours, others, "share")

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

    def compare(own: Episodes, theirs: Episodes) -> intervals.Comparison:
        ours, others = _get_values(own, statistic), _get_values(theirs, statistic)
        if statistic in RARE:
            return intervals.compare_rates(ours, others, len(own), len(theirs), unit)
        return intervals.compare_means(ours, others, unit)

    def test(own: Episodes, theirs: Episodes) -> Metric:
        p = compare(own, theirs).p
        return Metric(p, p, p, "p", len(own))

    column = _make_column(
        name or f"difference.{statistic}",
        heading,
        lambda own, theirs: compare(own, theirs).difference,
        is_paired=True,
        **shown,
    )
    return replace(column, signed=True, test=test)


def share_above_force_limit(
    heading: str = "contacts above the force limit [%]", **shown: Unpack[Shown]
) -> Column:
    """Return the column "above_force_limit", the fraction of severe contacts.

    These are contacts with an estimated force above the limit of the touched body region
    (`safety/contact_force_ratio` > 1). The interval is exact, and the number of contacts is shown
    beside it; without contacts, there is no fraction.

    Args:
        heading: heading of the column; "" hides the column in tables.
        shown: fields of `Column`.
    """

    def measure(own: Episodes, _: Episodes) -> Metric:
        return intervals.estimate_share_of(_get_values(own, ABOVE), _get_values(own, RATED))

    column = _make_column(
        "above_force_limit", heading, measure, **{"scale": 100, "counted": True, **shown}
    )
    return replace(column, shows="value of n")


def interventions(heading: str = "interventions [1/h]", **shown: Unpack[Shown]) -> Column:
    """Return the column "interventions_per_hour", the rate at which the shield becomes active.

    An intervention begins when `shield/active` rises from 0 to 1. Rows without a shield have no
    number.

    Args:
        heading: heading of the column; "" hides the column in tables.
        shown: fields of `Column`.
    """

    def measure(own: Episodes, _: Episodes) -> Metric:
        hours = _get_values(own, "seconds") / 3600
        return intervals.estimate_burst_rate(_get_values(own, INTERVENTIONS), hours, "1/h")

    return _make_column(
        "interventions_per_hour", heading, measure, **{"digits": 0, "counted": True, **shown}
    )


def list_safety_columns() -> tuple[Column, ...]:
    """Return the columns of contacts by kind, severe contacts and interventions in an hour."""
    kinds = (
        rate(f"contacts_{kind}", f"contacts {kind} [1/h]", f"{kind}_per_hour", "hour")
        for kind in KINDS
    )
    every = [f"contacts_{kind}" for kind in KINDS]
    return (
        *kinds,
        rate(every, "contacts [1/h]", "contacts_per_hour", "hour"),
        share_above_force_limit(),
        interventions(),
    )


def _estimate(statistic: str, values: Floats, exposure: Floats, unit: str) -> Metric:
    """Return the sum of a statistic per exposure, with the interval that its kind requires."""
    if statistic in RARE:
        return intervals.estimate_rate(values, exposure, unit)
    if statistic in (INTERVENTIONS, APPROACHES):
        return intervals.estimate_burst_rate(values, exposure, unit)
    if statistic in (ACHIEVED, FAILED):
        return intervals.estimate_goal_rate(values, exposure, unit)
    return intervals.estimate_ratio(values, exposure, unit)


def _make_column(
    name: str,
    heading: str,
    measure: Measure,
    is_paired: bool = False,
    **shown: Unpack[Shown],
) -> Column:
    """Return a column for the metric `ROW.name`."""
    return Column(f"{{}}.{name}", heading, measure=measure, is_paired=is_paired, **shown)


def _get_values(episodes: Episodes, statistic: str) -> Floats:
    """Return the values (n,) of a statistic, one per episode."""
    return np.array([each[statistic] for each in episodes], float)
