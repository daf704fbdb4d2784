"""Reports of studies: figures, tables and explanations, as HTML, Markdown and results.json."""

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

from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.results import Metric, provenance, write_results, write_whole
from hrc_env.evaluation.intervals import ALPHA, HOLM, MIN_SEEDS
from hrc_env.experiments.columns import Column, Key
from hrc_env.experiments.plots import stamp

Metrics = Mapping[str, Metric]
Cells = tuple[str, ...]
Rows = Mapping[str, Cells] | Mapping[tuple[str, ...], Cells] | Mapping[Key, Cells]
"""Text cells at the beginning of each row, by the row's key."""
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
class Conditions:
    """The conditions of a safety study, which the notes of all of its tables name."""

    people: str
    """Kind of people."""
    scene: str
    """Name or description of the scene."""
    perception: str
    """Level of perception, or where the table names it."""
    chosen_on: str
    """Seeds on which settings were chosen, such as margins or policies."""
    worker: str = "any"
    """Choice of the workers' bodies."""
    seeds: str = ""
    """Seeds of the episodes from which the numbers were computed; a `Study` with rows states its
    own."""

    @property
    def words(self) -> str:
        """The conditions as a sentence."""
        bodies = "`any`, which draws one of all bodies for each worker and episode"
        return (
            f"Body: {bodies if self.worker == 'any' else f'`{self.worker}`'}; people: "
            f"{self.people}; scene: {self.scene}; perception: {self.perception}. Played on "
            f"{self.seeds}; {self.chosen_on}."
        )


SHIELD_CHOSEN_ON = (
    "the shield's capsules were fitted on episodes of seed 9,600,000, and the seeds on which its "
    "other defaults were chosen were not recorded"
)
"""Text on the seeds on which the settings of the built-in shields were chosen."""


def format_seeds(seeds: Sequence[int]) -> str:
    """Return the range of consecutive seeds as text."""
    return f"seeds {min(seeds):,} to {max(seeds):,}"


