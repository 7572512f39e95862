"""Rows of numbers at addresses, four at a time: what vectors of 256 bits do with them.

A loop over a handful of numbers is none that LLVM makes vectors of; a row whose length is a whole number of fours is
one without a loop over what is left. All arguments are addresses but factors, and `count`: how many fours a row has.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from qddot.runner.machine.memory import intrinsic, intrinsic_of
from qddot.runner.machine.sums import at_address, multiply_add, splat

#: Numbers at once.
FOUR = 4
_SCALAR, _INTEGER = ir.DoubleType(), ir.IntType(64)
_VECTOR = ir.VectorType(_SCALAR, FOUR)
_ADDRESS, _NUMBER = types.int64, types.float64


def _each(builder: Any, count: Any, rows: Any, made: Any) -> None:
    """Write made(four of each row) to the first of the rows, one four after the other."""
    with cgutils.for_range(builder, count, intp=_INTEGER) as loop:
        offset = builder.mul(loop.index, _INTEGER(8 * FOUR))
        places = [at_address(builder, builder.add(row, offset), 0, _VECTOR) for row in rows]
        builder.store(made(*(builder.load(place, align=8) for place in places)), places[0], align=8)


def _on_rows(kinds: str, made: Callable[..., Any]) -> Any:
    """What puts made(builder, fours of the rows, factors) into the first row; kinds: r for a row, f for a factor."""
    signature = types.void(*(_ADDRESS if kind == "r" else _NUMBER for kind in kinds), types.int64)

    def emit(context: Any, builder: Any, own: Any, arguments: Any) -> Any:
        *given, count = arguments
        rows = [each for each, kind in zip(given, kinds, strict=True) if kind == "r"]
        factors = [splat(builder, each, FOUR) for each, kind in zip(given, kinds, strict=True) if kind == "f"]
        _each(builder, count, rows, lambda *fours: made(builder, *fours, *factors))
        return context.get_dummy_value()

    return intrinsic_of(len(signature.args), lambda *_: (signature, emit))


#: (target, value, count): target[i] = value.
fill = _on_rows("rf", lambda builder, x, value: value)
#: (target, factor, count): target[i] *= factor.
scale = _on_rows("rf", lambda builder, x, factor: builder.fmul(x, factor))
#: (target, source, count): target[i] *= source[i].
multiply = _on_rows("rr", lambda builder, x, y: builder.fmul(x, y))
#: (target, factor, source, count): target[i] += factor * source[i].
add_scaled = _on_rows("rfr", lambda builder, x, y, factor: multiply_add(builder, factor, y, x))


@intrinsic
def dot(typing_context: Any, a: Any, b: Any, count: Any) -> Any:
    """The sum of a[i] * b[i]."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        *rows, count = arguments
        total = cgutils.alloca_once_value(builder, ir.Constant(_VECTOR, [0.0] * FOUR))
        with cgutils.for_range(builder, count, intp=_INTEGER) as loop:
            offset = builder.mul(loop.index, _INTEGER(8 * FOUR))
            x, y = (builder.load(at_address(builder, builder.add(row, offset), 0, _VECTOR), align=8) for row in rows)
            builder.store(multiply_add(builder, x, y, builder.load(total)), total)
        items = [builder.extract_element(builder.load(total), ir.IntType(32)(k)) for k in range(FOUR)]
        return builder.fadd(builder.fadd(items[0], items[2]), builder.fadd(items[1], items[3]))

    return _NUMBER(_ADDRESS, _ADDRESS, types.int64), emit
