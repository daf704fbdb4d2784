"""The decorator `@kernel`, which compiles functions.

    @kernel
    def grow(ages, dt): ...

    @kernel(makes_arrays=True)
    def pairs(n): return np.empty((n, 2))

Kernels are compiled by numba, release Python's global lock, are cached on disk (`cache`), and are
compiled before they are needed if their signatures are recorded (`ahead`).
"""

import importlib
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar, overload

import numba
from numba.core import config

LEAN_WITH = ("0.68",)
"""Releases of numba for which `lean` was tested; it depends on internals of the compiler."""
UNTESTED = "hrc_env's compiler of kernels was not tested with numba"
"""Beginning of the warning about an untested release."""
KERNELS: dict[str, Any] = {}
"""All imported kernels, by "module:name"."""

Function = TypeVar("Function", bound=Callable[..., Any])


@overload
def kernel(function: Function) -> Function: ...
@overload
def kernel(
    *, makes_arrays: bool = ..., fastmath: bool | set[str] = ..., forceinline: bool = ...
) -> Callable[[Function], Function]: ...
def kernel(
    function: Callable[..., Any] | None = None,
    *,
    makes_arrays: bool = False,
    fastmath: bool | set[str] = False,
    forceinline: bool = False,
) -> Any:
    """Compile a function on its first call; division by zero gives infinity, as in NumPy.

    Args:
        function: the function, with type annotations; if omitted, a decorator with these options is
            returned.
        makes_arrays: whether it creates or returns arrays; without this option the compiler rejects
            a function that does. In kernels without this option, arrays are not reference-counted.
            Counting takes two atomic instructions per row, a fifth of the tracker's time. These
            kernels must not call a kernel that returns an array, because its memory would never be
            freed.
        fastmath: permitted rearrangements of floating-point arithmetic (LLVM's flags).
        forceinline: whether it is inlined into its callers.

    When Python calls a kernel, numba inspects named tuples more slowly than plain tuples, in
    proportion to their number of fields.
    """
    if function is None:
        return partial(
            kernel, makes_arrays=makes_arrays, fastmath=fastmath, forceinline=forceinline
        )
    if getattr(config, "DISABLE_JIT", False):
        return function
    options = {
        "nopython": True, "nogil": True, "error_model": "numpy", "_nrt": makes_arrays,
        "no_cfunc_wrapper": True, "fastmath": fastmath, "forceinline": forceinline,
    }  # fmt: skip
    made = DISPATCHER(function, options)
    KERNELS[f"{function.__module__}:{function.__qualname__}"] = made
    return made


def dispatcher(version: str) -> Any:
    """Return the dispatcher class of kernels for a release of numba.

    Untested releases get numba's own class, and a warning is issued once.
    """
    tested = version.startswith(tuple(f"{release}." for release in LEAN_WITH))
    if not tested:
        warnings.warn(
            f"{UNTESTED} {version}, but with {', '.join(LEAN_WITH)}: numba's default compiler is "
            "used, which compiles several times more slowly.",
            stacklevel=2,
        )
    name = "lean" if tested else "plain"
    found = importlib.import_module(f"hrc_env.core.kernels.{name}")
    return found.KernelDispatcher if tested else found.PlainDispatcher


DISPATCHER = dispatcher(numba.__version__)
"""Dispatcher class of every kernel in this process."""