@dataclass(frozen=True, slots=True)
class Table:
    """A table of metrics in a report and in the documentation."""

    name: str
    """Name by which a page of the documentation refers to the table."""
    title: str
    """Title of the table."""
    rows: Rows
    """Text cells at the beginning of each row, by the row's key."""
    columns: Sequence[Column]
    """Columns of numbers."""
    heads: tuple[str, ...] = ("",)
    """Headings of the text cells."""
    note: str = ""
    """Text below the table. `{n[METRIC]}` is replaced by the number of observations of a metric,
    and `{NAME}` by one of `numbers`."""
    numbers: Mapping[str, Column] = field(default_factory=dict)
    """Columns with the numbers that the note, or sentences of the documentation, contain, by
    name."""
    printed: Mapping[str, float] = field(default_factory=dict)
    """Values that other publications report, by the names of the corresponding metrics."""
    conditions: Conditions | None = None
    """Conditions of a safety study, which the note names; None for other studies."""
    trained: Collection[Key] = ()
    """Rows of single trained policies, in a table that compares learners. They have intervals only
    of counts of rare events: a bootstrap over the episodes of one policy does not contain the
    variation between trainings (`hrc_env.evaluation.intervals.estimate_run_iqm`)."""
    fewest: int = MIN_SEEDS
    """Smallest number of seeds with a bootstrap interval; `MIN_RUNS` if a seed is a training, 1 if
    the columns show ranges of repeated measurements instead of intervals."""

    def check(self, known: Collection[str]) -> None:
        """Raise `ConfigError` if a row has the wrong number of cells or a column has no metric.

        Args:
            known: names of the available metrics.
        """
        for row, cells in self.rows.items():
            if len(cells) != len(self.heads):
                raise ConfigError(
                    f"Table {self.name!r}: row {row!r} must have a cell for each of the heads "
                    f"{self.heads}, got {cells}."
                )
        shown = [(col.metric, [col.list_metrics(row) for row in self.rows]) for col in self.columns]
        shown += [(col.metric, [col.list_metrics(())]) for col in self.numbers.values()]
        for metric, rows in shown:
            if not any({*names} <= {*known, *self.printed} for names in rows):
                raise ConfigError(
                    f"Table {self.name!r}: no row has the metric {metric!r}; a row has "
                    f"{', '.join(sorted({name.rpartition('.')[2] for name in known}))}."
                )

    def select_rows(self, head: str, cell: str) -> "Table":
        """Return the table with only the rows that contain a given text below a heading.

        Args:
            head: one of `heads`.
            cell: the text, without the backticks of code.

        Raises:
            ConfigError: there is no such heading, or no row with the text.
        """
        check_names(f"heading of the table {self.name!r}", [head], self.heads)
        position = self.heads.index(head)
        texts = {row: cells[position].replace("`", "") for row, cells in self.rows.items()}
        check_names(f"{head} of the table {self.name!r}", [cell], dict.fromkeys(texts.values()))
        rows = {row: cells for row, cells in self.rows.items() if texts[row] == cell}
        return replace(self, rows=rows)

    def list_metrics(self) -> set[str]:
        """Return the names of all metrics that the table can show."""
        names = {name for row in self.rows for c in self.columns for name in c.list_metrics(row)}
        return (names | {c.metric for c in self.numbers.values()}) - self.printed.keys()

    def list_unmeasured(self, metrics: Metrics) -> list[Column]:
        """Return the columns for which no row has a metric.

        Args:
            metrics: metrics by name.
        """
        known = {*metrics, *self.printed}
        return [
            column
            for column in self.columns
            if not any({*column.list_metrics(row)} <= known for row in self.rows)
        ]

    def describe_intervals(self, metrics: Metrics) -> str:
        """Return sentences on missing intervals and on the dots of differences; "" if not needed.

        Args:
            metrics: metrics by name.
        """
        shown = [
            (column, name)
            for row in self.rows
            for column in self.columns
            if column.shows in ("value", "value of n") and not column.plain
            for name in column.list_metrics(row)[:1]
            if name in metrics and math.isfinite(metrics[name].value)
        ]
        sentences = []
        if any(has_no_interval(metrics[name]) for _, name in shown):
            sentences.append(TOO_FEW_SEEDS.format(self.fewest))
        if any(row in self.rows for row in self.trained):
            sentences.append(ONE_TRAINING)
        tested = [name_adjusted(name) for column, name in shown if column.signed and column.marked]
        known = [metrics[name] for name in tested if name in metrics]
        if any(math.isfinite(each.value) for each in known):
            sentences.append(
                f"A dot marks a difference with a p-value below {ALPHA:g} after Holm's correction "
                f"for the {known[0].n} contrasts of the study."
            )
        elif tested:
            sentences.append("No difference is marked, as there are no adjusted p-values.")
        return " ".join(sentences)

    def format_number(self, name: str, metrics: Metrics) -> str:
        """Return one of `numbers` in a format for sentences.

        Args:
            name: name of the number.
            metrics: metrics by name.
        """
        return format_cell(self.numbers[name], metrics, ())

    def format_note(self, metrics: Metrics) -> str:
        """Return the note with its numbers; the counts of missing metrics are 0."""
        n = defaultdict(int, {name: metric.n for name, metric in metrics.items()})
        numbers = {name: self.format_number(name, metrics) for name in self.numbers}
        conditions = "" if self.conditions is None else self.conditions.words
        return " ".join(filter(None, (self.note.format(n=n, **numbers), conditions)))

    def drop_bootstraps(self, metrics: Metrics) -> Metrics:
        """Return the metrics without intervals that `trained` excludes.

        Args:
            metrics: metrics by name.
        """
        columns = [column for column in self.columns if not column.counted]
        names = {
            name for row in self.trained for each in columns for name in each.list_metrics(row)
        }
        return {
            name: replace(each, low=each.value, high=each.value) if name in names else each
            for name, each in metrics.items()
        }

    def to_markdown(self, metrics: Metrics, intervals: bool = True) -> str:
        """Return the table in Markdown with its title and note; rows without numbers are left out.

        Args:
            metrics: metrics by name.
            intervals: whether to show intervals of metrics that do not count rare events.

        Returns:
            The table, or "" if no row has a number.
        """
        known = {name: Metric(value, value, value, "", 1) for name, value in self.printed.items()}
        known |= self.drop_bootstraps(metrics)
        columns = (
            self.columns if intervals else [replace(c, plain=not c.counted) for c in self.columns]
        )
        lines = format_rows(self.rows, columns, known)
        if not lines:
            return ""
        heads = (*self.heads, *(each.heading for each in columns))
        text = format_table(heads, lines, len(self.heads))
        shown = replace(self, columns=columns).describe_intervals(known)
        note = " ".join(filter(None, (self.format_note(metrics), shown)))
        return "\n\n".join(filter(None, (f"**{self.title}**", text, note)))


