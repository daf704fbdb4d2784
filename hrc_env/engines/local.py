"""Engines on this machine."""

import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from hrc_env.core.errors import HRCError
from hrc_env.core.machine import CORES, n_cores
from hrc_env.engines.engine import Call, Done

ATTEMPTS = 3
"""Number of attempts at a call whose process died."""
SINGLE = {CORES: "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Environment variables of a process that computes on one core."""


@dataclass(frozen=True, slots=True)
class Serial:
    """One call after the other, in this process."""

    is_parallel = False

    def opened(self) -> AbstractContextManager[object]:
        """As of `Engine`."""
        return nullcontext()

    def run(self, calls: Sequence[Call], tick: Callable[[int, float], None]) -> Iterator[Done]:
        """Compute calls as of `Engine`."""
        for k, call in enumerate(calls):
            started_s = time.monotonic()
            result = call(partial(tick, k))
            yield Done(k, result, time.monotonic() - started_s)


@dataclass(frozen=True, slots=True)
class Processes:
    """Processes on this machine, each of which computes on one core."""

    workers: int | None = None
    """Number of processes; None: the number of cores."""
    is_parallel = True

    def opened(self) -> AbstractContextManager[object]:
        """As of `Engine`; each run starts processes of its own."""
        return nullcontext()

    def run(self, calls: Sequence[Call], tick: Callable[[int, float], None]) -> Iterator[Done]:
        """Compute calls as of `Engine`; unfinished calls of a process that died are repeated."""
        left, deaths = dict(enumerate(calls)), 0
        while left:
            try:
                for done in self._run_once(left):
                    del left[done.k]
                    tick(done.k, 1.0)
                    yield done
            except BrokenProcessPool as error:
                deaths += 1
                if deaths == ATTEMPTS:
                    raise HRCError(
                        f"Worker processes died {deaths} times before call "
                        f"{min(left) + 1} of {len(calls)} was done: killed, or out of memory. "
                        "What is finished is kept; fewer --workers need less memory."
                    ) from error

    def _run_once(self, calls: dict[int, Call]) -> Iterator[Done]:
        """Compute calls with one pool; yield the results that are there before a process dies."""
        n = min(self.workers or n_cores(), len(calls))
        context = multiprocessing.get_context("spawn")
        made = partial(ProcessPoolExecutor, n, mp_context=context, initializer=end_with_parent)
        with _variables(SINGLE), made() as pool:
            running: dict[Future[Any], int] = {
                pool.submit(call_pickled, pickled(call)): k for k, call in calls.items()
            }
            try:
                while running:
                    finished, _ = wait(running, return_when=FIRST_COMPLETED)
                    for future in finished:
                        k = running.pop(future)
                        yield Done(k, *future.result())
            finally:
                pool.shutdown(wait=False, cancel_futures=True)


def end_with_parent() -> None:
    """End this process as soon as its parent has ended, also if that was killed."""
    parent = multiprocessing.parent_process()

    def wait_for_end() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait_for_end, daemon=True, name="hrc_env-parent").start()


class TimedResult(NamedTuple):
    """The result of a call."""

    result: Any
    """Return value of the call."""
    seconds: float
    """Duration of the call [s]."""


def call_pickled(call: bytes) -> TimedResult:
    """Return the result of a pickled call, with its duration."""
    import cloudpickle

    started_s = time.monotonic()
    result = cloudpickle.loads(call)(ignore)
    return TimedResult(result, time.monotonic() - started_s)


def ignore(share: float) -> None:
    """Discard the progress of a call."""


def pickled(call: Call) -> bytes:
    """Pickle a call, of a script or a notebook by value."""
    import cloudpickle  # takes time to import

    return cloudpickle.dumps(call)


@contextmanager
def _variables(values: dict[str, str]) -> Iterator[None]:
    """Set environment variables for processes that are started inside."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
