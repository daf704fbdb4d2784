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
"""Maximum number of attempts to compute calls if processes die."""
SINGLE = {CORES: "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Environment variables with which a process computes on one core."""


@dataclass(frozen=True, slots=True)
class Serial:
    """Engine that computes calls one after the other in this process."""

    is_parallel = False

    def opened(self) -> AbstractContextManager[object]:
        """Return a context without effect, because there are no workers."""
        return nullcontext()

    def run(self, calls: Sequence[Call], tick: Callable[[int, float], None]) -> Iterator[Done]:
        """Compute calls one after the other, as described in `Engine.run`."""
        for k, call in enumerate(calls):
            started_s = time.monotonic()
            result = call(partial(tick, k))
            yield Done(k, result, time.monotonic() - started_s)


@dataclass(frozen=True, slots=True)
class Processes:
    """Engine that computes calls in processes on this machine, on one core each."""

    workers: int | None = None
    """Number of processes; None: the number of cores."""
    is_parallel = True

    def opened(self) -> AbstractContextManager[object]:
        """Return a context without effect, because each run starts new processes."""
        return nullcontext()

    def run(self, calls: Sequence[Call], tick: Callable[[int, float], None]) -> Iterator[Done]:
        """Compute calls as described in `Engine.run`, and repeat them if their process dies."""
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
                        f"Worker processes died {deaths} times before call {min(left) + 1} of "
                        f"{len(calls)} was finished: they were killed or ran out of memory. "
                        "Finished parts are kept; fewer --workers need less memory."
                    ) from error

    def _run_once(self, calls: dict[int, Call]) -> Iterator[Done]:
        """Compute calls with one pool of processes and yield results until a process dies."""
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
    """Start a thread that ends this process when its parent ends, even if the parent is killed."""
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
    """Compute a pickled call and return its result and duration."""
    import cloudpickle

    started_s = time.monotonic()
    result = cloudpickle.loads(call)(ignore)
    return TimedResult(result, time.monotonic() - started_s)


def ignore(share: float) -> None:
    """Discard the progress of a call."""


def pickled(call: Call) -> bytes:
    """Pickle a call; functions from a script or a notebook are pickled by value."""
    import cloudpickle  # takes time to import

    return cloudpickle.dumps(call)


@contextmanager
def _variables(values: dict[str, str]) -> Iterator[None]:
    """Set environment variables for the processes started within this context."""
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
