"""Play probes in several processes."""

import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from tests.behaviour.probe import Difference, RecordingError
from tests.behaviour.rooms import Placed, check, find

BOUNDED = ("tracker", "emulator", "motion", "shield")
"""Rooms whose code is compiled kernels for the most part."""


def bounds_checked(kernels: Path) -> dict[str, str]:
    """Return the environment variables with which a kernel raises `IndexError` where it reads or
    writes past the end of an array; kernels that do so are compiled into a folder of their own."""
    return {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(kernels)}


@dataclass(frozen=True, slots=True)
class Outcome:
    """What playing one probe has shown."""

    label: str
    differences: tuple[Difference, ...]
    error: str
    """Why it could not be compared; "" if it was."""
    seconds: float

    @property
    def is_same(self) -> bool:
        """Whether the probe did as recorded."""
        return not self.differences and not self.error


def play_all(wanted: Sequence[Placed], n_processes: int, console: Console) -> Iterator[Outcome]:
    """Yield the outcomes of probes, played in some processes, as they come."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # processes share the cores
    pool = ProcessPoolExecutor(n_processes, mp_context=get_context("spawn"))
    with pool, Progress(console=console, transient=True) as progress:
        bar = progress.add_task("playing probes", total=len(wanted))
        futures = [pool.submit(play, each.label) for each in wanted]
        for future in as_completed(futures):
            progress.advance(bar)
            yield future.result()


def play(label: str) -> Outcome:
    """Play one probe and return what it shows."""
    started_s = time.monotonic()
    differences: list[Difference] = []
    error = ""
    try:
        differences = check(find(label))
    except RecordingError as missing:
        error = str(missing)
    except Exception as failure:
        error = f"raised {type(failure).__name__}: {failure}"
    return Outcome(label, tuple(differences), error, time.monotonic() - started_s)
