"""Where a command computes: its options, and the engine that they name."""

from dataclasses import dataclass, fields
from typing import Any, ClassVar

from hrc_env.core.errors import ConfigError
from hrc_env.engines.engine import Engine, engine_called


@dataclass(frozen=True, kw_only=True)
class EngineArguments:
    """Where parts are played; their numbers are the same everywhere."""

    stays: ClassVar[str] = ""
    """Why all of a command is played in its own process; "" of commands that take engines."""
    engine: str | None = None
    """Engine: serial, one part after the other; processes, as many at once as there are cores; ray,
    as tasks of a cluster (docs/many_machines.md). If not given, what is faster on this
    machine."""
    workers: int | None = None
    """With processes and ray: how many parts are played at once; all cores if not given."""
    address: str | None = None
    """With ray: the cluster, as auto, HOST:6379 or ray://HOST:10001; one on this machine if not
    given."""

    def chosen(self) -> Engine | None:
        """Return the engine, or None if none is named.

        Raises:
            ConfigError: there is no such engine, it takes no workers or address, or the command
                takes none.
        """
        if self.stays and self.engine not in (None, "serial"):
            raise ConfigError(f"--engine {self.engine} cannot be: {self.stays}. Leave it out.")
        return engine_called(self.engine, self.workers, self.address)

    def without_engine(self) -> dict[str, Any]:
        """Return the other arguments by name."""
        ours = {each.name for each in fields(EngineArguments)}
        return {each.name: getattr(self, each.name) for each in fields(self)
                if each.name not in ours}  # fmt: skip
