"""Compiled kernels on disk: one file for each kernel, signature and processor.

numba's own cache goes by the time of a function's file: a copied tree compiles everything again,
and a callee's change in another file is not seen. Here a file's name holds a digest of what the
kernel is made of (`digest`), so that what is found always fits.
"""

import contextlib
import hashlib
import os
import pickle
import sys
import tempfile
import uuid
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from hrc_env.core.kernels.digest import digest_of

if TYPE_CHECKING:
    from hrc_env.core.kernels.lean import KernelDispatcher

PACKAGE = Path(__file__).resolve().parents[2]
SUFFIX = ".nbc"


@lru_cache(maxsize=1)
def folder() -> Path:
    """Where compiled kernels are kept: NUMBA_CACHE_DIR if that is set; else beside the package's
    bytecode, so that a copied tree keeps them; else, where nobody may write there, the user's
    cache folder."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return Path(chosen) / "hrc_env"
    beside = PACKAGE / "__pycache__" / "kernels"
    if (beside.is_dir() and os.access(beside, os.W_OK)) or _can_make(beside):
        return beside
    name = hashlib.sha256(str(PACKAGE).encode()).hexdigest()[:12]
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "hrc_env" / f"kernels-{name}"


def _can_make(path: Path) -> bool:
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return True
    except OSError:
        return False


class KernelCache:
    """The compiled forms of one kernel; the methods are those that numba calls."""

    def __init__(self, dispatcher: "KernelDispatcher") -> None:
        self._dispatcher = dispatcher
        self._enabled = True

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(folder())

    def path(self, args: tuple[Any, ...], target_context: Any) -> Path:
        """The file of a signature."""
        kind = hashlib.sha256(
            repr((str(args), target_context.codegen().magic_tuple())).encode()
        ).hexdigest()[:10]
        made_of = hashlib.sha256(
            f"{digest_of(self._dispatcher)} {numba.__version__} {sys.version_info[:2]}".encode()
        ).hexdigest()[:16]
        function = self._dispatcher.py_func
        name = f"{function.__module__.removeprefix('hrc_env.')}.{function.__qualname__}"
        return folder() / f"{name}-{kind}-{made_of}{SUFFIX}"

    def has(self, args: tuple[Any, ...]) -> bool:
        """Whether a signature's file is there."""
        return self.path(args, self._dispatcher.targetctx).exists()

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        """A compiled form, if there is one."""
        target_context.refresh()
        if not self._enabled:
            return None
        try:
            parts = pickle.loads(self.path(_args(sig), target_context).read_bytes())
        except (OSError, EOFError, pickle.UnpicklingError):
            return None
        return CompileResult._rebuild(target_context, *parts)

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        """Keep a compiled form; where nothing can be written, nowhere.

        Older ones go, but not from a folder of the user's choice, which several checkouts may use.
        """
        path = self.path(_args(sig), self._dispatcher.targetctx)
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

    def enable(self) -> None:
        """Use it."""
        self._enabled = True

    def disable(self) -> None:
        """Load nothing."""
        self._enabled = False

    def flush(self) -> None:
        """Nothing: what is on disk fits."""


def _args(sig: Any) -> tuple[Any, ...]:
    return tuple(getattr(sig, "args", sig))
