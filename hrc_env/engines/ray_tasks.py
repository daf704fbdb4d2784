"""Engine `ray`: every call is a task of a cluster."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

from hrc_env.core.errors import DownloadError, HRCError, RenderingError
from hrc_env.engines import cluster  # first: it says how Ray is installed where it is missing
from hrc_env.engines.engine import Call, Done
from hrc_env.engines.local import ATTEMPTS, TimedResult, call_pickled, pickled
from hrc_env.engines.registrations import Registrations, pack

import ray  # isort: skip
from ray.exceptions import RayError, RayTaskError  # isort: skip


@dataclass(frozen=True, slots=True)
class RayTasks:
    """Tasks of one core each; Ray restarts tasks whose worker or machine died."""

    workers: int | None = None
    """Number of calls at a time; None: the number of cores of the cluster."""
    address: str | None = None
    """Address of the cluster, as of `cluster.connected`."""
    note: Callable[[str], None] = print
    """Receives notes on the cluster."""
    is_parallel = True

    def opened(self) -> AbstractContextManager[object]:
        """As of `Engine`: a connection to the cluster."""
        return cluster.connected(self.address, self.note)

    def run(self, calls: Sequence[Call], tick: Callable[[int, float], None]) -> Iterator[Done]:
        """Compute calls as of `Engine`."""
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
    """Return the result of a pickled call, with its duration."""
    cluster.one_core()
    with cluster.plain_errors():
        registrations.unpack()
        try:
            return call_pickled(call)
        except (RenderingError, DownloadError) as error:  # of what the machine lacks
            address = ray.util.get_node_ip_address()
            raise type(error)(f"Machine {address} cannot work: {error}") from error


def _fetch(answer: Any, k: int) -> TimedResult:
    """Return the result of a call; an `HRCError` of the call is raised again."""
    try:
        return ray.get(answer)
    except RayTaskError as error:
        if isinstance(error.cause, HRCError):
            raise error.cause from error
        raise HRCError(f"A worker of Ray failed: {cluster.reason_of(error)}") from error
    except RayError as error:
        raise HRCError(
            f"The worker of call {k + 1} died {ATTEMPTS} times: {cluster.reason_of(error)} What is "
            "finished is kept."
        ) from error
