"""Writable folders for files that are kept between runs.

They exist even if the home folder or the package's folder is read-only.
"""

import contextlib
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Generator
from functools import lru_cache
from pathlib import Path


def usual_cache() -> Path | None:
    """Return the folder `hrc_env` in the user's cache, or None if there is no home directory.

    The folder need not exist.
    """
    chosen = os.environ.get("XDG_CACHE_HOME")
    if sys.platform == "win32":
        chosen = chosen or os.environ.get("LOCALAPPDATA")
    usual = {"darwin": "~/Library/Caches", "win32": "~/AppData/Local"}.get(sys.platform, "~/.cache")
    try:
        return Path(chosen or usual).expanduser() / "hrc_env"
    except RuntimeError:  # no HOME, and an unknown user ID
        return None


def user_cache() -> Path:
    """Return the user's cache folder if it is writable, or else a temporary folder."""
    usual = usual_cache()
    return usual if usual is not None and can_write(usual) else temporary_cache()


@lru_cache(maxsize=1)
def temporary_cache() -> Path:
    """Return a folder in the temporary directory to which only this user can write."""
    owner = getattr(os, "getuid", lambda: 0)()
    folder = Path(tempfile.gettempdir()) / f"hrc_env-{owner}"
    with contextlib.suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        if status.st_uid == owner and not status.st_mode & 0o022 and not folder.is_symlink():
            return folder
        name = hashlib.sha256(os.urandom(16)).hexdigest()[:12]
        folder = folder.with_name(f"{folder.name}-{name}")  # the first name is not safe
        folder.mkdir(mode=0o700)
    return folder


def can_write(folder: Path) -> bool:
    """Return whether files can be written to a folder, which is created if possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@contextlib.contextmanager
def alone(folder: Path, wait: Callable[[], object]) -> Generator[None]:
    """Hold the lock of a folder in a context; call `wait` if another process holds the lock."""
    try:
        import fcntl

        name = hashlib.sha256(str(folder.absolute()).encode()).hexdigest()[:12]
        lock = (temporary_cache() / f"lock-{name}").open("w")
    except (ImportError, OSError):  # no locks available: work is done twice
        yield
        return
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            wait()
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
