"""Transfer of files to machines that do not have them."""

import hashlib
from pathlib import Path

from hrc_env.core.folders import temporary_cache


class CarriedFile(str):
    """Path of a file whose content is pickled with it.

    When it is unpickled, it becomes the path of a file with the same content: the original path if
    this file exists there, otherwise a path in the user's temporary folder.
    """

    def __reduce__(self) -> tuple[object, tuple[str, bytes]]:
        """Return the function that restores the path, and its arguments: path and content."""
        return carried_to, (str(self), Path(self).read_bytes())


def carried(name: str) -> str:
    """Return the name as a `CarriedFile` if a file of this name exists, otherwise unchanged."""
    return CarriedFile(name) if Path(name).is_file() else name


def carried_to(path: str, content: bytes) -> CarriedFile:
    """Return the path of a file with this content on this machine, writing it if necessary."""
    here = Path(path)
    if here.is_file() and here.read_bytes() == content:
        return CarriedFile(path)
    from hrc_env.core.results import write_whole  # takes time to import

    digest = hashlib.sha256(content).hexdigest()[:16]
    placed = temporary_cache() / "carried" / digest / here.name
    placed.parent.mkdir(parents=True, exist_ok=True)
    write_whole(placed, content)
    return CarriedFile(placed)
