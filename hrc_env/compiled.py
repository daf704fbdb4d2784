"""How kernels are compiled: by numba, kept on disk, without Python's lock.

`@numba.njit(**JIT)` is for kernels that make arrays or give them back, `@numba.njit(**LEAN)` for
all others. In the latter arrays are not counted by reference: numba pays two locked instructions
for every row that a kernel takes of an array, a fifth of the tracker's time. The compiler refuses
`LEAN` where an array is made; a `LEAN` kernel must not call a kernel that gives one back, whose
memory nobody would free.

Kernels that Python calls in every step take records as plain tuples (`tuple(record)`) and make
records of them: numba looks at a named tuple for 3 us longer.
"""

from pathlib import Path
from typing import Any

from hrc_env.kernel_cache import forget_stale

forget_stale(Path(__file__).resolve().parent)

JIT: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "_nrt": True,
    "no_cfunc_wrapper": True,
}
"""Compiled when first called, for ever; dividing by zero gives infinity, as with NumPy.

`_nrt` (numba's memory of arrays) is said here, too: a kernel that does not say it takes its
caller's. Nobody calls a kernel from C: without the wrapper for that a tenth of the time to compile
is saved.
"""
LEAN: dict[str, Any] = {**JIT, "_nrt": False}
"""The same for kernels that only read and write arrays of others."""
