"""Compiled kernels: `@kernel` before a function.

    @kernel
    def grow(ages, dt): ...

    @kernel(makes_arrays=True)
    def pairs(n): return np.empty((n, 2))

Kernels are compiled by numba without Python's lock, kept on disk (`cache`), and compiled before
they are needed where that is known (`ahead`).
"""

import importlib
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar, overload

import numba
from numba.core import config

LEAN_WITH = ("0.68",)
"""Releases of numba with which `lean`, which depends on the compiler's internals, was tested."""
UNTESTED = "hrc_env's compiler of kernels was not tested with numba"
"""Beginning of the warning about another release."""
KERNELS: dict[str, Any] = {}
"""Every kernel that was imported, by "module:name"."""

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
        function: the function, typed; without it, the options for a decorator.
        makes_arrays: whether it makes arrays or returns them; the compiler refuses one that does
            without this option. In all others arrays are not counted by reference, which numba does
            with two locked instructions for every row, a fifth of the tracker's time; they must not
            call a kernel that returns an array, whose memory would never be freed.
        fastmath: the liberties of the optimiser with sums and products (LLVM's flags).
        forceinline: whether it becomes a part of its callers.

    Python passes named tuples as they are, at which numba looks longer than at plain tuples, the
    longer the more fields they have.
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
    """Return the class of kernels for a release of numba.

    Releases that were not tested get numba's own class, and one warning.
    """
    tested = version.startswith(tuple(f"{release}." for release in LEAN_WITH))
    if not tested:
        warnings.warn(
            f"{UNTESTED} {version}, but with {', '.join(LEAN_WITH)}: numba's own compiler is used, "
            "which takes about twice as long, once.",
            stacklevel=2,
        )
    name = "lean" if tested else "plain"
    found = importlib.import_module(f"hrc_env.core.kernels.{name}")
    return found.KernelDispatcher if tested else found.PlainDispatcher


DISPATCHER = dispatcher(numba.__version__)
"""Class of every kernel in this process."""