@dataclass(frozen=True, slots=True)
class Report:
    """The report of a study."""

    title: str
    """Title of the report."""
    question: str
    """The question and the method of the study."""
    parts: Sequence[str]
    """Paragraphs, headings, tables and pictures in their order, as Markdown."""
    spread: str = "95 % intervals over seeds"
    """Description of the intervals in the report's tables."""
    quick: str = ""
    """Warning below each table and on each figure of a quick run, in which differences are not
    marked; "" for other runs."""

    def write(
        self, out: Path, settings: Mapping[str, Any], seeds: Sequence[int], metrics: Metrics
    ) -> None:
        """Write results.json, report.md and report.html, which embeds its pictures, into `out`."""
        write_results(out / "results.json", settings, seeds, metrics)
        origin = f"Version {provenance()['hrc_env']}, seeds {min(seeds)} to {max(seeds)}; "
        origin += f"numbers are given with {self.spread}, all of them in results.json."
        head, parts = [f"# {self.title}"], [*filter(None, self.parts)]
        if self.quick:
            head.append(f"**{self.quick}**")
            parts = [_add_warning(part, self.quick) for part in parts]
            for name in _FIGURE.findall("\n".join(parts)):
                stamp(out / "figures" / name, self.quick)
        text = "\n\n".join([*head, self.question, *parts, origin]) + "\n"
        write_whole(out / "report.md", text)
        body = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
        body = re.sub(r'src="([^"]+)"', lambda found: f'src="{_embed(out, found[1])}"', body)
        page = (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            f"<title>{html.escape(self.title)}</title><style>{_STYLE}</style></head>"
            f"<body>{body}</body></html>"
        )
        write_whole(out / "report.html", page)


def describe_quick_run(
    n: int,
    seconds: float | tuple[float, float],
    unit: str = "seed",
    consequence: str = "",
) -> str:
    """Return the warning in the report of a quick run.

    Args:
        n: maximum number of seeds or other repetitions.
        seconds: duration of a repetition [s], or (shortest, longest) if durations differ.
        unit: name of a repetition, in the singular.
        consequence: the conclusion that readers should draw; "": too few for comparisons.
    """
    if not consequence:
        is_few = unit == "seed" and n < MIN_SEEDS
        consequence = f"too few {'seeds for intervals and' if is_few else 'for'} comparisons"
    least, most = seconds if isinstance(seconds, tuple) else (seconds, seconds)
    duration = f"{least:.3g} s" if least == most else f"{least:.3g} to {most:.3g} s"
    return f"Quick run, {n} {unit}{'' if n == 1 else 's'} of {duration}: {consequence}."


MAX_DIGITS = 6
"""Largest number of decimals to which small numbers extend a table's."""
TOO_FEW_SEEDS = (
    "Cells without an interval have too few seeds (fewer than {}), or resamples of the seeds "
    "without a finite value."
)
"""Sentence below tables with numbers from too few seeds, with a placeholder for `Table.fewest`."""
ONE_TRAINING = (
    "Rows of a single trained policy have intervals only of counted events, over its episodes."
)
"""Sentence below tables with rows of single trained policies."""
_FIGURE = re.compile(r"\]\(figures/([^)]+)\)")
_TABLE = re.compile(r"^\|---", re.M)
_DOT_SENTENCE = re.compile(r" ?A dot marks [^\n]*? of the study\.")
_DOT = " ●"
"""Mark for a difference with an adjusted p-value below `ALPHA`."""


def has_no_interval(metric: Metric) -> bool:
    """Return whether a metric has a value, but no interval."""
    return math.isfinite(metric.value) and math.isnan(metric.low)


def name_adjusted(difference: str) -> str:
    """Return the name of the adjusted p-value of a difference by the difference's name."""
    return HOLM + difference.removeprefix("difference.")


def _add_warning(part: str, words: str) -> str:
    """Return a part of a report without marks, and with a warning below its table or figure."""
    part = _DOT_SENTENCE.sub("", part.replace(_DOT, ""))
    is_shown = _TABLE.search(part) or _FIGURE.search(part)
    return f"{part}\n\n*{words}*" if is_shown else part


def format_picture(path: Path, caption: str) -> str:
    """Return the Markdown of a PNG file in the report's folder `figures`, with its caption."""
    return f"![{caption}](figures/{path.name})\n\n*{caption}*"


def format_table(header: Sequence[str], rows: Iterable[Sequence[str]], n_heads: int = 1) -> str:
    """Return a table in Markdown.

    Args:
        header: headings of the columns.
        rows: cells of each row.
        n_heads: number of leading columns that describe the rows.
    """
    lines = [" | ".join(line) for line in (header, *rows)]
    rule = "---|" * n_heads + "---:|" * (len(header) - n_heads)
    return "\n".join([f"| {lines[0]} |", f"|{rule}", *(f"| {line} |" for line in lines[1:])])


