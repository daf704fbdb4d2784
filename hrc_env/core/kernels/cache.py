"""Disk cache of compiled kernels: one file for each kernel, signature and processor.

numba's own cache depends on the modification time of a function's file: a copied tree is compiled
again, and a change of a callee in another file is missed. Here the file name contains a digest of
everything on which the compiled form depends (`digest`, the compiler and its options). A file that
is found is therefore always valid, and all checkouts and environments of a user share one folder. A
file begins with the digest of its content, because code that is damaged would end the process.
"""

# The internals of numba's compiler, which are used here, have no type annotations.
# pyright: standard

import contextlib
import hashlib
import logging
import os
import pickle
import sys
import time
import uuid
from collections.abc import Iterator
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import config
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps

from hrc_env.core import folders
from hrc_env.core.kernels.digest import digest_of

log = logging.getLogger("hrc_env.core.kernels")
DISTRIBUTED = Path(__file__).resolve().with_name("compiled")
"""Folder of the kernels that a wheel may contain (`python -m assets.kernels.wheel`)."""
SUFFIX = ".nbc"
OPTIONS = ("BOUNDSCHECK", "DEBUGINFO_DEFAULT", "LOOP_VECTORIZE", "OPT", "SLP_VECTORIZE")
"""Names of numba's settings that change compiled code."""
MAX_BYTES = 500_000_000
"""Size of the folder above which the files that were not used for longest are removed [bytes]; one
version of the package takes about 20 million."""
USE_NOTED_S = 86_400.0
"""Interval after which a file is marked again as used [s]."""
_DIGEST_BYTES = hashlib.sha256().digest_size


@lru_cache(maxsize=1)
def folder() -> Path:
    """Return the folder in which compiled kernels are saved.

    It is NUMBA_CACHE_DIR if that is set, and otherwise `kernels` in the user's cache.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    return Path(chosen) / "hrc_env" if chosen else folders.user_cache() / "kernels"


def list_read_only() -> list[Path]:
    """Return other folders in which compiled kernels may be found.

    They are `DISTRIBUTED` and a user's cache that cannot be written. If NUMBA_CACHE_DIR is set, it
    takes the place of the latter.
    """
    usual = None if os.environ.get("NUMBA_CACHE_DIR") else folders.usual_cache()
    return [DISTRIBUTED] if usual is None else [usual / "kernels", DISTRIBUTED]


def _hashed(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


class KernelCache(NullCache):
    """Cache of the compiled forms of one kernel."""

    def __init__(self, dispatcher: Dispatcher) -> None:
        self._dispatcher = dispatcher

    def path(self, args: tuple[Any, ...]) -> Path:
        """Return the path of the file for a signature: an existing one, or the one to write."""
        context: Any = self._dispatcher.targetctx
        processor = context.codegen().magic_tuple()
        kind = _hashed(repr((str(args), processor)))[:10]
        compiler = _digest_compiler(type(self._dispatcher).__module__)
        made_of = _hashed(f"{digest_of(self._dispatcher)} {compiler}")[:16]
        function = self._dispatcher.py_func
        name = f"{function.__module__.removeprefix('hrc_env.')}.{function.__qualname__}"
        file = f"{name}-{kind}-{made_of}{SUFFIX}"
        places = (each / file for each in (folder(), *list_read_only()))
        found = (each for each in places if each.exists())
        return next(found, folder() / file)

    def load_overload(  # type: ignore[override]
        self, sig: Any, target_context: Any
    ) -> CompileResult | None:
        """Return a compiled form, or None if it is not cached or its file is damaged."""
        target_context.refresh()
        path = self.path(_args(sig))
        try:
            content = path.read_bytes()
        except OSError:
            return None
        digest, form = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
        if hashlib.sha256(form).digest() != digest:
            return None
        _note_use(path)
        return CompileResult._rebuild(target_context, *pickle.loads(form))

    def save_overload(self, sig: Any, data: CompileResult) -> None:  # type: ignore[override]
        """Save a compiled form; log a warning if that is impossible."""
        path = folder() / self.path(_args(sig)).name
        draft = path.with_name(f"{uuid.uuid4().hex}.tmp")
        form = dumps(data._reduce())
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            draft.write_bytes(hashlib.sha256(form).digest() + form)
            draft.replace(path)
        except OSError as error:
            with contextlib.suppress(OSError):
                draft.unlink()
            _warn_unsaved(path.parent, error.strerror or str(error))
        else:
            _limit_size(path.parent)


@cache
def _digest_compiler(module: str) -> str:
    """Return the digest of everything besides a kernel's source on which compiled code depends.

    Args:
        module: name of the module of the kernel's dispatcher.
    """
    source = Path(str(sys.modules[module].__file__)).read_text()
    versions = numba.__version__, llvmlite.__version__, sys.version_info[:2]
    options = [getattr(config, name, None) for name in OPTIONS]
    return _hashed(f"{source} {versions} {options}")


def _note_use(path: Path) -> None:
    """Set the modification time of a file, by which `_limit_size` chooses, if it is old."""
    with contextlib.suppress(OSError):
        if time.time() - path.stat().st_mtime > USE_NOTED_S:
            os.utime(path)


@cache
def _warn_unsaved(where: Path, reason: str) -> None:
    """Log once that compiled kernels cannot be saved in a folder."""
    log.warning(
        "Compiled kernels cannot be saved in %s (%s), so every process compiles them again: "
        "free some space, or set NUMBA_CACHE_DIR to another folder.",
        where, reason,
    )  # fmt: skip


@cache
def _limit_size(where: Path) -> None:
    """Remove the files of a folder that were not used for longest, once in a process."""
    files = sorted(_list_files(where), reverse=True)
    total = 0
    for _, size, path in files:
        total += size
        if total > MAX_BYTES:
            with contextlib.suppress(OSError):
                path.unlink()


def _list_files(where: Path) -> Iterator[tuple[float, int, Path]]:
    """Yield the time of the last use, size and path of the files with compiled kernels."""
    for path in where.glob(f"*{SUFFIX}"):
        with contextlib.suppress(OSError):  # another process has removed it
            status = path.stat()
            yield status.st_mtime, status.st_size, path


def _args(sig: Any) -> tuple[Any, ...]:
    return tuple(getattr(sig, "args", sig))
