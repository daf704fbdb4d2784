"""Start a command that can read and write only some folders, by Linux's Landlock.

    python confinement.py '{"readable": ["/usr"], "writable": ["/tmp/own"]}' COMMAND ...

Landlock (https://docs.kernel.org/userspace-api/landlock.html, Linux 5.13 and later) restricts a
process and all processes that it starts. It also denies them access to the memory of the process
that started them and, in later kernels, TCP connections and signals to other processes. It does not
hide the existence, size and time of files, and limits neither time nor memory.

This file is run as a script and imports only the standard library: the restriction applies only to
threads that are started later, and libraries such as NumPy start threads when they are imported.
"""

import ctypes
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path

WRITE_FILE, READ_FILE, READ_DIR, TRUNCATE = 1 << 1, 1 << 2, 1 << 3, 1 << 14
READ = READ_FILE | READ_DIR
CHANGE = sum(1 << bit for bit in range(4, 13))
"""Rights to remove and to create files and folders."""
REFER = 1 << 13
"""Right to move files between folders, from version 2 of the interface on."""
OF_FILES = WRITE_FILE | READ_FILE | TRUNCATE
"""Rights that a rule for a single file may contain."""
TCP, SCOPES = 0b11, 0b11
"""Connections by TCP (from version 4 on); abstract sockets and signals (from version 6 on)."""
CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
"""Numbers of the system calls, which are the same on all processors."""
ASK_VERSION, BENEATH_PATH, NO_NEW_PRIVILEGES = 1, 1, 38


class Ruleset(ctypes.Structure):
    """The kernel's `landlock_ruleset_attr`: rights that are denied unless a rule allows them."""

    _fields_ = (
        ("files", ctypes.c_uint64),
        ("network", ctypes.c_uint64),
        ("scopes", ctypes.c_uint64),
    )


class Rule(ctypes.Structure):
    """The kernel's `landlock_path_beneath_attr`: rights that are allowed below a path."""

    _pack_ = 1
    _fields_ = (("allowed", ctypes.c_uint64), ("path", ctypes.c_int32))


def find_version() -> int:
    """Return the version of Landlock's interface that the kernel has, or 0 without Landlock."""
    if sys.platform != "linux":
        return 0
    call = ctypes.CDLL(None, use_errno=True).syscall
    return max(call(CREATE_RULESET, None, ctypes.c_size_t(0), ASK_VERSION), 0)


def confine(readable: Sequence[Path], writable: Sequence[Path]) -> None:
    """Deny this process all files except those below some paths; this cannot be undone.

    Args:
        readable: files and folders that may be read; those that do not exist are ignored.
        writable: files and folders that may also be changed.

    Raises:
        OSError: the kernel refuses, or has no Landlock.
    """
    version = find_version()
    change = WRITE_FILE | CHANGE | (REFER if version >= 2 else 0) | (TRUNCATE * (version >= 3))
    ruleset = Ruleset(READ | change, TCP * (version >= 4), SCOPES * (version >= 6))
    size = 24 if version >= 6 else 16 if version >= 4 else 8
    handle = _call(CREATE_RULESET, ctypes.byref(ruleset), ctypes.c_size_t(size), 0)
    for paths, rights in ((readable, READ), (writable, READ | change)):
        for path in filter(os.path.exists, paths):
            at = os.open(path, os.O_PATH | os.O_CLOEXEC)
            rule = Rule(rights if os.path.isdir(path) else rights & OF_FILES, at)
            _call(ADD_RULE, handle, BENEATH_PATH, ctypes.byref(rule), 0)
            os.close(at)
    if ctypes.CDLL(None, use_errno=True).prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0):
        raise OSError(ctypes.get_errno(), "prctl refused to give up new privileges")
    _call(RESTRICT_SELF, handle, 0)
    os.close(handle)


def main(words: Sequence[str]) -> None:
    """Confine this process and run a command in its place."""
    allowed, *command = words
    confine(**{name: [*map(Path, paths)] for name, paths in json.loads(allowed).items()})
    os.execv(command[0], command)


def _call(number: int, *arguments: object) -> int:
    """Make a system call and return its result."""
    result = ctypes.CDLL(None, use_errno=True).syscall(number, *arguments)
    if result < 0:
        code = ctypes.get_errno()
        raise OSError(code, f"Landlock refused call {number}: {os.strerror(code)}")
    return result


if __name__ == "__main__":
    main(sys.argv[1:])
