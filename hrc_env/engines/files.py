"""Files on their way to machines that do not have them."""

import hashlib
from pathlib import Path

from hrc_env.core.folders import temporary_cache


class CarriedFile(str):
    """The path of a file; pickled it takes the file along.

    Unpickled it is the path of a file of the same content: the same path where the file is there,
    else one in a folder of this user's temporary files.
    """

    def __reduce__(self) -> tuple[object, tuple[str, bytes]]:
        """Return the function that makes the path anew, and the content of the file."""
        return carried_to, (str(self), Path(self).read_bytes())


def carried(name: str) -> str:
    """Return a name, of which a file that is there travels with it."""
    return CarriedFile(name) if Path(name).is_file() else name


def carried_to(path: str, content: bytes) -> CarriedFile:
    """Return the path of a file of this content on this machine, written if need be."""
    here = Path(path)
    if here.is_file() and here.read_bytes() == content:
        return CarriedFile(path)
    from hrc_env.core.results import write_whole  # takes time to import

    digest = hashlib.sha256(content).hexdigest()[:16]
    placed = temporary_cache() / "carried" / digest / here.name
    placed.parent.mkdir(parents=True, exist_ok=True)
    write_whole(placed, content)
    return CarriedFile(placed)
