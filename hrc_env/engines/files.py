"""Transfer of files to machines that do not have them."""

import hashlib
from pathlib import Path

from hrc_env.core.folders import temporary_cache


class CarriedFile(str):
    """Path of a file whose content is pickled with it.

    Unpickled it is the path of a file of the same content: the same path where this file exists,
    else one in a folder of this user's temporary files.
    """

    def __reduce__(self) -> tuple[object, tuple[str, bytes]]:
        """Return the function that restores the path, and the content of the file."""
        return carried_to, (str(self), Path(self).read_bytes())


def carried(name: str) -> str:
    """Return a name; the file of this name, if it exists, is transferred with it."""
    return CarriedFile(name) if Path(name).is_file() else name


def carried_to(path: str, content: bytes) -> CarriedFile:
    """Return the path of a file of this content on this machine, written if necessary."""
    here = Path(path)
    if here.is_file() and here.read_bytes() == content:
        return CarriedFile(path)
    from hrc_env.core.results import write_whole  # takes time to import

    digest = hashlib.sha256(content).hexdigest()[:16]
    placed = temporary_cache() / "carried" / digest / here.name
    placed.parent.mkdir(parents=True, exist_ok=True)
    write_whole(placed, content)
    return CarriedFile(placed)
