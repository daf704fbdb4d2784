"""The rooms that have probes, and which numbered subsystem (`behaviour.toml`) each one speaks for.

Every room is a module of this folder with a tuple `PROBES`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module

from tests.behaviour.probe import Difference, Probe, compare, path_of, read

ROOMS: dict[str, str] = {
    "env": "env",
    "agents": "agents",
    "learning": "agents",
    "tracker": "tracker",
    "emulator": "emulator",
    "detector": "detector",
    "motion": "motion",
    "importer": "motion",
    "shield": "shield",
}
"""Room to subsystem."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A probe, and the room that it is of."""

    room: str
    probe: Probe

    @property
    def label(self) -> str:
        """As the command line names it."""
        return f"{self.room}/{self.probe.name}"


def probes(rooms: tuple[str, ...] = tuple(ROOMS), only_short: bool = False) -> Iterator[Placed]:
    """Yield the probes of some rooms, those of the short form only if asked."""
    for room in rooms:
        for probe in import_module(f"tests.behaviour.{room}").PROBES:
            if probe.is_short or not only_short:
                yield Placed(room, probe)


def find(label: str) -> Placed:
    """Return a probe by its label, ROOM/NAME."""
    return next(each for each in probes((label.partition("/")[0],)) if each.label == label)


def check(placed: Placed) -> list[Difference]:
    """Play a probe again and return what differs from its recording.

    Raises:
        RecordingError: it has none that can be read.
    """
    probe = placed.probe
    inputs, recorded = read(path_of(placed.room, probe))
    return compare(recorded, probe.play(inputs), probe.tolerance)
