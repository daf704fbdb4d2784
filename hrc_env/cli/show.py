"""Run a function that writes a report, and print the report."""

from collections.abc import Callable
from itertools import groupby
from pathlib import Path

from rich.console import Console
from rich.markdown import Markdown

from hrc_env.cli.checks import check_writable_folder
from hrc_env.core.progress import Say, progress_bar


def show(run: Callable[[Path, Say], object], out: Path, name: str) -> int:
    """Run a benchmark or an experiment with a progress bar, and print its report.md."""
    check_writable_folder(out)
    console = Console()
    with progress_bar(console, name) as say:
        run(out, say)
    print_report(console, (out / "report.md").read_text())
    console.print(f"In [bold]{out}[/]: report.html, results.json, figures/")
    return 0


def print_report(console: Console, text: str) -> None:
    """Print a report in Markdown.

    The report is rendered if its tables fit in the terminal. Otherwise its source is printed with
    aligned table columns, so that no number is cut off.
    """
    text = align_tables(text)
    widest = max((len(line) for line in text.splitlines() if line.startswith("|")), default=0)
    if console.is_terminal and widest <= console.width:
        console.print(Markdown(text))
    else:
        console.print(text, markup=False, highlight=False, soft_wrap=True)


def align_tables(text: str) -> str:
    """Return Markdown in which all cells of a table column are padded to the same width."""
    blocks = groupby(text.splitlines(), key=lambda line: line.startswith("|"))
    return "\n".join(
        line for is_table, lines in blocks for line in (_align([*lines]) if is_table else lines)
    )


def _align(lines: list[str]) -> list[str]:
    rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines]
    if len({len(row) for row in rows}) > 1:  # a cell with a bar in it
        return lines
    if len(rows) < 2:
        return lines
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    is_right = [cell.endswith(":") for cell in rows[1]]
    return [f"| {' | '.join(map(_pad, row, widths, is_right))} |" for row in rows]


def _pad(cell: str, width: int, is_right: bool) -> str:
    if set(cell) <= {"-", ":"} and len(cell) > 2:  # a single dash is a missing number
        return "-" * (width - 1) + ":" if is_right else "-" * width
    return cell.rjust(width) if is_right else cell.ljust(width)