def format_metrics(
    name: str, rows: Mapping[str, str], columns: Sequence[Column], metrics: Metrics
) -> str:
    """Return a table of metrics in Markdown with its sentences on intervals, or "" without metrics.

    Args:
        name: heading of the rows.
        rows: names of rows by key.
        columns: columns of metrics.
        metrics: metrics by name.
    """
    table = Table("", "", {row: (words,) for row, words in rows.items()}, columns, (name,))
    lines = format_rows(table.rows, columns, metrics)
    if not lines:
        return ""
    text = format_table((name, *(c.heading for c in columns)), lines)
    return "\n\n".join(filter(None, (text, table.describe_intervals(metrics))))


def format_rows(rows: Rows, columns: Sequence[Column], metrics: Metrics) -> list[tuple[str, ...]]:
    """Return the cells of all rows that contain a number.

    Args:
        rows: text cells at the beginning of each row, by the row's key.
        columns: columns of metrics.
        metrics: metrics by name.
    """
    return [
        (*cells, *(format_cell(column, metrics, row) for column in columns))
        for row, cells in rows.items()
        if any(column.list_metrics(row)[0] in metrics for column in columns)
    ]


def format_cell(column: Column, metrics: Metrics, row: Key) -> str:
    """Return the number of a row in the format of a column, or a dash if there is none.

    A zero is shown with its interval even if the column shows none.

    Args:
        column: the column, which names the metric and defines its format.
        metrics: metrics by name.
        row: key of the row.
    """
    names = column.list_metrics(row)
    if not metrics.keys() >= {*names}:
        return "-"
    metric, *others = (metrics[name] for name in names)
    if column.shows == "n":
        return f"{metric.n:,}"
    if column.shows == "count":
        return f"{round(metric.value * metric.n)} of {metric.n}"
    is_plain = (column.plain and metric.value != 0) or bool(others)
    shown = replace(metric, low=math.nan, high=math.nan) if is_plain else metric
    text = format_metric(shown, column.scale, column.digits, column.signed)
    for other in others:
        text += f" ({column.scale * other.value:,.{column.digits}f})"
    if column.shows == "value of n" and math.isfinite(metric.value):
        text += f" of {metric.n:,}"
    p = metrics.get(name_adjusted(names[0])) if column.signed and column.marked else None
    return text + (_DOT if p is not None and p.value < ALPHA else "")


def format_metric(metric: Metric, scale: float = 1.0, digits: int = 1, signed: bool = False) -> str:
    """Return a number with its interval in the format of tables, or a dash if it is not finite.

    A number that was 0 in every one of several observations is followed by their number, because
    its interval would have zero width.

    Args:
        metric: the number with its interval.
        scale: factor from the metric's unit to the unit shown.
        digits: number of decimals.
        signed: whether positive numbers are shown with their sign.
    """
    if not math.isfinite(metric.value):
        return "-"
    sign, value = "+" if signed else "", scale * metric.value
    if metric.value == metric.low == metric.high == 0 and metric.n > 1:
        return f"{format_interval(value, math.nan, math.nan, digits, sign)} in all {metric.n:,}"
    low, high = sorted((scale * metric.low, scale * metric.high))
    return format_interval(value, low, high, digits, sign)


def format_interval(value: float, low: float, high: float, digits: int, sign: str = "") -> str:
    """Return a value with the ends of its interval in brackets.

    The interval is left out if its ends are not finite, or if all three numbers are equal at this
    number of decimals. Numbers that would all be shown as zero have as many decimals as needed to
    tell the greatest from zero.

    Args:
        value: the value.
        low: low end of the interval; NaN without an interval.
        high: high end of the interval; NaN without an interval.
        digits: number of decimals.
        sign: "+" to show the sign of positive numbers, too.
    """
    has_interval = math.isfinite(low) and math.isfinite(high)
    largest = max(abs(low), abs(high)) if has_interval else abs(value)
    while 0 < largest < 0.5 * 10.0**-digits and digits < MAX_DIGITS:
        digits += 1
    texts = [f"{number:{sign}z,.{digits}f}" for number in (value, low, high)]
    is_alone = not has_interval or len({*texts}) == 1
    return texts[0] if is_alone else f"{texts[0]} ({texts[1]} to {texts[2]})"


def _embed(out: Path, source: str) -> str:
    """Return the file of a picture as a data URI."""
    data = base64.b64encode((out / source).read_bytes()).decode()
    return f"data:image/png;base64,{data}"
