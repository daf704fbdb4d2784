"""Names of the files in which child processes find the registrations of this process."""

import os
from tempfile import gettempdir

VARIABLE = "HRC_ENV_REGISTERED"
"""Environment variable with the registration files of this process, its parent and so on.

The paths are separated like the folders in PATH; the first existing file is used. See
`core.snapshot`.
"""


def reserve() -> str:
    """Reserve a file name for child processes, and return the inherited file, or "" for none.

    Processes that are started before the first registration also know the name.
    """
    named = os.environ.get(VARIABLE, "")
    found = existing(named)
    if not is_own(named):
        prepend(os.path.dirname(found) or new_folder())
    return found


def prepend(folder: str) -> str:
    """Put a new file of this process in front of `VARIABLE`, and return its path."""
    path = os.path.join(folder, f"{os.getpid()}_{os.urandom(4).hex()}.pickle")
    os.environ[VARIABLE] = os.pathsep.join(filter(None, (path, os.environ.get(VARIABLE))))
    return path


def existing(named: str) -> str:
    """Return the first of several files that exists, or "" if none exists."""
    return next((path for path in named.split(os.pathsep) if path and os.path.exists(path)), "")


def new_folder() -> str:
    """Return the path of a folder that does not exist yet."""
    return os.path.join(gettempdir(), f"hrc_env_{os.urandom(8).hex()}")


def is_own(named: str) -> bool:
    """Return whether the first of several files belongs to this process."""
    return os.path.basename(named.split(os.pathsep)[0]).startswith(f"{os.getpid()}_")
