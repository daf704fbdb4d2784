"""Digests of kernels.

A digest covers the module, bytecode, options and constants of the kernel, and all kernels that it
calls.
"""

# The internals of numba's compiler, which are used here, have no type annotations.
# pyright: standard

import dis
import hashlib
import types
from pathlib import Path
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic

LOADS_CONSTANT = frozenset(dis.hasconst)
"""Instructions with the index of a constant as argument."""


def digest_of(dispatcher: Dispatcher) -> str:
    """Return the digest of a kernel, with the values of globals at the time of the first call."""
    known: dict[str, Any] = vars(dispatcher)
    if "_digest" not in known:
        known["_digest"] = "itself"  # for a kernel that calls itself
        options = sorted(dispatcher.targetoptions.items())
        function = dispatcher.py_func
        parts = [function.__module__, _value(options, set()), *_function(function)]
        known["_digest"] = hashlib.sha256("\n".join(parts).encode()).hexdigest()
    return known["_digest"]


def _function(function: Any) -> list[str]:
    """Return strings that describe a function's code and the values of the names in it."""
    codes, names = [function.__code__], set()
    parts = [repr(function.__defaults__)]
    for code in codes:
        codes += [each for each in code.co_consts if isinstance(each, types.CodeType)]
        names |= set(code.co_names)
        bytecode, loaded = _instructions(code)
        constants = [_value(each, names) for each in loaded]
        parts.append(f"{bytecode.hex()} {code.co_varnames} {code.co_names} {constants}")
    scope = function.__globals__
    cells = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
    parts += [f"{name}={_value(cell.cell_contents, names)}" for name, cell in cells.items()]
    return parts + [f"{name}={_value(scope[name], names)}" for name in sorted(names & set(scope))]


def _instructions(code: types.CodeType) -> tuple[bytes, list[Any]]:
    """Return the bytecode without indices of constants, and the constants in order of loading.

    A docstring shifts the indices of other constants, and no instruction loads it.
    """
    bytecode, loaded, high = bytearray(code.co_code), [], 0
    for k in range(0, len(bytecode), 2):
        operation, low = bytecode[k : k + 2]
        if operation in LOADS_CONSTANT:
            loaded.append(code.co_consts[high | low])
            bytecode[k + 1] = 0
        high = (high | low) << 8 if operation == dis.EXTENDED_ARG else 0
    return bytes(bytecode), loaded


def _value(value: Any, names: set[str]) -> str:
    """Return a digest or textual form of a value."""
    if isinstance(value, Dispatcher):
        return digest_of(value)
    if isinstance(value, types.ModuleType):
        own = value.__name__.startswith("hrc_env")
        inside = sorted(names & set(vars(value))) if own else []
        return f"{value.__name__} {[f'{n}={_value(vars(value)[n], names)}' for n in inside]}"
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, types.CodeType):
        return value.co_name
    if isinstance(value, set | frozenset):
        return f"{{{', '.join(sorted(map(repr, value)))}}}"
    if isinstance(value, tuple | list):
        return f"{type(value).__name__} {[_value(each, names) for each in value]}"
    if isinstance(value, type):
        return f"{value.__module__}.{value.__qualname__} {getattr(value, '_fields', '')}"
    if isinstance(value, _Intrinsic | types.FunctionType):
        function: Any = getattr(value, "_defn", value)
        return hashlib.sha256(Path(function.__code__.co_filename).read_bytes()).hexdigest()
    return f"{type(value).__name__} {value!r}"
