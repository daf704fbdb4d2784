"""The engine `ray`, which computes each call as a task of a Ray cluster."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

from hrc_env.core.errors import DownloadError, HRCError, RenderingError
from hrc_env.engines import cluster  # first: its error explains how to install Ray
from hrc_env.engines.engine import Call, Done
from hrc_env.engines.local import ATTEMPTS, TimedResult, call_pickled, pickled
from hrc_env.engines.registrations import Registrations, pack

import ray  # isort: skip
from ray.exceptions import RayError, RayTaskError  # isort: skip


@dataclass(frozen=True, slots=True)
class RayTasks:
    """Engine that computes each call as a Ray task on one core.

    Ray restarts a task if its worker or machine dies.
    """

    workers: int | None = None
    """Number of calls computed in parallel; None: the number of cores of the cluster."""
    address: str | None = None
    """Address of the cluster, as in `cluster.connected`."""
    note: Callable[[str], None] = print
    """Callback that receives messages about the cluster for the user."""
    is_parallel = True

    def opened(self) -> AbstractContextManager[object]:
        """Return a context in which this process is connected to the cluster."""
        return cluster.connected(self.address, self.note)

    def run(self, calls: Sequence[Call], tick: Callable[[int, float], None]) -> Iterator[Done]:
        """Compute calls on the cluster, as described in `Engine.run`."""
        with cluster.connected(self.address, self.note) as machines:
            cluster.check_machines(machines, None, self.note)
            n = self.workers or int(sum(each.n_cores for each in machines)) or 1
            share = cluster.share_of(n, machines, self.note)
            task = ray.remote(_compute).options(num_cpus=share, max_retries=ATTEMPTS - 1)
            registered, waiting = ray.put(pack()), [*enumerate(calls)]
            running: dict[Any, int] = {}
            while waiting or running:
                while waiting and len(running) < n:
                    k, call = waiting.pop(0)
                    running[task.remote(registered, pickled(call))] = k
                finished, _ = ray.wait([*running])
                for each in finished:
                    k = running.pop(each)
                    done = Done(k, *_fetch(each, k))
                    tick(k, 1.0)
                    yield done


def _compute(registrations: Registrations, call: bytes) -> TimedResult:
    """Compute a pickled call in a worker and return its result and duration."""
    cluster.one_core()
    with cluster.plain_errors():
        registrations.unpack()
        try:
            return call_pickled(call)
        except (RenderingError, DownloadError) as error:  # something is missing on this machine
            address = ray.util.get_node_ip_address()
            raise type(error)(f"Machine {address} cannot work: {error}") from error


def _fetch(answer: Any, k: int) -> TimedResult:
    """Return the result of a call, or raise the `HRCError` that the call raised."""
    try:
        return ray.get(answer)
    except RayTaskError as error:
        if isinstance(error.cause, HRCError):
            raise error.cause from error
        raise HRCError(f"A worker of Ray failed: {cluster.reason_of(error)}") from error
    except RayError as error:
        raise HRCError(
            f"The worker of call {k + 1} died {ATTEMPTS} times: {cluster.reason_of(error)} "
            "Finished parts are kept."
        ) from error
