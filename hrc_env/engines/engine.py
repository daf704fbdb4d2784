"""Engines by name, and their protocol."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from hrc_env.core.errors import ConfigError, check_integer, check_names

Tick = Callable[[float], None]
"""Receives the increase of the completed share of a call."""
Call = Callable[[Tick], Any]
"""A computation that depends only on its construction: its result is the same everywhere."""
ENGINES = ("serial", "processes", "ray")
"""`serial` computes one call after the other in this process, whose environments share all cores;
`processes` as many at once as there are cores, on one thread each; `ray` as tasks of Ray."""


@dataclass(frozen=True, slots=True)
class Done:
    """Result of a call."""

    k: int
    """Number of the call."""
    result: Any
    seconds: float
    """Duration of the call."""


class Engine(Protocol):
    """Computes calls."""

    @property
    def is_parallel(self) -> bool:
        """True if calls run in other processes, which must be able to unpickle them."""
        ...

    def opened(self) -> AbstractContextManager[object]:
        """Return a context in which one run after the other has the same workers, if they can."""
        ...

    def run(self, calls: Sequence[Call], tick: Callable[[int, float], None]) -> Iterator[Done]:
        """Compute calls; yield each result as soon as it is there, in any order.

        Args:
            calls: functions of a `Tick`.
            tick: receives the number of a call and the increase of its completed share; for a call
                in another process once, at its end.

        Raises:
            HRCError: an error of a call; or a worker died repeatedly.
        """
        ...


def engine_called(
    name: str | None, workers: int | None = None, address: str | None = None
) -> Engine | None:
    """Return an engine.

    Args:
        name: one of `ENGINES`; None: no engine.
        workers: number of calls at a time; None: the number of cores.
        address: address of a cluster of Ray; None: one that is started on this machine.

    Raises:
        ConfigError: there is no such engine, or it takes no workers or no address.
    """
    if name is not None:
        check_names("engine", [name], ENGINES)
    if workers is not None:
        check_integer("workers", workers, 1, 100_000)
    if workers is not None and name in (None, "serial"):
        raise ConfigError("--workers goes with --engine processes or --engine ray.")
    if address is not None and name != "ray":
        raise ConfigError(f"--address is of a cluster of Ray, as with --engine ray, got {name}.")
    if name == "ray":
        from hrc_env.engines.ray_tasks import RayTasks  # here: Ray is an extra

        return RayTasks(workers, address)
    from hrc_env.engines.local import Processes, Serial

    return {None: None, "serial": Serial(), "processes": Processes(workers)}[name]
