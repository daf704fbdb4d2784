"""Measured tables and numbers in the pages of the documentation.

Studies declare their tables (`hrc_env.experiments.report.Table`); the numbers are those that their
commands found last, `docs/results/whole/COMMAND.json`. A page marks the place of a table with
`<!-- results: NAME -->` and `<!-- end of results -->`. After the name it can choose rows by the
text below one of the table's headings, and leave out intervals:
`<!-- results: baselines where perception is keypoints without intervals -->`. A single number in a
sentence is between `<!-- number: NAME.WHICH -->` and `<!-- end -->`, the provenance of all tables
of a page between `<!-- provenance -->` and `<!-- end of provenance -->`, and a file of `examples/`
between `<!-- example: PATH -->` and `<!-- end of example -->`.

The text of a table is that of today's study. If its numbers are older (`benchmarks.results`), a
sentence below it says so, and columns that they lack are left out and named.
"""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.studies import COMMANDS
from hrc_env.core.results import Metric
from hrc_env.core.versions import SUBSYSTEMS
from hrc_env.evaluation.intervals import estimate_share_of
from hrc_env.experiments.report import Metrics, Table, format_table
from hrc_env.worker.body import ANY

RESULTS = Path(__file__).parent / "results"
BLOCK = re.compile(
    r"<!-- results: (?P<name>\w+)(?: where (?P<head>[\w ]+?) is (?P<cell>[^>]+?))?"
    r"(?P<plain> without intervals)? -->\n.*?<!-- end of results -->",
    re.S,
)
NUMBER = re.compile(r"<!-- number: (?P<name>\w+)\.(?P<which>\w+) -->.*?<!-- end -->", re.S)
PROVENANCE = re.compile(r"<!-- provenance -->\n.*?<!-- end of provenance -->", re.S)
EXAMPLE = re.compile(r"<!-- example: (?P<path>[\w/]+\.py) -->\n.*?<!-- end of example -->", re.S)
EXAMPLES = Path(__file__).parent.parent / "examples"
RANGES = ("cluster", "speed", "speed_organs", "speed_pixels", "speed_tasks",
          "tracking_cost")  # fmt: skip
"""Tables with the smallest and the largest of several runs instead of intervals."""
GENERATED = (BLOCK, NUMBER, PROVENANCE, EXAMPLE)


@dataclass(frozen=True, slots=True)
class Result:
    """A table with the numbers that its command found last."""

    table: Table
    metrics: Metrics
    command: str
    version: str
    """Of the package."""
    depends: Mapping[str, int]
    """Versions of the subsystems that the numbers depend on."""
    bodies: str
    """Body of the workers by the settings of that run; "any" for all."""
    date: str
    machine: str


def names() -> list[str]:
    """Return the names of all tables."""
    return sorted({name for command in COMMANDS.values() for name in command.tables})


@cache
def declared(name: str) -> tuple[str, Table]:
    """Return a table that a study declares, after the name of its command.

    Raises:
        KeyError: no study does.
    """
    for which, command in COMMANDS.items():
        if name in command.tables and (table := command.declared_tables.get(name)) is not None:
            return which, table
    raise KeyError(f"No study declares the table {name!r}; valid are {', '.join(names())}.")


def read(name: str) -> Result:
    """Return a table with the numbers of the last run of its command; without a run, with none.

    Raises:
        KeyError: no study declares a table of that name.
    """
    command, table = declared(name)
    path = RESULTS / "whole" / f"{command}.json"
    if not path.exists():
        return Result(table, {}, COMMANDS[command].command, "", {}, ANY, "", "")
    whole: dict[str, Any] = json.loads(path.read_text())
    return Result(
        table=table,
        metrics={name: Metric(**each) for name, each in whole["metrics"].items()},
        command=whole["command"],
        version=whole["hrc_env"],
        depends=whole["depends"],
        bodies=ANY if f'"worker": "{ANY}"' in json.dumps(whole.get("config")) else "worker_1",
        date=whole["date"],
        machine=f"{whole['machine']['cores']} cores, no GPU",
    )


def filled(page: str) -> str:
    """A page with its tables, its examples and its line of provenance."""
    names = [found["name"] for asked in (BLOCK, NUMBER) for found in asked.finditer(page)]
    page = BLOCK.sub(lambda found: _block(found), page)
    page = NUMBER.sub(lambda found: _number(found), page)
    page = EXAMPLE.sub(lambda found: _example(found), page)
    line = f"<!-- provenance -->\n{provenance(names)}\n<!-- end of provenance -->"
    return PROVENANCE.sub(lambda _: line, page)


