"""Columns of tables: which number of a row stands there, how it is counted, and how it is shown.

`mean("cost", "cost")` is the mean cost of a row's episodes, under the heading "cost", and is
called `ROW.cost` in results.json. All intervals are 95 % (`hrc_env.evaluation.intervals`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypedDict, Unpack

import numpy as np

from hrc_env.core.errors import check_names
from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.evaluation import intervals
from hrc_env.evaluation.sums import ACHIEVED, FAILED, STATISTICS, UNITS

Episodes = Sequence[Mapping[str, float]]
"""Statistics of episodes (`hrc_env.evaluation.sums`), in the order of their seeds."""
Key = str | tuple[str, ...]
"""Of a row: what stands in the names of its metrics in place of `{}`, or of `{0}` and `{1}`."""
Measure = Callable[[Episodes, Episodes], Metric]
"""A number of a row's episodes; beside them those of its baseline on the same seeds."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table."""

    metric: str
    """Name of the metric, with `{}` in place of the row's key, or `{0}` and `{1}` of its two."""
    heading: str = ""
    """With its unit, as "cost [1/min]"; "" of a number that results.json alone has."""
    digits: int = 1
    scale: float = 1.0
    """Factor from the metric's unit to the heading's."""
    signed: bool = False
    """Whether it is a difference, which has its sign."""
    marked: bool = True
    """Whether a difference has a dot where its interval leaves out zero."""
    counted: bool = False
    """Whether it counts rare events, so that its interval is always shown."""
    plain: bool = False
    """Whether its interval is never shown."""
    shows: Literal["value", "n", "count"] = "value"
    """The value; or the number of observations; or a share of them as "8 of 9"."""
    beside: str = ""
    """Name of another metric, whose value stands behind in brackets in place of an interval."""
    measure: Measure | None = None
    """How it is counted; None: the study counts it by itself, or another column does."""
    is_paired: bool = False
    """Whether `measure` compares the row with its baseline."""

    def names(self, row: Key) -> list[str]:
        """Return the metrics of a row: that of the column, and the one beside it.

        Args:
            row: key of the row.
        """
        keys = (row,) if isinstance(row, str) else row
        return [each.format(*keys) for each in (self.metric, self.beside) if each]


class Shown(TypedDict, total=False):
    """How a column is shown; fields of `Column`."""

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
    """Return the column of a mean over episodes.

    Args:
        statistic: one of `STATISTICS`.
        heading: of the column; "": it is not shown.
        name: of the metric; the statistic's own if not given.
        unit: of the metric; None: the statistic's own.
        shown: fields of `Column`.
    """
    check_names("statistic", [statistic], STATISTICS)
    counted_in = UNITS.get(statistic, "1") if unit is None else unit
    return _column(
        name or statistic,
        heading,
        lambda own, _: intervals.estimate_mean(_values(own, statistic), counted_in),
        **shown,
    )


def per_minute(
    statistic: str,
    heading: str = "",
    name: str = "",
    unit: str | None = None,
    **shown: Unpack[Shown],
) -> Column:
    """Return the column of a sum over episodes, by the minutes that they took.

    Args:
        statistic, heading, name, unit, shown: as of `mean`. What a task achieves
            (`hrc_env.evaluation.sums.ACHIEVED`) has an exact interval where it is zero.
    """
    check_names("statistic", [statistic], STATISTICS)
    over = intervals.estimate_goal_rate if statistic == ACHIEVED else None
    counted_in = f"{UNITS.get(statistic, '1')}/min" if unit is None else unit

    def measure(own: Episodes, _: Episodes) -> Metric:
        values, minutes = _values(own, statistic), _values(own, "seconds") / 60
        return over(values, minutes) if over else intervals.estimate_ratio(values, minutes, counted_in)

    return _column(name or f"{statistic}_per_minute", heading, measure, **shown)


