"""Play the probes and compare them with what was recorded: python -m tests.behaviour

    python -m tests.behaviour                    # all of them, in as many processes as cores
    python -m tests.behaviour env shield --short # two rooms, the short form
    python -m tests.behaviour --accept           # record what differs, and raise versions
    python -m tests.behaviour --bounds           # no kernel reads or writes past an array's end
    python -m tests.behaviour --commits          # no commit changes doors and recordings at once

A difference is given by name, by the first step in which it is seen, and by its size. To accept
it, commit the code that makes it, add the line to CHANGELOG.md that the command asks for, and run
it with `--accept`: the subsystems that moved get a new number in `behaviour.toml`.
"""

import os
import sys
import time
from dataclasses import dataclass
from typing import Annotated

import tyro
from rich.console import Console

from tests.behaviour import accept
from tests.behaviour.playing import BOUNDED, bounds_checked, play_all
from tests.behaviour.rooms import ROOMS, find, probes

BOUNDED_KERNELS = accept.ROOT / "out" / "bounds"
"""Kernels that check every index."""


@dataclass(frozen=True)
class Arguments:
    """Compare the behaviour of this code with what was recorded."""

    rooms: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Rooms to play; all if none is given."""
    short: bool = False
    """Play the covering short form only."""
    accept: bool = False
    """Record what differs and raise the version of each subsystem that moved."""
    bounds: bool = False
    """Play the probes of kernels with each index checked; these are compiled once more for it."""
    commits: bool = False
    """Check instead that no commit changes doors.py and recorded values at once."""
    processes: int = os.cpu_count() or 1
    """How many probes are played at once."""


def main(arguments: Arguments) -> int:
    """Play and compare; 0 if nothing differs."""
    console = Console()
    if arguments.commits:
        return accept.check_commits(console)
    rooms = arguments.rooms
    if arguments.bounds:
        os.environ.update(bounds_checked(BOUNDED_KERNELS))
        rooms = rooms or BOUNDED
    unknown = [room for room in arguments.rooms if room not in ROOMS]
    if unknown:
        console.print(f"There is no room {unknown[0]!r}; there are {', '.join(ROOMS)}.")
        return 2
    if arguments.accept:
        accept.check_ready()
    wanted = list(probes(rooms or tuple(ROOMS), arguments.short))
    started_s = time.monotonic()
    outcomes = list(play_all(wanted, arguments.processes, console))
    moved = [each for each in outcomes if not each.is_same]
    for each in moved:
        console.print(f"[bold]{each.label}[/] {each.error}", highlight=False)
        for difference in each.differences:
            console.print(f"    {difference}", highlight=False, markup=False)
    took_s = time.monotonic() - started_s
    console.print(f"{len(outcomes)} probes in {took_s:.0f} s: {len(moved)} differ.")
    if arguments.accept:
        return accept.accept([find(each.label) for each in moved], console)
    return int(bool(moved))


def run() -> int:
    """Parse the command line and run; refusals are printed in words."""
    try:
        return main(tyro.cli(Arguments, description=__doc__))
    except accept.RefusedError as refusal:
        Console(stderr=True).print(f"[red]Refused:[/] {refusal}", highlight=False)
        return 2


if __name__ == "__main__":
    sys.exit(run())
