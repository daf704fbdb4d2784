"""A kernel for triton's compiler, which reads the source of a file."""

import triton
import triton.language as tl
from triton.backends.compiler import GPUTarget
from triton.compiler import ASTSource


@triton.jit
def add(x, y, n, block: tl.constexpr):
    """y += exp(x)"""
    i = tl.program_id(0) * block + tl.arange(0, block)
    tl.store(y + i, tl.exp(tl.load(x + i, mask=i < n)), mask=i < n)


def compile_it() -> None:
    """For an A100, which need not be there; prints the PTX."""
    source = ASTSource(add, {"x": "*fp32", "y": "*fp32", "n": "i32"}, {"block": 64})
    print(triton.compile(source, target=GPUTarget("cuda", 80, 32)).asm["ptx"])
