"""A report that a person reads from top to bottom: one HTML file with its pictures inside."""

import base64
import html
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hrc_env.core.results import Metric, write_whole

_STYLE = """
body { font: 17px/1.55 system-ui, sans-serif; color: #1c2430; max-width: 66rem;
       margin: 2.5rem auto; padding: 0 1.2rem; }
h1 { font-size: 2rem; line-height: 1.2; } h2 { margin-top: 2.6rem; }
figure { margin: 1.6rem 0; } img { max-width: 100%; height: auto; }
figcaption { color: #556; font-size: .92rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: 1.2rem 0; font-size: .92rem;
        font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .55rem; border-bottom: 1px solid #d8dde6; text-align: right; }
th:first-child, td:first-child { text-align: left; }
td:first-child { min-width: 12rem; } .whole { white-space: nowrap; }
thead th { border-bottom: 2px solid #889; }
code { background: #f0f2f6; padding: .1rem .3rem; border-radius: 3px; }
.lead { font-size: 1.15rem; }
"""


@dataclass(frozen=True, slots=True)
class Table:
    """Words and numbers in rows; the first column says what the row is."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class Picture:
    """A PNG and what it shows."""

    path: Path
    caption: str


Part = str | Table | Picture
"""A paragraph, a table or a picture."""


@dataclass(frozen=True, slots=True)
class Section:
    """A heading and what stands under it."""

    title: str
    parts: tuple[Part, ...]


def write_report(out: Path, title: str, lead: str, sections: Sequence[Section]) -> None:
    """Write report.html, self-contained, and report.md without the pictures, into `out`."""
    body = "".join(_section(each) for each in sections)
    page = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style></head><body>"
        f"<h1>{html.escape(title)}</h1><p class='lead'>{_text(lead)}</p>{body}</body></html>"
    )
    write_whole(out / "report.html", page)
    words = "\n\n".join(_markdown(each) for each in sections)
    write_whole(out / "report.md", f"# {title}\n\n{lead}\n\n{words}\n")


def said(metric: Metric, scale: float = 1.0, digits: int = 1) -> str:
    """A number with its interval, as tables show it."""
    if metric.value != metric.value:
        return "-"
    value, low, high = (
        f"{scale * each:,.{digits}f}" for each in (metric.value, metric.low, metric.high)
    )
    return value if low == high else f"{value} ({low}-{high})"


def _section(section: Section) -> str:
    return f"<h2>{html.escape(section.title)}</h2>" + "".join(map(_part, section.parts))


def _part(part: Part) -> str:
    if isinstance(part, str):
        return f"<p>{_text(part)}</p>"
    if isinstance(part, Picture):
        data = base64.b64encode(part.path.read_bytes()).decode()
        caption = html.escape(part.caption)
        return (
            f'<figure><img alt="{caption}" src="data:image/png;base64,{data}">'
            f"<figcaption>{_text(part.caption)}</figcaption></figure>"
        )
    head = "".join(f"<th>{_text(cell)}</th>" for cell in part.header)
    rows = "".join(
        "<tr>" + "".join(f"<td>{_cell(cell)}</td>" for cell in row) + "</tr>" for row in part.rows
    )
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
    return f"<div class='wide'>{table}</div>"


def _cell(words: str) -> str:
    """What stands in brackets, as intervals do, is not torn apart."""
    return re.sub(r"\([^()]*\)", r"<span class='whole'>\g<0></span>", _text(words))


def _text(words: str) -> str:
    """Escaped; what stands between backticks is code."""
    pieces = html.escape(words, quote=False).split("`")
    return "".join(f"<code>{each}</code>" if k % 2 else each for k, each in enumerate(pieces))


def _markdown(section: Section) -> str:
    blocks = [f"## {section.title}"]
    for part in section.parts:
        if isinstance(part, str):
            blocks.append(part)
        elif isinstance(part, Table):
            lines = [part.header, ("---", *("---:" for _ in part.header[1:])), *part.rows]
            blocks.append("\n".join("| " + " | ".join(line) + " |" for line in lines))
    return "\n\n".join(blocks)
