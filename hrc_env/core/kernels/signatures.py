"""The kernels that Python calls, with the types of their arguments, in `signatures.json`.

`python -m assets.kernels.record` writes the file.
"""

# The internals of numba's compiler, which are used here, have no type annotations.
# pyright: standard

import importlib
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numba import from_dtype, types
from numba.np.numpy_support import as_dtype

from hrc_env.core.kernels import KERNELS

PATH = Path(__file__).with_name("signatures.json")


@dataclass(frozen=True, slots=True)
class Signature:
    """A kernel with the types of its arguments in a recorded call."""

    kernel: str
    """Name of the kernel, as "module:name"."""
    args: list[Any]
    """Types of the arguments, as `encode` returns them."""
    levels: list[str]
    """Perception levels that call the kernel."""
    seconds: float
    """Recorded compile time of the kernel [s]; it determines the order of compilation and the
    estimated remaining time."""

    def types(self) -> tuple[Any, ...]:
        """Return the argument types as types of numba."""
        return tuple(decode(each) for each in self.args)

    def is_compiled(self) -> bool:
        """Return whether the kernel is cached on disk or no longer exists."""
        try:
            return kernel_named(self.kernel)._cache.path(self.types()).exists()
        except (ImportError, KeyError, AttributeError):
            return True


def kernel_named(name: str) -> Any:
    """Import the module of a kernel named "module:name", and return the kernel."""
    importlib.import_module(name.partition(":")[0])
    return KERNELS[name]


def recorded(level: str | None = None) -> list[Signature]:
    """Return the signatures of a perception level (None for all), slowest to compile first."""
    known = [Signature(**each) for each in json.loads(PATH.read_text())]
    return [each for each in known if level is None or level in each.levels]


def write(signatures: Sequence[Signature]) -> None:
    """Write signatures to the file, with one line for each."""
    ordered = sorted(signatures, key=lambda each: (-each.seconds, each.kernel, str(each.args)))
    lines = ",\n".join(json.dumps(asdict(each)) for each in ordered)
    PATH.write_text(f"[\n{lines}\n]\n")


def encode(kind: Any) -> Any:
    """Return a numba type as JSON.

    It is "float64", "float64[3C]" ("!" after it: read-only), "module:DTYPE" for a record and
    "module:DTYPE[2C]" for a structured array, a list for a tuple, {"module:name": [...]} for a
    named tuple.

    Raises:
        TypeError: the type has no JSON form; no kernel has used it so far.
    """
    text: Any = str(kind)
    inside = [encode(each) for each in getattr(kind, "types", ())]
    if isinstance(kind, types.Record):
        text = _name_of(kind)
    elif isinstance(kind, types.Array):
        text = f"{encode(kind.dtype)}[{kind.ndim}{kind.layout}]{'' if kind.mutable else '!'}"
    elif isinstance(kind, types.NamedTuple | types.NamedUniTuple):
        made = kind.instance_class
        text = {f"{made.__module__}:{made.__qualname__}": inside}
    elif isinstance(kind, types.BaseTuple):
        text = inside
    if decode(text) != kind:
        raise TypeError(f"signatures.encode does not support {type(kind).__name__}: {kind}.")
    return text


def decode(text: Any) -> Any:
    """Return the numba type for the JSON form that `encode` returns."""
    if isinstance(text, list):
        return types.Tuple([decode(each) for each in text])
    if isinstance(text, dict):
        ((name, inside),) = text.items()
        module, _, made = name.partition(":")
        kinds = [decode(each) for each in inside]
        return types.BaseTuple.from_types(kinds, getattr(importlib.import_module(module), made))
    if "[" in text:
        dtype, _, rest = text.partition("[")
        form, _, mark = rest.partition("]")
        return types.Array(decode(dtype), int(form[:-1]), form[-1], readonly=mark == "!")
    module, _, name = text.rpartition(":")
    if module:
        return from_dtype(getattr(importlib.import_module(module), name))
    return types.boolean if text == "bool" else getattr(types, text)


def _name_of(record: types.Record) -> str:
    """Return "module:DTYPE", the name of the constant in a module that holds a record's dtype."""
    dtype = as_dtype(record)
    for module in [name for name in sys.modules if name.startswith("hrc_env.")]:
        for name, value in vars(sys.modules[module]).items():
            if isinstance(value, np.dtype) and value == dtype and value.names == dtype.names:
                return f"{module}:{name}"
    raise TypeError(
        f"{dtype} is not a constant of a module of hrc_env: define its dtype as a named constant."
    )
