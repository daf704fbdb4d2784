"""Transfer of this process's registrations to machines that share no files with it."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from hrc_env.core import snapshot
from hrc_env.core.errors import HRCError
from hrc_env.core.registry import share
from hrc_env.core.snapshot import Snapshot
from hrc_env.engines.files import carried_to
from hrc_env.registration import IMPORT, adopt, import_files


@dataclass(frozen=True, slots=True)
class Registrations:
    """Registrations, and the contents of the Python files in which objects are registered."""

    registered: Snapshot
    sources: Mapping[str, bytes]
    """Contents of the files by their paths on the sending machine."""
    imported: tuple[str, ...] = ()
    """Paths of the files named by `--import` and by the environment variable `IMPORT`."""

    def unpack(self) -> None:
        """Repeat all registrations in this process.

        Files that are missing on this machine, or that differ, are written to a temporary folder of
        the user and imported from there.

        Raises:
            HRCError: a file cannot be imported, because a package that it imports is not installed.
        """
        here = {path: str(carried_to(path, text)) for path, text in self.sources.items()}
        for path in self.imported:
            try:
                import_files(here[path])
            except Exception as error:  # raised by a user's file
                raise HRCError(
                    f"{path} cannot be imported on this worker ({type(error).__name__}: {error}). "
                    "Only the file itself is sent: the modules that it imports must be installed "
                    "on the worker."
                ) from error
        entries = {
            kind: {
                name: replace(each, file=here.get(each.file, each.file))
                for name, each in found.items()
            }
            for kind, found in self.registered.entries.items()
        }
        files = tuple(here.get(path, path) for path in self.registered.files)
        snapshot.inherit(Snapshot(entries, files))
        adopt()


def pack() -> Registrations:
    """Return the registrations of this process."""
    share()
    registered = snapshot.current()
    imported = tuple(each for each in os.environ.get(IMPORT, "").split(os.pathsep) if each)
    imported = tuple(str(Path(each).resolve()) for each in imported)
    paths = dict.fromkeys((*imported, *registered.files))
    return Registrations(registered, {path: Path(path).read_bytes() for path in paths}, imported)
