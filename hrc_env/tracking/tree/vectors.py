"""Vector instructions by name: arithmetic on rows of four numbers, which no compiler has to guess.

Loops over four numbers become vector instructions only if the compiler can prove that what they
write is not what they read; for blocks whose places it does not know, it cannot. These
functions say so: each is compiled to operations on vectors of four numbers. `rows` is a flat
array as in `quads`; blocks are named by where they begin and must not overlap the result.
"""

from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

_VECTOR = ir.VectorType(ir.DoubleType(), 4)
_REORDER = ("reassoc", "contract", "nsz")


class _Rows:
    """Emits loads, stores and sums of products on the rows of one array."""

    def __init__(self, context: Any, builder: Any, kind: Any, array: Any) -> None:
        self._builder = builder
        self._data = context.make_array(kind)(context, builder, array).data

    def _pointer(self, start: Any, row: int) -> Any:
        at = self._builder.add(start, ir.Constant(start.type, 4 * row))
        return self._builder.bitcast(self._builder.gep(self._data, [at]), _VECTOR.as_pointer())

    def load(self, start: Any, row: int) -> Any:
        """The four numbers of a row, counted from `start`."""
        return self._builder.load(self._pointer(start, row), align=8)

    def store(self, value: Any, start: Any, row: int) -> None:
        """Write a row."""
        self._builder.store(value, self._pointer(start, row), align=8)

    def dot(self, pairs: list[tuple[Any, Any]]) -> Any:
        """Sum of the products of pairs."""
        total = None
        for x, y in pairs:
            product = self._builder.fmul(x, y, flags=_REORDER)
            total = product if total is None else self._builder.fadd(total, product, flags=_REORDER)
        return total


def _product(left: tuple[int, int], right: tuple[int, int], n_columns: int) -> Any:
    """out[i, k] = sum over h of a[i, h] b[h, k]; rows between neighbours in i, h and in h, k."""

    @intrinsic
    def product(typingctx, rows, a, b, out):
        del typingctx, a, b, out
        signature = types.void(rows, types.intp, types.intp, types.intp)

        def generate(context, builder, signature, args):
            emit = _Rows(context, builder, signature.args[0], args[0])
            for i in range(6):
                own = [emit.load(args[1], left[0] * i + left[1] * h) for h in range(6)]
                for k in range(n_columns):
                    other = [emit.load(args[2], right[0] * h + right[1] * k) for h in range(6)]
                    total = emit.dot(list(zip(own, other, strict=True)))
                    emit.store(total, args[3], n_columns * i + k)
            return context.get_dummy_value()

        return signature, generate

    return product


product = _product((6, 1), (6, 1), 6)
"""product(rows, a, b, out): out = a b for 6x6 matrices."""
product_transposed = _product((6, 1), (1, 6), 6)
"""out = a b' for 6x6 matrices."""
transposed_product = _product((1, 6), (6, 1), 6)
"""out = a' b for 6x6 matrices."""
applied = _product((6, 1), (1, 0), 1)
"""out = a b for a 6x6 matrix and 6 numbers."""
transposed_applied = _product((1, 6), (1, 0), 1)
"""out = a' b for a 6x6 matrix and 6 numbers."""


@intrinsic
def _moved(typingctx, rows, edge, own, other, shared, here, there, out):
    """f edge g' + f own e' + d other' g' + d shared e' for the 2x2 matrices of one pair of axes.

    `edge`, `own`, `shared`, `out` begin at entry (i, k) of 6x6 matrices, `other` at (k, i); f and
    d are the eight rows from `here` on, g and e those from `there` on.
    """
    del typingctx, edge, own, other, shared, here, there, out
    signature = types.void(rows, *[types.intp] * 7)

    def generate(context, builder, signature, args):
        emit = _Rows(context, builder, signature.args[0], args[0])
        c, y, t, s = (
            [[emit.load(x, 18 * p + 3 * q) for q in (0, 1)] for p in (0, 1)] for x in args[1:5]
        )
        f, d = (
            [[emit.load(args[5], n + 2 * p + q) for q in (0, 1)] for p in (0, 1)] for n in (0, 4)
        )
        g, e = (
            [[emit.load(args[6], n + 2 * p + q) for q in (0, 1)] for p in (0, 1)] for n in (0, 4)
        )
        for q in (0, 1):
            near = [
                emit.dot(
                    [(c[p][0], g[q][0]), (c[p][1], g[q][1]), (y[p][0], e[q][0]), (y[p][1], e[q][1])]
                )
                for p in (0, 1)
            ]
            far = [
                emit.dot(
                    [(t[0][p], g[q][0]), (t[1][p], g[q][1]), (s[p][0], e[q][0]), (s[p][1], e[q][1])]
                )
                for p in (0, 1)
            ]
            for p in (0, 1):
                total = emit.dot(
                    [(f[p][0], near[0]), (f[p][1], near[1]), (d[p][0], far[0]), (d[p][1], far[1])]
                )
                emit.store(total, args[7], 18 * p + 3 * q)
        return context.get_dummy_value()

    return signature, generate


moved: Any = _moved
