"""Options of commands that compute by an engine, and the choice of that engine."""

from dataclasses import dataclass, fields
from typing import Any, ClassVar

from hrc_env.core.errors import ConfigError
from hrc_env.engines.engine import Engine, engine_called


@dataclass(frozen=True, kw_only=True)
class EngineArguments:
    """Options that choose where parts are computed; the numbers are the same everywhere."""

    stays: ClassVar[str] = ""
    """Why the command computes all of its work in its own process; "" for commands that take
    engines."""
    engine: str | None = None
    """Engine: serial, one part after the other; processes, as many at once as there are cores; ray,
    as tasks of a cluster (docs/many_machines.md). Default: the fastest on this machine."""
    workers: int | None = None
    """With processes and ray: number of parts computed at once (default: all cores)."""
    address: str | None = None
    """With ray: the cluster, as auto, HOST:6379 or ray://HOST:10001 (default: one on this
    machine)."""

    def choose_engine(self) -> Engine | None:
        """Return the engine of the options, or None if none is named.

        Raises:
            ConfigError: the engine does not exist, it takes no workers or address, or the command
                takes no engine.
        """
        if self.stays and self.engine not in (None, "serial"):
            raise ConfigError(
                f"--engine {self.engine} does not work here: {self.stays}. Leave it out."
            )
        return engine_called(self.engine, self.workers, self.address)

    def exclude_engine(self) -> dict[str, Any]:
        """Return the arguments other than the engine's by name."""
        names = {field.name for field in fields(self)} - {f.name for f in fields(EngineArguments)}
        return {name: getattr(self, name) for name in names}
