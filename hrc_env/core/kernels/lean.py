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

import contextlib
import copy
import gc
from collections.abc import Callable, Generator, Iterator
from functools import cache
from typing import Any

import llvmlite.binding as llvm
from numba import _dynfunc  # type: ignore[attr-defined]
from numba.core import codegen, compiler, config, cpu, registry, types
from numba.core.typing.context import Context
from numba.extending import lower_cast, overload
from numba.np import arrayobj

from hrc_env.core.kernels.cache import KernelCache

PORTABLE_FEATURES = (
    "sse4.2", "popcnt", "cx16", "sahf",
    "avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe",
)  # fmt: skip
"""LLVM's names of the features of x86-64-v3, besides those of all x86-64 processors."""
RARELY = (100_000, 50, 1_000)
"""Thresholds of the garbage collector (`gc.set_threshold`) while kernels are compiled."""


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

    def _optimize_final_module(self) -> None:
        """Optimise once; numba's cheaper passes before that do not make kernels faster."""
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)

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


class PortableCodegen(codegen.JITCPUCodegen):
    """Code generator for all processors of the microarchitecture level x86-64-v3.

    Its kernels are as fast as those for one processor. All machines of a cluster can share them,
    and a wheel can contain them.
    """

    _library_class = LeanLibrary

    def _get_host_cpu_name(self) -> str:
        """Return LLVM's name of the level."""
        return "x86-64-v3"

    def _get_host_cpu_features(self) -> str:
        """Return no features besides those of the level."""
        return ""


def _make_generator(usual: codegen.JITCPUCodegen) -> codegen.JITCPUCodegen:
    """Return the code generator of kernels: a portable one if this processor has its features.

    numba's settings of the processor (`NUMBA_CPU_NAME`, `NUMBA_CPU_FEATURES`, `NUMBA_ENABLE_AVX`)
    take precedence.

    Args:
        usual: numba's code generator for this processor.
    """
    chosen: Any = config  # numba sets its attributes from the environment
    is_default = chosen.CPU_NAME is None and chosen.CPU_FEATURES is None and chosen.ENABLE_AVX
    if is_default and usual.magic_tuple()[0].startswith("x86_64"):
        available = llvm.get_host_cpu_features()
        if all(available.get(name, False) for name in PORTABLE_FEATURES):
            return PortableCodegen("hrc_env")
    generator = copy.copy(usual)
    generator._library_class = LeanLibrary
    return generator


@contextlib.contextmanager
def rare_collections() -> Generator[None]:
    """Collect garbage rarely in a context; collections take a fifth of the time of the compiler."""
    usual = gc.get_threshold()
    gc.set_threshold(*RARELY)
    try:
        yield
    finally:
        gc.set_threshold(*usual)


def _complain_of_shapes(source: Any, target: Any) -> None:
    """Raise `ValueError` because an array does not fit into a slice."""


@overload(_complain_of_shapes)
def _overload_complaint(source: Any, target: Any) -> Any:
    def complain(source: Any, target: Any) -> None:
        raise ValueError("cannot assign slice from input of different size")

    return complain


class LeanTyping(Context):
    """Typing context of numba in which assignments to slices have a constant error message.

    numba's message, which contains the shapes, takes a tenth of the compile time.
    """

    def resolve_value_type(self, val: Any) -> Any:
        """Return the type of a global value."""
        is_complaint = val is arrayobj.raise_with_shape_context
        return super().resolve_value_type(_complain_of_shapes if is_complaint else val)


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
    context = LeanContext.__new__(LeanContext)
    context.__dict__.update(usual.__dict__)
    context._internal_codegen = _make_generator(usual.codegen())
    context.typing_context = LeanTyping.__new__(LeanTyping)
    context.typing_context.__dict__.update(usual.typing_context.__dict__)
    context.cached_internal_func = {}  # numba's own functions must not use callees
    return context


class LeanTarget(registry.CPUTarget):
    """CPU target of numba with the lean context."""

    target_context: Any = property(lambda self: _lean_context())  # type: ignore[override]
    typing_context: Any = property(lambda self: registry.cpu_target.typing_context)  # type: ignore[override]


class LeanFlags(compiler.Flags):
    """Options of a compilation, which numba compares often, and whose comparison is slow."""

    def __eq__(self, other: object) -> bool:
        """Return whether the same options are set to the same values."""
        return isinstance(other, LeanFlags) and self._values == other._values

    def __hash__(self) -> int:
        """Return the hash of the names of the set options."""
        return hash(frozenset(self._values))


def _compare_flags_fast(dispatcher: Any) -> None:
    """Let a dispatcher compile with `LeanFlags`."""
    dispatcher._compiler._customize_flags = LeanFlags


class CalleeDispatcher(registry.CPUDispatcher):
    """Dispatcher of a kernel that is called by other kernels."""

    targetdescr = LeanTarget("cpu")

    def __init__(self, py_func: Callable[..., Any], targetoptions: dict[str, Any]) -> None:
        super().__init__(py_func, targetoptions=targetoptions)
        _compare_flags_fast(self)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return the signature of a call, with generalised types of its arguments."""
        named = {name: _generalise(each) for name, each in dict(kws).items()}
        return super().get_call_template(tuple(map(_generalise, args)), named)


def _generalise(kind: Any) -> Any:
    """Return the type of a parameter that takes arguments of a type.

    Constants are passed as variables, and the arrays in a record as arrays of any shape. numba
    would compile a callee again for each constant, and for arrays that are in a record.
    """
    if isinstance(kind, types.NestedArray):
        return types.Array(kind.dtype, kind.ndim, kind.layout)
    return types.unliteral(kind)


@lower_cast(types.NestedArray, types.Array)
def _pass_nested_array(
    context: Any, builder: Any, source: Any, target: Any, value: Any
) -> Any:  # pragma: no cover
    """Pass an array in a record as an array; both have the same structure."""
    return value


class KernelDispatcher(registry.CPUDispatcher):
    """Dispatcher of a kernel that Python calls, cached on disk; other kernels call its `callee`."""

    targetdescr = LeanTarget("cpu")

    def __init__(self, py_func: Callable[..., Any], targetoptions: dict[str, Any]) -> None:
        super().__init__(py_func, targetoptions=targetoptions)
        self.callee = CalleeDispatcher(
            py_func, targetoptions={**targetoptions, "no_cpython_wrapper": True}
        )
        _compare_flags_fast(self)
        self._cache: Any = KernelCache(self)

    def compile(self, sig: Any) -> Any:
        """Load or compile the kernel for a signature, and return the function that Python calls."""
        with rare_collections():
            return super().compile(sig)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return the signature with which another kernel calls this one."""
        return self.callee.get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Return the compiled callee for a signature."""
        return self.callee.get_overload(sig)
