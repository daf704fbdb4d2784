"""The engines by name, and what they have in common."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from hrc_env.core.errors import ConfigError, check_names, whole

Tick = Callable[[float], None]
"""Receives the growth of the finished share of a call."""
Call = Callable[[Tick], Any]
"""Something to be computed, of what it was made with alone: the result is the same everywhere."""
ENGINES = ("serial", "processes", "ray")
"""One call after the other in this process, whose environments share all cores; as many processes
as cores, of one thread each; tasks of Ray."""


@dataclass(frozen=True, slots=True)
class Done:
    """A call that has returned."""

    k: int
    """Its number."""
    result: Any
    seconds: float
    """Time that it took."""


class Engine(Protocol):
    """Computes calls."""

    @property
    def is_parallel(self) -> bool:
        """Whether calls run in other processes, which must be able to unpickle them."""
        ...

    def opened(self) -> AbstractContextManager[object]:
        """Return a context in which one run after the other has the same workers, if they can."""
        ...

    def run(self, calls: Sequence[Call], tick: Callable[[int, float], None]) -> Iterator[Done]:
        """Compute calls; yield each as soon as it is done, in any order.

        Args:
            calls: functions of a `Tick`.
            tick: receives the number of a call and the growth of its finished share; of a call in
                another process once, at its end.

        Raises:
            HRCError: an error of a call; or a worker died again and again.
        """
        ...


def engine_called(
    name: str | None, workers: int | None = None, address: str | None = None
) -> Engine | None:
    """Return an engine.

    Args:
        name: one of `ENGINES`; None: none is chosen.
        workers: calls that are computed at once; None: as many as there are cores.
        address: of a cluster of Ray; None: one that is started on this machine.

    Raises:
        ConfigError: no such engine, or it takes no workers or no address.
    """
    if name is not None:
        check_names("engine", [name], ENGINES)
    if workers is not None:
        whole("workers", workers, 1, 100_000)
    if workers is not None and name in (None, "serial"):
        raise ConfigError("--workers goes with --engine processes or --engine ray.")
    if address is not None and name != "ray":
        raise ConfigError(f"--address is of a cluster of Ray, as with --engine ray, got {name}.")
    if name == "ray":
        from hrc_env.engines.ray_tasks import RayTasks  # here: Ray is an extra

        return RayTasks(workers, address)
    from hrc_env.engines.local import Processes, Serial

    return {None: None, "serial": Serial(), "processes": Processes(workers)}[name]
