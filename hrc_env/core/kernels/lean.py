"""A faster path through numba's compiler: callees are only lowered, callers are compiled.

numba links, optimises and emits the code of every callee again at every level of calls. Here a
callee is left in LLVM's intermediate form; the kernel that Python calls links every callee once,
optimises once and emits code once, in half the time and memory.

Everything is implemented in subclasses, which leaves the compilation of other numba functions
unchanged. The base classes are internals of numba: releases other than the tested ones
(`LEAN_WITH`) use `plain`.
"""

# The internals of numba's compiler, which are used here, have no type annotations.
# pyright: standard

import copy
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import llvmlite.binding as llvm
from numba import _dynfunc  # type: ignore[attr-defined]
from numba.core import codegen, cpu, registry

from hrc_env.core.kernels.cache import KernelCache


class LeanLibrary(codegen.JITCodeLibrary):
    """Code of one function.

    The code of a kernel is compiled. The code of a callee is kept for its callers.
    """

    _is_callee = False

    def get_pointer_to_function(self, name: str) -> int:
        """Compile the code; return the address of the wrapper that Python calls, 0 for a callee."""
        if not self._finalized and name not in {each.name for each in self._final_module.functions}:
            self.keep_as_callee()
        return 0 if self._is_callee else super().get_pointer_to_function(name)

    def keep_as_callee(self) -> None:
        """Leave linking, optimising and emitting to the callers."""
        self._finalize_dynamic_globals()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.linkage = "linkonce_odr"
        self._is_callee = self._finalized = True

    def add_linking_library(self, library: codegen.CPUCodeLibrary) -> None:
        """Register a function that this one calls."""
        if isinstance(library, LeanLibrary) and not library._finalized:
            library.keep_as_callee()
        super().add_linking_library(library)

    def _optimize_functions(self, ll_module: Any) -> None:
        """Do nothing: the kernel that Python calls is optimised as a whole."""
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Link all callees, from callers to callees, optimise and emit."""
        self._codegen._check_llvm_bugs()
        self._raise_if_finalized()
        for library in self._callers_first():
            self._reload_init.update(library._reload_init)
            kept = isinstance(library, LeanLibrary)
            module = library._final_module if kept else library._get_module_for_linking()
            self._final_module.link_in(module, preserve=True)
        self._optimize_final_module()
        self._final_module.verify()
        self._finalize_final_module()

    def _callers_first(self) -> Iterator[codegen.CPUCodeLibrary]:
        """Yield all direct and indirect callees once, each after all of its callers."""
        seen: set[int] = set()
        order: list[codegen.CPUCodeLibrary] = []

        def visit(library: codegen.CPUCodeLibrary) -> None:
            seen.add(id(library))
            if isinstance(library, LeanLibrary):
                for callee in library._linking_libraries:
                    if id(callee) not in seen:
                        visit(callee)
            order.append(library)

        visit(self)
        return reversed(order[:-1])


class LeanContext(cpu.CPUContext):
    """CPU context of numba that compiles libraries as described above."""

    def get_executable(self, library: LeanLibrary, fndesc: Any, env: Any) -> Any:
        """Return the function that Python calls; for a callee, a placeholder."""
        if library.get_pointer_to_function(fndesc.llvm_cpython_wrapper_name):
            return super().get_executable(library, fndesc, env)
        return _dynfunc.make_function(
            fndesc.lookup_module(), fndesc.qualname, "a callee", 0, env, (library,)
        )


@cache
def _lean_context() -> LeanContext:
    """Return the context that all kernels share."""
    usual: Any = registry.cpu_target.target_context
    generator = copy.copy(usual.codegen())
    generator._library_class = LeanLibrary
    context = LeanContext.__new__(LeanContext)
    context.__dict__.update(usual.__dict__)
    context._internal_codegen = generator
    context.cached_internal_func = {}  # numba's own functions must not use callees
    return context


class LeanTarget(registry.CPUTarget):
    """CPU target of numba with the lean context."""

    target_context: Any = property(lambda self: _lean_context())  # type: ignore[override]
    typing_context: Any = property(lambda self: registry.cpu_target.typing_context)  # type: ignore[override]


class CalleeDispatcher(registry.CPUDispatcher):
    """Dispatcher of a kernel that is called by other kernels."""

    targetdescr = LeanTarget("cpu")


class KernelDispatcher(registry.CPUDispatcher):
    """Dispatcher of a kernel that Python calls, cached on disk; other kernels call its `callee`."""

    targetdescr = LeanTarget("cpu")

    def __init__(self, py_func: Callable[..., Any], targetoptions: dict[str, Any]) -> None:
        super().__init__(py_func, targetoptions=targetoptions)
        self.callee = CalleeDispatcher(
            py_func, targetoptions={**targetoptions, "no_cpython_wrapper": True}
        )
        self._cache: Any = KernelCache(self)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return the signature with which another kernel calls this one."""
        return self.callee.get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Return the compiled callee for a signature."""
        return self.callee.get_overload(sig)
