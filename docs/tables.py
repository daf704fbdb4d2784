"""Tables and numbers that were measured: from `docs/results/NAME.json` into the pages that ask.

A page asks with `<!-- results: NAME -->`, or `<!-- results: NAME without intervals -->`, and the
table stands between that and `<!-- end of results -->`; for a number in a sentence with
`<!-- number: NAME.WHICH -->`, and it stands between that and `<!-- end -->`. Where all this comes
from stands once a page, between `<!-- provenance -->` and `<!-- end of provenance -->`. A file of
`examples/` stands between `<!-- example: PATH -->` and `<!-- end of example -->`.

A file holds title, command, version of the package, "depends" (versions of the subsystems that the
numbers depend on), date, machine, note, columns, rows, "keys" (a list of words a row; null: the row
is not measured), and "numbers" by name. A cell is a text, a number, or [value, low, high]; null is
an empty cell. A column has name, unit and digits, and so has a number, whose "value" is a cell;
both may have

- "metric": which of the command's results.json it is, where a row's words fill in {0}, {1}, ...;
  a cell that is empty stays so while the command has no such metric;
- "factor": from the metric's unit;
- "plain": its interval is not shown;
- "counted": it counts rare events, and its interval is shown even where others are not;
- "form": "count" (the share as "8 of 9"), "n" (how many observations it is made of);
- "beside": another metric that stands behind it, "85 (190)".

A note shows a number where it says {NAME}.

Where there is no such file the experiment itself declares the table, rows and columns
(`hrc_env.experiments.report.Table`); its numbers are those in `docs/results/whole/COMMAND.json`.
"""

import datetime
import json
import math
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.studies import COMMANDS
from hrc_env.core.results import Metric
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Table, with_interval
from hrc_env.experiments.versions import SUBSYSTEMS, versions_of

RESULTS = Path(__file__).parent / "results"
BLOCK = re.compile(
    r"<!-- results: (?P<name>\w+)(?P<plain> without intervals)? -->\n.*?<!-- end of results -->",
    re.S,
)
NUMBER = re.compile(r"<!-- number: (?P<name>\w+)\.(?P<which>\w+) -->.*?<!-- end -->", re.S)
PROVENANCE = re.compile(r"<!-- provenance -->\n.*?<!-- end of provenance -->", re.S)
EXAMPLE = re.compile(r"<!-- example: (?P<path>[\w/]+\.py) -->\n.*?<!-- end of example -->", re.S)
EXAMPLES = Path(__file__).parent.parent / "examples"
GENERATED = (BLOCK, NUMBER, PROVENANCE, EXAMPLE)


def read(name: str) -> dict[str, Any]:
    """Return one table with its numbers, its rows as long as its columns.

    Raises:
        ValueError: rows of another length.
        KeyError: no file and no experiment has a table of that name.
    """
    path = RESULTS / f"{name}.json"
    if not path.exists():
        return _filled_table(*declared(name))
    table = json.loads(path.read_text())
    wrong = [row for row in table["rows"] if len(row) != len(table["columns"])]
    if wrong:
        raise ValueError(f"{name}: {len(table['columns'])} columns, but a row is {wrong[0]}.")
    return table


def names() -> list[str]:
    """Return the names of all tables."""
    return sorted({name for command in COMMANDS.values() for name in command.tables})


@cache
def declared(name: str) -> tuple[str, Table]:
    """Return a table that an experiment declares, after the name of its command.

    Raises:
        KeyError: no experiment does.
    """
    for which, command in COMMANDS.items():
        if name in command.tables and (table := command.declared_tables.get(name)) is not None:
            return which, table
    raise KeyError(f"There is no docs/results/{name}.json, and no experiment declares {name!r}.")


def _filled_table(command: str, table: Table) -> dict[str, Any]:
    """Return a declared table in the form of a file."""
    whole = json.loads((RESULTS / "whole" / f"{command}.json").read_text())
    metrics = {name: Metric(**each) for name, each in whole["metrics"].items()}
    heads = [{"name": head} for head in table.heads]
    rows = [
        [*cells, *(_number_of(metrics.get(column.metric.format(row)), column)
                   for column in table.columns)]
        for row, cells in table.rows.items()
        if any(column.metric.format(row) in metrics for column in table.columns)
    ]  # fmt: skip
    return {
        "title": table.title,
        "command": whole["command"],
        "version": whole["hrc_env"],
        "depends": whole["depends"],
        "date": whole["date"],
        "machine": f"{whole['machine']['cores']} cores, no GPU",
        "note": table.note_of(metrics),
        "columns": [*heads, *map(_heading_of, table.columns)],
        "rows": rows,
    }


