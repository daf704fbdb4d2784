"""The progress bar that long commands show."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)


@contextmanager
def progress_bar(console: Console, name: str) -> Iterator[Callable[[float, str], None]]:
    """A bar; tell it by how much the share that is done grew, and what is being done."""
    with Progress(
        TextColumn("{task.description:30s}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
    ) as progress:
        task = progress.add_task(name, total=1.0)
        yield lambda share, label: progress.update(task, advance=share, description=label)
