"""The interface of engines, and their choice by name."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from hrc_env.core.errors import ConfigError, check_integer, check_names

Tick = Callable[[float], None]
"""Callback that receives the increase of the completed fraction of a call."""
Call = Callable[[Tick], Any]
"""Function that takes a `Tick`. Its result does not depend on the process that computes it."""
ENGINES = ("serial", "processes", "ray")
"""Names of engines.

`serial` computes calls one after the other in this process, in which environments use all cores.
`processes` computes as many calls in parallel as there are cores, each on one thread. `ray`
computes them as tasks of a Ray cluster.
"""


@dataclass(frozen=True, slots=True)
class Done:
    """Result of a call."""

    k: int
    """Index of the call."""
    result: Any
    seconds: float
    """Duration of the call [s]."""


class Engine(Protocol):
    """Interface of an engine, which computes calls."""

    @property
    def is_parallel(self) -> bool:
        """Whether calls run in other processes, which must be able to unpickle them."""
        ...

    def opened(self) -> AbstractContextManager[object]:
        """Return a context in which successive runs share their workers, if the engine has any."""
        ...

    def run(self, calls: Sequence[Call], tick: Callable[[int, float], None]) -> Iterator[Done]:
        """Compute calls and yield each result as soon as it is available, in any order.

        Args:
            calls: functions of a `Tick`.
            tick: callback that receives the index of a call and the increase of its completed
                fraction; for a call in another process, it is called only once, at the end.

        Raises:
            HRCError: a call raised it, or a worker died repeatedly.
        """
        ...


def engine_called(
    name: str | None, workers: int | None = None, address: str | None = None
) -> Engine | None:
    """Return an engine by name.

    Args:
        name: one of `ENGINES`, or None for no engine.
        workers: number of calls computed in parallel; None: the number of cores.
        address: address of a Ray cluster; None: a new cluster is started on this machine.

    Raises:
        ConfigError: the engine does not exist, or it does not accept workers or an address.
    """
    if name is not None:
        check_names("engine", [name], ENGINES)
    if workers is not None:
        check_integer("workers", workers, 1, 100_000)
    if workers is not None and name in (None, "serial"):
        raise ConfigError("--workers requires --engine processes or --engine ray.")
    if address is not None and name != "ray":
        raise ConfigError(f"--address requires --engine ray, got {name!r}.")
    if name == "ray":
        from hrc_env.engines.ray_tasks import RayTasks  # here: Ray is an extra

        return RayTasks(workers, address)
    from hrc_env.engines.local import Processes, Serial

    return {None: None, "serial": Serial(), "processes": Processes(workers)}[name]
