"""Progress of long computations: a bar in a terminal, otherwise a line every ten seconds."""

import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sized
from contextlib import contextmanager
from datetime import timedelta
from typing import Self, TypeVar

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

EVERY_S = 10.0
"""Time between two lines in a log file [s]."""
T = TypeVar("T")
Say = Callable[[float, str], None]


class Meter:
    """Display of the progress and the remaining time of a computation.

    Counts are shown if they have a unit. Without a terminal, plain lines are printed.
    """

    def __init__(
        self,
        console: Console,
        name: str,
        total: float = 1.0,
        unit: str = "",
        done: float = 0.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.name, self.total, self.done, self.note = name, total, done, ""
        self._before, self._clock = done, clock
        self._counted = f"{{task.completed:,.0f}} of {{task.total:,.0f}} {unit}" if unit else ""
        self._bar = Progress(
            TextColumn("{task.description:30s}"), BarColumn(),
            TextColumn("{task.percentage:3.0f} %"), TextColumn(self._counted),
            TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(),
            TextColumn("{task.fields[note]}"), console=console, disable=not console.is_terminal,
        )  # fmt: skip

    def __enter__(self) -> Self:
        self._began_s = self._line_s = self._clock()
        self._task = self._bar.add_task(self.name, total=self.total, note="")
        self._bar.start()
        self.show(self.done)
        return self

    def __exit__(self, *_: object) -> None:
        if not self._bar.disable:  # rich before 15 ends with an empty line
            self._bar.stop()
        if self._line_s > self._began_s:
            self._say()

    def show(self, done: float, name: str | None = None, note: str = "") -> None:
        """Show the progress.

        Args:
            done: amount of work completed, out of `total`.
            name: current activity; None keeps the previous one.
            note: a remark, such as the latest result.
        """
        self.done, self.name, self.note = done, name or self.name, note
        self._bar.update(self._task, completed=done, description=self.name, note=note)
        if self._bar.disable and self._clock() - self._line_s >= EVERY_S:
            self._say()

    def say(self, sentence: str) -> None:
        """Print a sentence above the bar."""
        self._bar.console.print(sentence, markup=False, highlight=False, soft_wrap=True)

    def _say(self) -> None:
        """Print a line with the completed fraction, count, elapsed time and remaining time."""
        self._line_s, task = self._clock(), self._bar.tasks[0]
        passed_s, since = self._line_s - self._began_s, self.done - self._before
        left = _time(max(self.total - self.done, 0.0) / since * passed_s) if since > 0 else "?"
        parts = f"{task.percentage:.0f} %", self._counted.format(task=task)
        parts = *parts, f"{_time(passed_s)} passed, {left} left", self.note
        said = f"{self.name}: {', '.join(filter(None, parts))}"
        self._bar.console.print(said, markup=False, highlight=False, soft_wrap=True)


@contextmanager
def progress_bar(console: Console, name: str) -> Generator[Say]:
    """Yield a callback, as described at `Say`, that advances a progress bar."""
    with Meter(console, name) as meter:
        yield lambda share, label: meter.show(meter.done + share, label)


def track(
    values: Iterable[T], description: str, total: int | None = None, console: Console | None = None
) -> Iterator[T]:
    """Yield the values one by one while showing the progress.

    Args:
        values: the values.
        description: name of the computation.
        total: number of values; None for the length of `values`.
        console: console for the progress bar; None for the standard output.
    """
    n = len(values) if total is None and isinstance(values, Sized) else total or 0
    with Meter(console or Console(), description, n) as meter:
        for k, value in enumerate(values, 1):
            yield value
            meter.show(k)


def _time(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))
