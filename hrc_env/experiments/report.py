"""A report: pictures, tables, and what each column means; as HTML, Markdown and results.json."""

import base64
import html
import math
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, provenance, write_results, write_whole
from hrc_env.experiments.columns import Column, Key
from hrc_env.experiments.plots import stamp

Metrics = Mapping[str, Metric]
Cells = tuple[str, ...]
Rows = Mapping[str, Cells] | Mapping[tuple[str, ...], Cells] | Mapping[Key, Cells]
"""Cells before the numbers of each row, by its key."""
_STYLE = """
body { font: 17px/1.55 system-ui, sans-serif; color: #1c2430; max-width: 66rem;
       margin: 2.5rem auto; padding: 0 1.2rem; }
h2 { margin-top: 2.6rem; } img { max-width: 100%; height: auto; }
table { border-collapse: collapse; display: block; overflow-x: auto; font-size: .92rem;
        font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .55rem; border-bottom: 1px solid #d8dde6; text-align: left; }
td { white-space: nowrap; }
code { background: #f0f2f6; padding: .1rem .3rem; border-radius: 3px; }
"""


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of numbers under one title, in a report and in the documentation."""

    name: str
    """By which a page of the documentation asks for it."""
    title: str
    rows: Rows
    """Cells before the numbers, by key."""
    columns: Sequence[Column]
    heads: tuple[str, ...] = ("",)
    """Headings of the cells before the numbers."""
    note: str = ""
    """What stands below; `{n[METRIC]}` is how many observations a metric is made of, `{NAME}` one
    of `numbers`."""
    numbers: Mapping[str, Column] = field(default_factory=dict)
    """By name: numbers in the note, and in sentences of the documentation."""
    printed: Mapping[str, float] = field(default_factory=dict)
    """Numbers that others report, by names of metrics."""

    def check(self, known: Collection[str]) -> None:
        """Raise `ConfigError` for a row that has another number of cells than there are heads, for
        a column of which no row has a metric, and for one of `numbers` that has none.

        Args:
            known: names of metrics.
        """
        for row, cells in self.rows.items():
            if len(cells) != len(self.heads):
                raise ConfigError(
                    f"Table {self.name!r}: row {row!r} must have a cell for each of the heads "
                    f"{self.heads}, got {cells}."
                )
        shown = [(each.metric, [each.names(row) for row in self.rows]) for each in self.columns]
        shown += [(each.metric, [each.names(())]) for each in self.numbers.values()]
        for metric, names in shown:
            if not any({*each} <= {*known, *self.printed} for each in names):
                raise ConfigError(
                    f"Table {self.name!r}: no row has the metric {metric!r}; a row has "
                    f"{', '.join(sorted({name.rpartition('.')[2] for name in known}))}."
                )

    def asked(self) -> set[str]:
        """Return the names of all metrics that it can show."""
        found = {name for row in self.rows for each in self.columns for name in each.names(row)}
        return (found | {each.metric for each in self.numbers.values()}) - self.printed.keys()

    def number(self, name: str, metrics: Metrics) -> str:
        """Return one of `numbers` as sentences have it.

        Args:
            name: of the number.
            metrics: by name.
        """
        return cell(self.numbers[name], metrics, ())

    def note_of(self, metrics: Metrics) -> str:
        """Return the note with its numbers; 0 where rows were left out."""
        n = defaultdict(int, {name: each.n for name, each in metrics.items()})
        return self.note.format(n=n, **{name: self.number(name, metrics) for name in self.numbers})

    def markdown(self, metrics: Metrics, intervals: bool = True) -> str:
        """Return the table with its title and note, without rows of which there is no number; "" if
        there are none.

        Args:
            metrics: by name.
            intervals: whether those are shown that do not count rare events.
        """
        known = {name: Metric(value, value, value, "", 1) for name, value in self.printed.items()}
        known |= metrics
        columns = (
            self.columns if intervals else [replace(c, plain=not c.counted) for c in self.columns]
        )
        lines = lines_of(self.rows, columns, known)
        if not lines:
            return ""
        heads = (*self.heads, *(each.heading for each in columns))
        shown = table(heads, lines, len(self.heads))
        return "\n\n".join(filter(None, (f"**{self.title}**", shown, self.note_of(metrics))))


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
_TABLE = re.compile(r"^\|---", re.M)
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


def table(header: Sequence[str], rows: Iterable[Sequence[str]], n_heads: int = 1) -> str:
    """Return a table in Markdown.

    Args:
        header: headings of the columns.
        rows: cells.
        n_heads: how many columns, the first ones, name the rows.
    """
    lines = [" | ".join(line) for line in (header, *rows)]
    rule = "---|" * n_heads + "---:|" * (len(header) - n_heads)
    return "\n".join([f"| {lines[0]} |", f"|{rule}", *(f"| {line} |" for line in lines[1:])])


def table_of(
    name: str, rows: Mapping[str, str], columns: Sequence[Column], metrics: Metrics
) -> str:
    """Return a table of metrics, "" if there are none.

    Args:
        name: heading of the rows.
        rows: by key, with their words.
        columns: of the metrics.
        metrics: by name.
    """
    lines = lines_of({row: (words,) for row, words in rows.items()}, columns, metrics)
    return table((name, *(each.heading for each in columns)), lines) if lines else ""


def lines_of(rows: Rows, columns: Sequence[Column], metrics: Metrics) -> list[tuple[str, ...]]:
    """Return the cells of the rows of which there is any number.

    Args:
        rows: cells before the numbers, by key.
        columns: of the metrics.
        metrics: by name.
    """
    return [
        (*cells, *(cell(each, metrics, row) for each in columns))
        for row, cells in rows.items()
        if any(each.names(row)[0] in metrics for each in columns)
    ]


def cell(column: Column, metrics: Metrics, row: Key) -> str:
    """Return the number of a row as its column shows it; a dash where there is none.

    Args:
        column: which number, and how it is shown.
        metrics: by name.
        row: key of the row.
    """
    names = column.names(row)
    if not metrics.keys() >= {*names}:
        return "-"
    metric, *others = (metrics[name] for name in names)
    if column.shows == "n":
        return f"{metric.n:,}"
    if column.shows == "count":
        return f"{round(metric.value * metric.n)} of {metric.n}"
    is_plain = column.plain or bool(others)
    shown = replace(metric, low=metric.value, high=metric.value) if is_plain else metric
    text = format_metric(shown, column.scale, column.digits, column.signed)
    for other in others:
        text += f" ({column.scale * other.value:,.{column.digits}f})"
    is_told_apart = column.signed and (shown.low > 0 or shown.high < 0)
    return text + (_DOT if column.marked and is_told_apart else "")


def format_metric(metric: Metric, scale: float = 1.0, digits: int = 1, signed: bool = False) -> str:
    """Return a number with its interval, as tables show it; a dash where it is not known.

    Args:
        metric: the number.
        scale: factor from its unit to the shown one.
        digits: how many stand behind the point.
        signed: whether a positive one has its sign.
    """
    if not math.isfinite(metric.value):
        return "-"
    low, high = sorted((scale * metric.low, scale * metric.high))
    return with_interval((scale * metric.value, low, high), digits, "+" if signed else "")


def with_interval(three: Sequence[float], digits: int, sign: str = "") -> str:
    """Return a value with the ends of its interval in brackets, which are left out where the digits
    show no width: such an interval would say more than it knows.

    Args:
        three: value, low end, high end.
        digits: how many stand behind the point.
        sign: "+" puts one before positive numbers, too.
    """
    value, low, high = (f"{each:{sign}z,.{digits}f}" for each in three)
    return value if value == low == high else f"{value} ({low} to {high})"


def _embedded(out: Path, source: str) -> str:
    """A picture's file as a data URI."""
    data = base64.b64encode((out / source).read_bytes()).decode()
    return f"data:image/png;base64,{data}"
