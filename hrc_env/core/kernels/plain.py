"""The standard path through numba's compiler, for releases for which `lean` was not tested.

Callees are compiled at every level of calls. Kernels take several times as long to compile as with
`lean`, and run equally fast.
"""

from collections.abc import Callable
from typing import Any

from numba.core import registry

from hrc_env.core.kernels.cache import KernelCache


class PlainDispatcher(registry.CPUDispatcher):
    """Dispatcher of a kernel that Python and other kernels call, cached on disk."""

    def __init__(self, py_func: Callable[..., Any], targetoptions: dict[str, Any]) -> None:
        super().__init__(py_func, targetoptions=targetoptions)
        self._cache: Any = KernelCache(self)
