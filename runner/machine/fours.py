"""Rows of numbers at addresses, four at a time: what vectors of 256 bits do with them.

A loop over a handful of numbers is none that LLVM makes vectors of; a row whose length is a whole number of fours is
one without a loop over what is left. All arguments are addresses but factors, and `count`: how many fours a row has.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from qddot.runner.machine.memory import intrinsic
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


@intrinsic
def fill(typing_context: Any, target: Any, value: Any, count: Any) -> Any:
    """target[i] = value."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, value, count = arguments
        _each(builder, count, [target], lambda _: splat(builder, value, FOUR))
        return context.get_dummy_value()

    return types.void(_ADDRESS, _NUMBER, types.int64), emit


@intrinsic
def scale(typing_context: Any, target: Any, factor: Any, count: Any) -> Any:
    """target[i] *= factor."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, factor, count = arguments
        _each(builder, count, [target], lambda x: builder.fmul(x, splat(builder, factor, FOUR)))
        return context.get_dummy_value()

    return types.void(_ADDRESS, _NUMBER, types.int64), emit


@intrinsic
def multiply(typing_context: Any, target: Any, source: Any, count: Any) -> Any:
    """target[i] *= source[i]."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, source, count = arguments
        _each(builder, count, [target, source], builder.fmul)
        return context.get_dummy_value()

    return types.void(_ADDRESS, _ADDRESS, types.int64), emit


@intrinsic
def add_scaled(typing_context: Any, target: Any, factor: Any, source: Any, count: Any) -> Any:
    """target[i] += factor * source[i]."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, factor, source, count = arguments
        weight = splat(builder, factor, FOUR)
        _each(builder, count, [target, source], lambda x, y: multiply_add(builder, weight, y, x))
        return context.get_dummy_value()

    return types.void(_ADDRESS, _NUMBER, _ADDRESS, types.int64), emit


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
