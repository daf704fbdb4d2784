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
"""Releases of numba that `lean` was tested with: it builds on the inside of the compiler."""
UNTESTED = "hrc_env's compiler of kernels was not tested with numba"
"""How the warning of another release begins."""
KERNELS: dict[str, Any] = {}
"""Every kernel that has been imported, by "module:name"."""

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
    """Compile a function when it is first called; dividing by zero gives infinity, as in NumPy.

    Args:
        makes_arrays: it makes arrays or gives them back; the compiler refuses where this is not
            said. In all others arrays are not counted by reference, which numba does with two
            locked instructions for every row, a fifth of the tracker's time; they must not call
            a kernel that gives an array back, whose memory nobody would free.
        fastmath: which liberties the optimiser has with sums and products (LLVM's flags).
        forceinline: always part of its callers.

    Kernels that Python calls in every step take records as plain tuples (`tuple(record)`) and make
    records of them: numba looks at a named tuple for 3 us longer.
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
    """Return the class of kernels for a release of numba; other releases than those tested get
    numba's own, and one warning."""
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
"""The class of every kernel here."""