def _block(found: re.Match[str]) -> str:
    first, result = found[0].split("\n", 1)[0], read(found["name"])
    table = result.table
    if found["head"]:
        table = table.select_rows(found["head"], found["cell"])
    stale = describe_stale(found["name"], result)
    if stale:
        missing = table.list_unmeasured(result.metrics)
        table = replace(table, columns=[each for each in table.columns if each not in missing])
    metrics = result.metrics if found["name"] in RANGES else withhold_intervals(table, result)
    text = table.to_markdown(metrics, intervals=not found["plain"])
    shown = "\n\n".join(filter(None, (text, stale)))
    return f"{first}\n{shown}\n<!-- end of results -->"


def withhold_intervals(table: Table, result: Result) -> Metrics:
    """Return metrics without intervals of fewer than `Table.fewest` seeds, unless they are exact.

    Results of earlier versions have such intervals, which are bootstraps.

    Args:
        table: the table.
        result: the table's numbers.
    """
    columns = [column for column in table.columns if column.counted]
    counted = {name for row in table.rows for each in columns for name in each.list_metrics(row)}
    return {
        name: each if name in counted or each.n >= table.fewest or is_exact(each)
        else replace(each, low=math.nan, high=math.nan)
        for name, each in result.metrics.items()
    }  # fmt: skip


def is_exact(metric: Metric) -> bool:
    """Return whether the interval of a metric cannot be a bootstrap.

    This holds for a number without an interval, for a zero with one, and for the exact interval of
    a fraction of `Metric.n` trials.
    """
    if metric.low == metric.high or metric.value == 0 or not 0 < metric.value <= 1:
        return metric.low == metric.high or metric.value == 0
    exact = estimate_share_of([round(metric.value * metric.n)], [metric.n])
    return math.isclose(exact.low, metric.low, rel_tol=1e-4)


def describe_stale(name: str, result: Result) -> str:
    """Return what the text of a table does not say of its numbers if they are old or missing.

    For other tables, the result is "".

    Args:
        name: name of the table.
        result: the table with its numbers.
    """
    from benchmarks.results import explain_stale, format_time  # here: it imports this module

    command, _ = declared(name)
    if not result.metrics:
        duration = format_time(COMMANDS[command].minutes)
        return f"*Not measured yet: `{result.command}`, about {duration} on two cores.*"
    if not explain_stale(command):
        return ""
    words = ["Numbers of an earlier version (`python -m benchmarks.results --list`)."]
    conditions, missing = result.table.conditions, result.table.list_unmeasured(result.metrics)
    if conditions is not None and conditions.worker != result.bodies:
        words.append(f"In them, all workers have the body `{result.bodies}`.")
    if missing:
        words.append(f"Not measured yet: {'; '.join(column.heading for column in missing)}.")
    return f"*{' '.join(words)}*"


def _number(found: re.Match[str]) -> str:
    result = read(found["name"])
    said = result.table.format_number(found["which"], result.metrics)
    return f"{found[0].split('>', 1)[0]}>{said}<!-- end -->"


def _example(found: re.Match[str]) -> str:
    first, code = found[0].split("\n", 1)[0], (EXAMPLES / found["path"]).read_text()
    return f"{first}\n```python\n{code}```\n<!-- end of example -->"


def provenance(names: list[str]) -> str:
    """Return by which commands, at which versions, when and on which machines tables were made.

    Args:
        names: names of the tables.

    Returns:
        A sentence if one command made all of them, else a table with a row for each command.
    """
    found = [each for each in map(read, dict.fromkeys(names)) if each.metrics]
    sources: dict[tuple[str, ...], list[str]] = {}
    for each in found:
        source = (f"`{each.command}`", _versions(each.version, each.depends), each.date)
        sources.setdefault(source, []).append(each.table.title)
    machines = ", ".join(dict.fromkeys(each.machine for each in found))
    if len(sources) == 1:
        command, version, date = next(iter(sources))
        return f"*Measured by {command} on {machines}; version {version}, {date}.*"
    lines = [("; ".join(titles), *source) for source, titles in sources.items()]
    heads = ("tables", "command", "version (of parts)", "date")
    return f"Measured on {machines}:\n\n{format_table(heads, lines, len(heads))}"


def _versions(version: str, depends: Mapping[str, int]) -> str:
    """Return versions as sentences have them: 0.1.0 (env 1, tracker 1)."""
    known = (f"{name} {depends[name]}" for name in SUBSYSTEMS if name in depends)
    return f"{version} ({', '.join(known)})"


def asked(name: str) -> set[str]:
    """Return the metrics that a table shows of its command's last run; all if there was none."""
    command, table = declared(name)
    whole = RESULTS / "whole" / f"{command}.json"
    if not whole.exists():
        return table.list_metrics()
    return table.list_metrics() & json.loads(whole.read_text())["metrics"].keys()
