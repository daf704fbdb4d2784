"""Snapshots: the registrations of a process in a private file that its child processes read.

`reservation.VARIABLE` names the file as soon as this package is imported, which lets child
processes of any kind (spawn, forkserver, loky, Ray on this machine) find it even if they started
before it was written. The file exists once an object is registered; its process removes it at exit.
"""

import os
import pickle
import shutil
import stat
import threading
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from multiprocessing.util import Finalize
from pathlib import Path

from hrc_env.core.errors import HRCError
from hrc_env.core.reservation import VARIABLE, existing, new_folder, prepend, reserve

_LOCK = threading.RLock()


@dataclass(frozen=True, slots=True)
class Entry:
    """Form in which child processes receive a registered object: a pickle, a file, or neither."""

    pickled: bytes = b""
    """The object, pickled by value; empty if it was not pickled."""
    file: str = ""
    """Python file that registers the object; empty for none."""
    refused: str = ""
    """Message of the error that occurred when the object was pickled; empty for none."""
    max_episode_steps: int = 0
    """Time limit of a task [control steps]; 0 for other objects."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Registrations of a process."""

    entries: Mapping[str, Mapping[str, Entry]] = field(
        default_factory=dict[str, Mapping[str, Entry]]
    )
    """Entries by kind (such as "robot") and name."""
    files: tuple[str, ...] = ()
    """Python files to import, in the order of this sequence."""


@dataclass(slots=True)
class _State:
    """Registration files of this process and its parent."""

    source: str
    """Paths of files that may be inherited, as in `VARIABLE`; the first existing one is used."""
    pid: int
    """ID of the process to which `path` belongs."""
    path: str
    """Path of the file of this process."""
    written: Snapshot | None = None
    """Content of the file at `path`; None if it was not written."""
    seen: tuple[int, int] = (0, 0)
    """Inode and modification time of the inherited file when it was last read."""
    inherited: Snapshot = Snapshot()
    """Registrations of the parent process."""


def inherited() -> Snapshot:
    """Return the registrations of the parent process; its file is read again after a change."""
    with _LOCK:
        if path := existing(_STATE.source):
            _read(path)
        return _STATE.inherited


def inherit(snapshot: Snapshot) -> None:
    """Use the registrations of a process on another machine as those of the parent process."""
    with _LOCK:
        _STATE.source, _STATE.inherited = "", snapshot


def current() -> Snapshot:
    """Return the registrations that child processes find."""
    return _STATE.written or inherited()


def write(snapshot: Snapshot) -> None:
    """Replace this process's file atomically, or warn if that is impossible."""
    from hrc_env.core.results import write_whole  # takes time to import

    with _LOCK:
        if _STATE.written is None and snapshot == _STATE.inherited:
            return
        if snapshot == _STATE.written and Path(_STATE.path).is_file():
            return
        folder = Path(_STATE.path).parent
        if _STATE.pid != os.getpid() or (folder.exists() and not _is_private(folder)):
            folder = folder if _is_private(folder) else Path(new_folder())
            _STATE.path, _STATE.pid = prepend(str(folder)), os.getpid()
        try:
            if not folder.exists():
                folder.mkdir(mode=0o700)
                Finalize(None, shutil.rmtree, (folder, True), exitpriority=-100)
            write_whole(Path(_STATE.path), pickle.dumps(snapshot))
        except (OSError, HRCError) as error:
            _warn(f"Child processes will not have the registrations of this process: {error}")
            return
        _STATE.written = snapshot


def _is_private(folder: Path) -> bool:
    """Return whether only this user can write into a folder, since pickles are code."""
    try:
        about = folder.stat(follow_symlinks=False)
    except OSError:
        return False
    private = about.st_uid == os.getuid() and not about.st_mode & 0o022
    return private and stat.S_ISDIR(about.st_mode)


def _read(source: str) -> None:
    try:
        about = os.stat(source)
    except OSError:  # the file no longer exists
        return
    seen = (about.st_ino, about.st_mtime_ns)
    if seen == _STATE.seen:
        return
    _STATE.seen = seen
    if not _is_private(Path(source).parent):
        _warn(
            f"{source} is ignored: its folder must be owned by this user and must not be "
            "writable for others."
        )
        return
    try:
        found = pickle.loads(Path(source).read_bytes())
    except Exception as error:
        _warn(f"The registrations of the parent process cannot be read: {error!r}.")
        return
    if isinstance(found, Snapshot):
        _STATE.inherited = found


def _warn(said: str) -> None:
    warnings.warn(said, RuntimeWarning, stacklevel=3)


def _begun() -> _State:
    """Return the state of this module at import."""
    reserve()
    own, _, others = os.environ[VARIABLE].partition(os.pathsep)
    return _State(others, os.getpid(), own)


_STATE = _begun()