def _heading_of(column: Column) -> dict[str, Any]:
    name, _, unit = column.heading.partition(" [")
    return {"name": name, "unit": unit.removesuffix("]"), "digits": column.digits,
            "counted": column.counted, "plain": column.plain}  # fmt: skip


def _number_of(metric: Metric | None, column: Column) -> Any:
    """Return the cell of a metric."""
    if metric is None or not math.isfinite(metric.value):
        return None
    if column.is_n:
        return metric.n
    low, high = sorted((column.scale * metric.low, column.scale * metric.high))
    return [round(each, column.digits + 2) for each in (column.scale * metric.value, low, high)]


def filled(page: str) -> str:
    """A page with its tables, its examples and its line of provenance."""
    names = [found["name"] for asked in (BLOCK, NUMBER) for found in asked.finditer(page)]
    page = BLOCK.sub(lambda found: _block(found), page)
    page = NUMBER.sub(lambda found: _number(found), page)
    page = EXAMPLE.sub(lambda found: _example(found), page)
    line = f"<!-- provenance -->\n{provenance(names)}\n<!-- end of provenance -->"
    return PROVENANCE.sub(lambda _: line, page)


def _block(found: re.Match[str]) -> str:
    first = found[0].split("\n", 1)[0]
    table = markdown(read(found["name"]), intervals=not found["plain"])
    return f"{first}\n{table}\n<!-- end of results -->"


def _number(found: re.Match[str]) -> str:
    return f"{found[0].split('>', 1)[0]}>{said(read(found['name']), found['which'])}<!-- end -->"


def _example(found: re.Match[str]) -> str:
    first, code = found[0].split("\n", 1)[0], (EXAMPLES / found["path"]).read_text()
    return f"{first}\n```python\n{code}```\n<!-- end of example -->"


def said(table: Mapping[str, Any], which: str) -> str:
    """One of the numbers of a file, as sentences have it."""
    number = table["numbers"][which]
    return _cell(number["value"], number, intervals=True)


def markdown(table: Mapping[str, Any], intervals: bool = True) -> str:
    """A table in Markdown, its title above it and its note below."""
    columns = table["columns"]
    numeric = [
        any(isinstance(row[k], int | float | list) for row in table["rows"])
        for k in range(len(columns))
    ]
    lines = [
        _line(_heading(column) for column in columns),
        "|" + "|".join("---:" if right else "---" for right in numeric) + "|",
        *(
            _line(_cell(cell, column, intervals) for cell, column in zip(row, columns, strict=True))
            for row in table["rows"]
        ),
    ]
    note = re.sub(r"\{(\w+)\}", lambda found: said(table, found[1]), table.get("note", ""))
    return "\n".join([f"**{table['title']}**\n", *lines, *([f"\n{note}"] if note else [])])


def provenance(names: list[str]) -> str:
    """Return one line: by which commands, at which versions, when and on what tables were made."""
    found = [read(name) for name in dict.fromkeys(names)]
    stated = {
        pair for table in found for pair in (("", table["version"]), *table["depends"].items())
    }
    is_same = len(dict(stated)) == len(stated)
    sources: dict[str, list[str]] = {}
    for table in found:
        at = "" if is_same else f" at {_versions(table['version'], table['depends'])}"
        source = f"`{table['command']}`{at} ({table['date']})"
        sources.setdefault(source, []).append(f'"{table["title"]}"')
    parts = [f"{', '.join(titles)} by {source}" for source, titles in sources.items()]
    machines = ", ".join(dict.fromkeys(table["machine"] for table in found))
    if is_same and found:
        depends = {name: number for table in found for name, number in table["depends"].items()}
        machines += f", at {_versions(found[0]['version'], depends)}"
    return f"*Measured on {machines}: {'; '.join(parts)}.*"


def _versions(version: str, depends: Mapping[str, int]) -> str:
    """Return versions as sentences have them: 0.1.0 (env 1, tracker 1)."""
    known = (f"{name} {depends[name]}" for name in SUBSYSTEMS if name in depends)
    return f"{version} ({', '.join(known)})"


