"""Tables of measurements: from `docs/results/NAME.json` into the pages that ask for them.

A page asks with `<!-- results: NAME -->`, or `<!-- results: NAME without intervals -->`, and the
table stands between that and `<!-- end of results -->`. Where it comes from stands once a page,
between `<!-- provenance -->` and `<!-- end of provenance -->`.

A file holds title, command, commit, date, machine, note, columns (name, unit, digits) and rows. A
cell is a text, a number, or [value, low, high]; null is an empty cell.
"""

import datetime
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parent / "results"
BLOCK = re.compile(
    r"<!-- results: (?P<name>\w+)(?P<plain> without intervals)? -->\n.*?<!-- end of results -->",
    re.S,
)
PROVENANCE = re.compile(r"<!-- provenance -->\n.*?<!-- end of provenance -->", re.S)
GENERATED = (BLOCK, PROVENANCE)


def read(name: str) -> dict[str, Any]:
    """One file of results, with its rows as long as its columns.

    Raises:
        ValueError: rows of another length.
    """
    table = json.loads((RESULTS / f"{name}.json").read_text())
    wrong = [row for row in table["rows"] if len(row) != len(table["columns"])]
    if wrong:
        raise ValueError(f"{name}: {len(table['columns'])} columns, but a row is {wrong[0]}.")
    return table


def filled(page: str) -> str:
    """A page with its tables and its line of provenance."""
    names = [found["name"] for found in BLOCK.finditer(page)]
    page = BLOCK.sub(lambda found: _block(found), page)
    line = f"<!-- provenance -->\n{provenance(names)}\n<!-- end of provenance -->"
    return PROVENANCE.sub(lambda _: line, page)


def _block(found: re.Match[str]) -> str:
    first = found[0].split("\n", 1)[0]
    table = markdown(read(found["name"]), intervals=not found["plain"])
    return f"{first}\n{table}\n<!-- end of results -->"


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
    note = [f"\n{table['note']}"] if table.get("note") else []
    return "\n".join([f"**{table['title']}**\n", *lines, *note])


def provenance(names: list[str]) -> str:
    """One line: by which commands, at which commits, when and on what tables were measured."""
    sources: dict[tuple[str, ...], list[str]] = {}
    for name in dict.fromkeys(names):
        table = read(name)
        key = tuple(table[part] for part in ("machine", "command", "commit", "date"))
        sources.setdefault(key, []).append(f'"{table["title"]}"')
    parts = [
        f"{', '.join(titles)} by `{command}` at {commit} ({date})"
        for (_, command, commit, date), titles in sources.items()
    ]
    machines = ", ".join(dict.fromkeys(machine for machine, *_ in sources))
    return f"*Measured on {machines}: {'; '.join(parts)}.*"


def renewed(table: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """A table with the numbers of a `results.json` that its command wrote.

    Columns that are filled have a "metric", a template of the metric's name, as
    "{0}.{1}.return", and may have a "factor" from the metric's unit to the column's; "keys" holds
    a list of words for each row, which fill the template.
    """
    found = json.loads(path.read_text())
    rows = [
        [_metric(found["metrics"], column, key, cell) for column, cell in zip(*pair, strict=True)]
        for key, pair in (
            (key, (table["columns"], row))
            for key, row in zip(table["keys"], table["rows"], strict=True)
        )
    ]
    date = datetime.date.fromtimestamp(path.stat().st_mtime).isoformat()
    return {**table, "commit": found["git"], "date": date, "rows": rows}


def written(table: Mapping[str, Any]) -> str:
    """The text of a file: a line for each row and column."""
    parts = []
    for name, value in table.items():
        text = json.dumps(value, ensure_ascii=False)
        if isinstance(value, list):
            each = ",\n  ".join(json.dumps(item, ensure_ascii=False) for item in value)
            text = f"[\n  {each}\n ]"
        parts.append(f" {json.dumps(name)}: {text}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _metric(metrics: Mapping[str, Any], column: Mapping[str, Any], key: Any, cell: Any) -> Any:
    if "metric" not in column:
        return cell
    metric, factor = metrics[column["metric"].format(*key)], column.get("factor", 1)
    return [round(factor * metric[part], column["digits"] + 2) for part in ("value", "low", "high")]


def _heading(column: Mapping[str, Any]) -> str:
    return f"{column['name']} [{column['unit']}]" if column.get("unit") else column["name"]


def _cell(cell: Any, column: Mapping[str, Any], intervals: bool) -> str:
    if cell is None or isinstance(cell, str):
        return cell or ""
    value, *ends = cell if isinstance(cell, list) else [cell]
    digits = column.get("digits", 0)
    if not (ends and intervals):
        return f"{value:,.{digits}f}"
    return f"{value:,.{digits}f} ({' to '.join(f'{end:,.{digits}f}' for end in ends)})"


def _line(cells: Any) -> str:
    return "| " + " | ".join(cells) + " |"
