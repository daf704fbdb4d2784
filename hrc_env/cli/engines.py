"""Command-line options that choose the engine of a command."""

from dataclasses import dataclass, fields
from typing import Any, ClassVar

from hrc_env.core.errors import ConfigError
from hrc_env.engines.engine import Engine, engine_called


@dataclass(frozen=True, kw_only=True)
class EngineArguments:
    """Options of the engine that computes the parts of a run; it does not affect the results."""

    stays: ClassVar[str] = ""
    """Reason why the command supports only the engine `serial`; "" if it supports all engines."""
    engine: str | None = None
    """Engine: serial (one part after the other), processes (one part per core in parallel) or ray
    (tasks of a cluster; docs/many_machines.md). Default: the fastest on this machine."""
    workers: int | None = None
    """With processes and ray: number of parts computed in parallel (default: number of cores)."""
    address: str | None = None
    """With ray: address of the cluster, such as auto, HOST:6379 or ray://HOST:10001 (default: a new
    cluster on this machine)."""

    def choose_engine(self) -> Engine | None:
        """Return the engine that the options select, or None if they select none.

        Raises:
            ConfigError: the engine does not exist, does not accept workers or an address, or is not
                supported by the command.
        """
        if self.stays and self.engine not in (None, "serial"):
            raise ConfigError(
                f"--engine {self.engine} is not available here: {self.stays}. Leave out this "
                "option."
            )
        return engine_called(self.engine, self.workers, self.address)

    def exclude_engine(self) -> dict[str, Any]:
        """Return all arguments except those of the engine, by name."""
        names = {field.name for field in fields(self)} - {f.name for f in fields(EngineArguments)}
        return {name: getattr(self, name) for name in names}
