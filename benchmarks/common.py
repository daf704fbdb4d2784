"""What the benches share: checks of how much is asked, cells of tables, pictures, shares."""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.console import Console
from rich.markdown import Markdown

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, write_results
from hrc_env.core.typing import Covariances3, Floats, Points3
from hrc_env.experiments.study.page import Part, Section, Table, write_report

Metrics = Mapping[str, Metric]
CHI2_95_3D = 7.815
"""95 % of a three-dimensional normal variable lies within this squared distance."""


def check_positive(config: Any, *names: str) -> None:
    """Raise `ConfigError` unless these fields of a config are 1 or more."""
    for name in names:
        if getattr(config, name) < 1:
            raise ConfigError(f"{name} must be at least 1, got {getattr(config, name)}.")


def exactly(value: float, unit: str, n: int = 1) -> Metric:
    """A number without a spread."""
    return Metric(float(value), float(value), float(value), unit, n)


def share(seen: Sequence[bool]) -> Metric:
    """A share with Wilson's 95 % interval; NaN of nothing."""
    n = len(seen)
    if n == 0:
        return exactly(math.nan, "share", 0)
    p, z = float(np.mean(seen)), 1.96
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * math.sqrt(p * (1 - p) / n + (z / (2 * n)) ** 2) / (1 + z * z / n)
    return Metric(p, middle - half, middle + half, "share", n)


def normalised_square(offset: Points3, cov: Covariances3) -> Floats:
    """Squared errors (...,) of (..., 3) in units of covariances (..., 3, 3)."""
    return np.einsum("...i,...ij,...j->...", offset, np.linalg.inv(cov), offset)


def keys(metrics: Iterable[str], start: str) -> list[str]:
    """What comes after `start` in the names that begin so."""
    return [name.removeprefix(start) for name in metrics if name.startswith(start)]


def cell(metric: Metric | None, scale: float = 1.0, digits: int = 1, interval: bool = False) -> str:
    """A number as tables show it, with its interval if asked; nothing of what is not known."""
    if metric is None:
        return ""
    value, low, high = (
        f"{scale * each:,.{digits}f}" for each in (metric.value, metric.low, metric.high)
    )
    return f"{value} ({low}-{high})" if interval else value


def table(header: Iterable[str], rows: Iterable[Iterable[str]]) -> Table:
    """A table from whatever holds its words."""
    return Table(tuple(header), tuple(tuple(row) for row in rows))


def grid(axis: Axes, which: str = "both") -> None:
    """Pale lines behind what is drawn."""
    axis.grid(True, axis=which, color="0.9")  # pyright: ignore[reportArgumentType]
    axis.set_axisbelow(True)


def save(figure: Figure, path: Path, title: str) -> None:
    """Write a picture."""
    figure.suptitle(title, fontsize=14)
    FigureCanvasAgg(figure)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)


def publish(
    out: Path,
    title: str,
    parts: Sequence[Part],
    config: Mapping[str, Any],
    seeds: Sequence[int],
    metrics: Metrics,
) -> None:
    """Write results.json, report.html and report.md into a folder; show the report."""
    write_results(out / "results.json", {**config, "out": str(out)}, seeds, metrics)
    write_report(out, title, "", [Section("Measured", tuple(parts))])
    Console().print(Markdown((out / "report.md").read_text()))
