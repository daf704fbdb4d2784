"""The figures that long tests measure: one table for a run, also in out/tests/figures.json."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from commands import ROOT
from scipy.stats import binomtest

from hrc_env.core.results import Metric

OUT = ROOT / "out" / "tests" / "figures.json"
PROPERTY = "figure"
"""The name under which a figure travels in the properties of a test's report."""


@dataclass(frozen=True)
class Figure:
    """A measured number with its 95 % interval, and the bound within which that has to lie."""

    name: str
    metric: Metric
    least: float | None = None
    """The lowest value that the whole interval may have; None is no bound."""
    most: float | None = None
    """The highest value that the whole interval may have; None is no bound."""

    def is_held(self) -> bool:
        """Return whether the whole interval lies within the bound; NaN never does."""
        low, high = self.metric.low, self.metric.high
        is_above = not np.isnan(low) if self.least is None else low >= self.least
        is_below = not np.isnan(high) if self.most is None else high <= self.most
        return bool(is_above and is_below)

    def __str__(self) -> str:
        ends = f"{self.metric.low:.4g} to {self.metric.high:.4g}"
        bounds = ((self.least, "at least"), (self.most, "at most"))
        asked = [f"{word} {end:g}" for end, word in bounds if end is not None]
        return (
            f"{self.name:45s} {self.metric.value:10.4g} ({ends}) {self.metric.unit}, "
            f"n = {self.metric.n}; asked: {' and '.join(asked) or 'nothing'}"
        )


def count(events: int, trials: int) -> Metric:
    """Return the share of trials that had an event, with its exact 95 % interval."""
    ends = binomtest(events, trials).proportion_ci(0.95, method="exact")
    return Metric(events / trials, float(ends.low), float(ends.high), "share", trials)


class Figures:
    """The figures of one test, which its report takes along, also from another process."""

    def __init__(self, properties: list[tuple[str, object]]) -> None:
        self._properties = properties

    def hold(self, *figures: Figure) -> None:
        """Note all figures, and fail if an interval is not within its bound."""
        for figure in figures:
            noted = json.loads(json.dumps(asdict(figure), default=float))  # NumPy's do not travel
            self._properties.append((PROPERTY, {**noted, "line": str(figure)}))
        broken = [str(figure) for figure in figures if not figure.is_held()]
        assert not broken, "beyond their bounds:\n" + "\n".join(broken)


def collect(reports: Iterable[Any]) -> dict[str, dict[str, Any]]:
    """Return the figures that the reports of tests carry, by name."""
    calls = [report for report in reports if getattr(report, "when", "") == "call"]
    pairs = [pair for report in calls for pair in report.user_properties]
    found = [figure for name, figure in pairs if name == PROPERTY]
    return {figure["name"]: figure for figure in found}


def write(figures: Mapping[str, Mapping[str, Any]], path: Path = OUT) -> Sequence[str]:
    """Write the figures of a run as one file, and return the lines of its table."""
    content = {name: {k: v for k, v in each.items() if k not in ("name", "line")}
               for name, each in sorted(figures.items())}  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=1) + "\n")
    return [each["line"] for _, each in sorted(figures.items())]
