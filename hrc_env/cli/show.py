"""Run what writes a report, and show it."""

from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.markdown import Markdown

from hrc_env.cli.checks import writable_folder
from hrc_env.core.progress import Say, progress_bar


def show(run: Callable[[Path, Say], object], out: Path, name: str) -> int:
    """Run a bench or an experiment under a progress bar, then show its report.md."""
    writable_folder(out)
    console = Console()
    with progress_bar(console, name) as say:
        run(out, say)
    console.print(Markdown((out / "report.md").read_text()))
    console.print(f"In [bold]{out}[/]: report.html, results.json, figures/")
    return 0
