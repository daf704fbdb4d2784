"""A report: pictures, tables, and what each column means; as HTML, Markdown and results.json."""

import base64
import html
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, provenance, write_results, write_whole
from hrc_env.experiments.columns import Column
from hrc_env.experiments.plots import stamp

Metrics = Mapping[str, Metric]
_STYLE = """
body { font: 17px/1.55 system-ui, sans-serif; color: #1c2430; max-width: 66rem;
       margin: 2.5rem auto; padding: 0 1.2rem; }
h2 { margin-top: 2.6rem; } img { max-width: 100%; height: auto; }
table { border-collapse: collapse; display: block; overflow-x: auto; font-size: .92rem;
        font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .55rem; border-bottom: 1px solid #d8dde6; text-align: right; }
td { white-space: nowrap; } td:first-child, th:first-child { text-align: left; }
code { background: #f0f2f6; padding: .1rem .3rem; border-radius: 3px; }
"""


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of numbers under one title."""

    name: str
    """By which a page of the documentation asks for it."""
    title: str
    rows: Mapping[str, tuple[str, ...]]
    """Cells before the numbers, by row."""
    columns: Sequence[Column]
    heads: tuple[str, ...] = ("",)
    """Headings of the cells before the numbers."""
    note: str = ""
    """What stands below; `{n[METRIC]}` is how many observations a metric is made of."""

    def check(self, known: Collection[str]) -> None:
        """Raise `ConfigError` for a row that has another number of cells than there are heads, and
        for a column of which no row has a metric."""
        for row, cells in self.rows.items():
            if len(cells) != len(self.heads):
                raise ConfigError(
                    f"Table {self.name!r}: row {row!r} must have a cell for each of the heads "
                    f"{self.heads}, got {cells}."
                )
        for column in self.columns:
            names = [column.metric.format(row) for row in self.rows]
            if not any(name in known for name in names):
                raise ConfigError(
                    f"Table {self.name!r}: no row has the metric {column.metric!r}; a row has "
                    f"{', '.join(sorted({name.rpartition('.')[2] for name in known}))}."
                )

    def note_of(self, metrics: Metrics) -> str:
        """Return the note with its numbers; 0 where rows were left out."""
        return self.note.format(n=defaultdict(int, {k: each.n for k, each in metrics.items()}))

    def markdown(self, metrics: Metrics) -> str:
        """Return the table with its title and note, without rows of which there is no number; "" if
        there are none."""
        lines = [
            (*cells, *(cell(each, metrics, row) for each in self.columns))
            for row, cells in self.rows.items()
            if any(each.metric.format(row) in metrics for each in self.columns)
        ]
        if not lines:
            return ""
        heads = (*self.heads, *(each.heading for each in self.columns))
        parts = (f"**{self.title}**", table(heads, lines), self.note_of(metrics))
        return "\n\n".join(filter(None, parts))


@dataclass(frozen=True, slots=True)
class Report:
    """What a study found."""

    title: str
    asked: str
    """The question and how it is answered."""
    parts: Sequence[str]
    """In the order of reading, as Markdown: paragraphs, headings, tables, pictures."""
    spread: str = "95 % intervals over seeds"
    """What the low and high ends of its numbers are."""
    quick: str = ""
    """The warning of a run that is too short to compare anything, below each
    table and on each figure, which mark no difference then; "" of other runs."""

    def write(
        self, out: Path, settings: Mapping[str, Any], seeds: Sequence[int], metrics: Metrics
    ) -> None:
        """Write results.json, report.md and report.html, which holds its pictures, into `out`."""
        write_results(out / "results.json", settings, seeds, metrics)
        origin = f"Version {provenance()['hrc_env']}, seeds {min(seeds)} to {max(seeds)}; "
        origin += f"numbers are given with {self.spread}, all of them in results.json."
        head, parts = [f"# {self.title}"], [*filter(None, self.parts)]
        if self.quick:
            head.append(f"**{self.quick}**")
            parts = [_as_quick(each, self.quick) for each in parts]
            for name in _FIGURE.findall("\n".join(parts)):
                stamp(out / "figures" / name, self.quick)
        text = "\n\n".join([*head, self.asked, *parts, origin]) + "\n"
        write_whole(out / "report.md", text)
        body = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
        body = re.sub(r'src="([^"]+)"', lambda found: f'src="{_embedded(out, found[1])}"', body)
        page = (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            f"<title>{html.escape(self.title)}</title><style>{_STYLE}</style></head>"
            f"<body>{body}</body></html>"
        )
        write_whole(out / "report.html", page)


def quick_words(
    n: int,
    seconds: float | tuple[float, float],
    what: str = "seed",
    why: str = "too few to compare anything",
) -> str:
    """Return the warning in the report of a short run.

    Args:
        n: number of seeds or other repetitions, at most.
        seconds: that one lasts [s]; (least, most) where they differ.
        what: name of a repetition.
        why: the consequence, for the reader.
    """
    least, most = seconds if isinstance(seconds, tuple) else (seconds, seconds)
    lasting = f"{least:.3g} s" if least == most else f"{least:.3g} to {most:.3g} s"
    return f"Quick run, {n} {what}{'' if n == 1 else 's'} of {lasting}: {why}."


_FIGURE = re.compile(r"\]\(figures/([^)]+)\)")
_TABLE = re.compile(r"^\| ---", re.M)
_DOT = " ●"
"""Behind a difference whose interval leaves out zero."""


def _as_quick(part: str, words: str) -> str:
    """Return a part of a report without marks, and with the words below its table or figure."""
    part = part.replace(_DOT, "")
    is_shown = _TABLE.search(part) or _FIGURE.search(part)
    return f"{part}\n\n*{words}*" if is_shown else part


def picture(path: Path, caption: str) -> str:
    """A PNG in the folder `figures` beside the report, and what it shows."""
    return f"![{caption}](figures/{path.name})\n\n*{caption}*"


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown, whose first column names the rows."""
    lines = [header, ("---", *("---:" for _ in header[1:])), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def table_of(
    name: str, rows: Mapping[str, str], columns: Sequence[Column], metrics: Metrics
) -> str:
    """A table of metrics, "" if there are none; `rows` by the part of their keys in place of `{}`,
    with their words."""
    lines = [
        (words, *(cell(each, metrics, row) for each in columns)) for row, words in rows.items()
    ]
    if not any(each.metric.format(row) in metrics for each in columns for row in rows):
        return ""
    return table((name, *(each.heading for each in columns)), lines)


def cell(column: Column, metrics: Metrics, row: str) -> str:
    """Return the number of a row with its interval; a dash where there is none."""
    metric = metrics.get(column.metric.format(row))
    if metric is None:
        return "-"
    if column.is_n:
        return f"{metric.n:,}"
    if column.plain:
        metric = replace(metric, low=metric.value, high=metric.value)
    is_told_apart = column.signed and (metric.low > 0 or metric.high < 0)
    dot = _DOT if column.marked and is_told_apart else ""
    return format_metric(metric, column.scale, column.digits, column.signed) + dot


def format_metric(metric: Metric, scale: float = 1.0, digits: int = 1, signed: bool = False) -> str:
    """Return a number with its interval, as tables show it; a dash where it is not known."""
    if metric.value != metric.value:
        return "-"
    three = [scale * each for each in (metric.value, metric.low, metric.high)]
    return with_interval(three, digits, *(("+", " to ") if signed else ()))


def with_interval(three: Sequence[float], digits: int, sign: str = "", to: str = "-") -> str:
    """Return a value with the ends of its interval in brackets, which are left out where the digits
    show no width: such an interval would say more than it knows.

    Args:
        three: value, low end, high end.
        digits: how many stand behind the point.
        sign: "+" puts one before positive numbers, too.
        to: stands between the ends.
    """
    value, low, high = (f"{each:{sign}z,.{digits}f}" for each in three)
    return value if value == low == high else f"{value} ({low}{to}{high})"


def _embedded(out: Path, source: str) -> str:
    """A picture's file as a data URI."""
    data = base64.b64encode((out / source).read_bytes()).decode()
    return f"data:image/png;base64,{data}"
