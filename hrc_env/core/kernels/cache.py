"""Disk cache of compiled kernels: one file for each kernel, signature and processor.

numba's own cache depends on the modification time of a function's file: a copied tree is compiled
again, and a change of a callee in another file is missed. Here the file name contains a digest of
everything on which the kernel depends (`digest`); a file that is found is therefore always valid.
"""

# The internals of numba's compiler, which are used here, have no type annotations.
# pyright: standard

import contextlib
import hashlib
import os
import pickle
import sys
import uuid
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps

from hrc_env.core import folders
from hrc_env.core.kernels.digest import digest_of

PACKAGE = Path(__file__).resolve().parents[2]
SUFFIX = ".nbc"


@lru_cache(maxsize=1)
def folder() -> Path:
    """Return the folder of compiled kernels.

    It is NUMBA_CACHE_DIR if that is set; otherwise a folder beside the package's bytecode, which is
    copied together with the tree; if that is read-only, one in the user's cache.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return Path(chosen) / "hrc_env"
    if folders.can_write(_beside()):
        return _beside()
    return folders.user_cache() / f"kernels-{_hashed(str(PACKAGE))[:12]}"


def _beside() -> Path:
    """Return the folder beside the package's bytecode."""
    return PACKAGE / "__pycache__" / "kernels"


def _hashed(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


class KernelCache(NullCache):
    """Cache of the compiled forms of one kernel."""

    def __init__(self, dispatcher: Dispatcher) -> None:
        self._dispatcher = dispatcher

    def path(self, args: tuple[Any, ...]) -> Path:
        """Return the path of the file for a signature."""
        context: Any = self._dispatcher.targetctx
        processor = context.codegen().magic_tuple()
        kind = _hashed(repr((str(args), processor)))[:10]
        versions = f"{numba.__version__} {sys.version_info[:2]}"
        made_of = _hashed(f"{digest_of(self._dispatcher)} {versions}")[:16]
        function = self._dispatcher.py_func
        name = f"{function.__module__.removeprefix('hrc_env.')}.{function.__qualname__}"
        file = f"{name}-{kind}-{made_of}{SUFFIX}"
        if not os.environ.get("NUMBA_CACHE_DIR") and (_beside() / file).exists():
            return _beside() / file  # even if that folder is read-only
        return folder() / file

    def load_overload(  # type: ignore[override]
        self, sig: Any, target_context: Any
    ) -> CompileResult | None:
        """Return a compiled form, or None if it is not cached."""
        target_context.refresh()
        try:
            parts = pickle.loads(self.path(_args(sig)).read_bytes())
        except (OSError, EOFError, pickle.UnpicklingError):
            return None
        return CompileResult._rebuild(target_context, *parts)

    def save_overload(self, sig: Any, data: CompileResult) -> None:  # type: ignore[override]
        """Save a compiled form if files can be written.

        Older forms are removed, except from NUMBA_CACHE_DIR, which several checkouts may share.
        """
        path = self.path(_args(sig))
        draft = path.with_name(f"{uuid.uuid4().hex}.tmp")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            draft.write_bytes(dumps(data._reduce()))
            draft.replace(path)
            if os.environ.get("NUMBA_CACHE_DIR"):
                return
            for older in path.parent.glob(f"{path.name.rsplit('-', 1)[0]}-*{SUFFIX}"):
                if older != path:
                    older.unlink(missing_ok=True)
        except OSError:
            with contextlib.suppress(OSError):
                draft.unlink()


def _args(sig: Any) -> tuple[Any, ...]:
    return tuple(getattr(sig, "args", sig))