def renewed(table: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Return a file with the numbers of a `results.json` that its command wrote.

    Raises:
        KeyError: a metric is not there.
    """
    found = json.loads(path.read_text())
    metrics, columns = found["metrics"], table["columns"]
    rows = [
        [_measured(metrics, *part) for part in zip(columns, row, [key] * len(row), strict=True)]
        for key, row in _keyed(table)
    ]
    numbers = {
        which: number | {"value": _measured(metrics, number, number["value"], ())}
        for which, number in table.get("numbers", {}).items()
    }
    date = found.get("date") or datetime.date.fromtimestamp(path.stat().st_mtime).isoformat()
    machine = f"{found['machine']['cores']} cores, no GPU"
    depends = found.get("depends") or versions_of(table["depends"])
    new = {"version": found["hrc_env"], "depends": depends, "date": date, "machine": machine}
    new |= {"rows": rows}
    return {**table, **new, **({"numbers": numbers} if numbers else {})}


def asked(name: str) -> set[str]:
    """Return the metrics that a table needs of its command's results.json."""
    if not (RESULTS / f"{name}.json").exists():
        command, each = declared(name)
        whole = json.loads((RESULTS / "whole" / f"{command}.json").read_text())["metrics"]
        found = {column.metric.format(row) for row in each.rows for column in each.columns}
        return found & whole.keys()
    table = read(name)
    cells = [
        (part, key, cell)
        for key, row in _keyed(table)
        for part, cell in zip(table["columns"], row, strict=True)
    ]
    cells += [(each, (), each["value"]) for each in table.get("numbers", {}).values()]
    return {
        part[name].format(*key)
        for part, key, cell in cells
        for name in ("metric", "beside")
        if name in part and cell is not None and key is not None
    }


def _keyed(table: Mapping[str, Any]) -> list[tuple[Any, list[Any]]]:
    """Keys with their rows."""
    rows = table["rows"]
    return list(zip(table.get("keys", [()] * len(rows)), rows, strict=True))


def written(table: Mapping[str, Any]) -> str:
    """The text of a file: a line for each row and column."""
    parts = []
    for name, value in table.items():
        text = json.dumps(value, ensure_ascii=False)
        if isinstance(value, list):
            each = ",\n  ".join(json.dumps(item, ensure_ascii=False) for item in value)
            text = f"[\n  {each}\n ]"
        elif isinstance(value, dict):
            pairs = (
                f"{json.dumps(k)}: {json.dumps(v, ensure_ascii=False)}" for k, v in value.items()
            )
            text = "{\n  " + ",\n  ".join(pairs) + "\n }"
        parts.append(f" {json.dumps(name)}: {text}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _measured(metrics: Mapping[str, Any], part: Mapping[str, Any], old: Any, key: Any) -> Any:
    """What comes for an old cell of a column, or for a number."""
    if "metric" not in part or key is None:
        return old
    name, digits = part["metric"].format(*key), part.get("digits", 0)
    if name not in metrics and old is None:
        return None
    metric, form = metrics[name], part.get("form")
    if form == "n":
        return metric["n"]
    if not math.isfinite(metric["value"]):
        return None
    if form == "count":
        return f"{round(metric['value'] * metric['n'])} of {metric['n']}"
    scaled = [part.get("factor", 1) * metric[end] for end in ("value", "low", "high")]
    if "beside" in part:
        other = part.get("factor", 1) * metrics[part["beside"].format(*key)]["value"]
        return f"{scaled[0]:,.{digits}f} ({other:,.{digits}f})"
    return [round(each, digits + 2) for each in (scaled[0], *sorted(scaled[1:]))]


def _heading(column: Mapping[str, Any]) -> str:
    return f"{column['name']} [{column['unit']}]" if column.get("unit") else column["name"]


def _cell(cell: Any, column: Mapping[str, Any], intervals: bool) -> str:
    if cell is None or isinstance(cell, str):
        return cell or ""
    three = cell if isinstance(cell, list) else [cell] * 3
    if not (column.get("counted") or (intervals and not column.get("plain"))):
        three = [three[0]] * 3
    return with_interval(three, column.get("digits", 0), to=" to ")


def _line(cells: Any) -> str:
    return "| " + " | ".join(cells) + " |"