def rate(
    statistics: str | Sequence[str],
    heading: str = "",
    name: str = "",
    per: str = "episode",
    **shown: Unpack[Shown],
) -> Column:
    """Return the column of how often something rare happened, with an exact interval.

    Args:
        statistics: one of `STATISTICS`, or several that are added.
        heading, name, shown: as of `mean`.
        per: what is counted in: a name in `EXPOSURES`.
    """
    names = (statistics,) if isinstance(statistics, str) else tuple(statistics)
    check_names("statistic", names, STATISTICS)
    check_names("exposure", [per], EXPOSURES)
    unit, exposure = EXPOSURES[per]

    def measure(own: Episodes, _: Episodes) -> Metric:
        counts = np.sum([_values(own, each) for each in names], axis=0)
        return intervals.estimate_rate(counts, exposure(own), unit)

    return _column(name or names[0], heading, measure, **{"counted": True, **shown})


EXPOSURES: dict[str, tuple[str, Callable[[Episodes], float | Floats]]] = {
    "episode": ("1", len),
    "1000 episodes": ("per 1000", lambda own: len(own) / 1000),
    "hour": ("1/h", lambda own: _values(own, "seconds") / 3600),
}
"""Units, and how much there is of each in episodes: what rare events are counted in."""


def share_of_episodes(statistic: str, heading: str = "", **shown: Unpack[Shown]) -> Column:
    """Return the column of the share of episodes of which a statistic is not zero.

    Args:
        statistic, heading, shown: as of `mean`.
    """
    check_names("statistic", [statistic], STATISTICS)

    def measure(own: Episodes, _: Episodes) -> Metric:
        return intervals.estimate_share([bool(each[statistic]) for each in own])

    return _column(statistic, heading, measure, **shown)


def share_of_tries(heading: str = "", clustered: bool = True, **shown: Unpack[Shown]) -> Column:
    """Return the column "success": the share of a task's tries that succeeded.

    Args:
        heading, shown: as of `mean`.
        clustered: whether tries in one episode are alike, so that the interval is one over
            episodes; if not, it is that of as many trials as there were tries.
    """

    def measure(own: Episodes, _: Episodes) -> Metric:
        achieved, failed = _values(own, ACHIEVED), _values(own, FAILED)
        if clustered:
            return intervals.estimate_success(achieved, achieved + failed)
        return intervals.estimate_share([True] * int(achieved.sum()) + [False] * int(failed.sum()))

    return _column("success", heading, measure, **shown)


def share_of_baseline(
    statistic: str, heading: str = "", name: str = "share", **shown: Unpack[Shown]
) -> Column:
    """Return the column of a sum as a share of the baseline's on the same seeds.

    Args:
        statistic, heading, name, shown: as of `mean`.
    """
    check_names("statistic", [statistic], STATISTICS)

    def measure(own: Episodes, theirs: Episodes) -> Metric:
        return intervals.estimate_ratio(_values(own, statistic), _values(theirs, statistic), "share")

    return _column(name, heading, measure, is_paired=True, **shown)


def less_baseline(
    statistic: str, heading: str = "", name: str = "", unit: str = "1", **shown: Unpack[Shown]
) -> Column:
    """Return the column of the mean difference from the baseline, seed by seed.

    Args:
        statistic, heading, unit, shown: as of `mean`.
        name: of the metric; `difference.STATISTIC` if not given.
    """
    check_names("statistic", [statistic], STATISTICS)

    def measure(own: Episodes, theirs: Episodes) -> Metric:
        both = [*_values(own, statistic), *_values(theirs, statistic)]
        ratio = intervals.make_ratio(both, np.ones(len(both)))
        return intervals.compare_paired("it", ratio, len(own), unit)["difference.it"]

    name = name or f"difference.{statistic}"
    return _column(name, heading, measure, is_paired=True, signed=True, **shown)


def _column(
    name: str,
    heading: str,
    measure: Measure,
    is_paired: bool = False,
    signed: bool = False,
    **shown: Unpack[Shown],
) -> Column:
    """Return the column of the metric `ROW.name`."""
    return Column(
        f"{{}}.{name}", heading, measure=measure, is_paired=is_paired, signed=signed, **shown
    )


def _values(episodes: Episodes, statistic: str) -> Floats:
    """Return a statistic of every episode (n,)."""
    return np.array([each[statistic] for each in episodes], float)
