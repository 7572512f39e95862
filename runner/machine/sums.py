"""Sums over rows of floats that stay in registers, and what goes item by item beside them.

`exact` sums rows of matrices in the widest registers. Explicit methods sum slopes in registers of 256 bits: what
follows is the kernel, which reads the states one by one. An RK4 step of the M113, measured on a Xeon in a
loop of nothing else: 145 ns with 512 bits, because single states come slowly out of a store that wide, and because the
latest slopes, stored one by one, make a wide load wait; 128 ns with 256 bits; 91 ns where the latest slopes too are
read one by one.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from qddot.runner.machine.memory import BLOCK, intrinsic

#: Doubles in a register of 256 bits.
_NARROW = 4
_SCALAR, _INTEGER = ir.DoubleType(), ir.IntType(64)


def at_address(builder: Any, address: Any, item: int, kind: Any) -> Any:
    """A pointer to the item at an address, in items of 8 bytes."""
    return builder.inttoptr(builder.add(address, _INTEGER(8 * item)), kind.as_pointer())


def splat(builder: Any, value: Any, width: int) -> Any:
    """A vector of one value."""
    undefined, zero = ir.Constant(ir.VectorType(_SCALAR, width), ir.Undefined), ir.Constant(ir.IntType(32), 0)
    mask = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
    return builder.shuffle_vector(builder.insert_element(undefined, value, zero), undefined, mask)


def multiply_add(builder: Any, a: Any, b: Any, c: Any) -> Any:
    """Give a * b + c."""
    return builder.fadd(builder.fmul(a, b, flags=("contract",)), c, flags=("contract",))


def _vectors(builder: Any, address: Any, width: int) -> list[Any]:
    """The BLOCK floats at an address."""
    return [
        builder.load(at_address(builder, address, i, ir.VectorType(_SCALAR, width)), align=8)
        for i in range(0, BLOCK, width)
    ]


def _sum(builder: Any, arguments: Any, stride: Any, width: int) -> None:
    """target[m] = base[m] + h * sum_j weights[j] * row_j[m]; rows `stride` bytes apart; sums stay in registers.

    The loop vectorizer does not find this by itself: it would have to interchange the loops.
    """
    base, h, weights, count, rows, target = arguments
    vector = ir.VectorType(_SCALAR, width)
    zero = ir.Constant(vector, [0.0] * width)
    totals = [cgutils.alloca_once_value(builder, zero) for _ in range(BLOCK // width)]
    with cgutils.for_range(builder, count, intp=_INTEGER) as loop:
        where = builder.add(weights, builder.mul(loop.index, _INTEGER(8)))
        weight = splat(builder, builder.load(at_address(builder, where, 0, _SCALAR)), width)
        row = builder.add(rows, builder.mul(loop.index, stride))
        for total, values in zip(totals, _vectors(builder, row, width), strict=True):
            builder.store(multiply_add(builder, weight, values, builder.load(total)), total)
    factor = splat(builder, h, width)
    for i, (total, start) in enumerate(zip(totals, _vectors(builder, base, width), strict=True)):
        value = multiply_add(builder, factor, builder.load(total), start)
        builder.store(value, at_address(builder, target, width * i, vector), align=8)


@intrinsic
def weighted_sum(typing_context: Any, base: Any, h: Any, weights: Any, count: Any, rows: Any, target: Any) -> Any:
    """target[m] = base[m] + h * sum_j weights[j] * rows[BLOCK*j + m] for j < count, m < BLOCK, in widest registers.

    All are addresses but h and count.
    """

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _sum(builder, arguments, _INTEGER(8 * BLOCK), BLOCK)
        return context.get_dummy_value()

    address = types.int64
    return types.void(address, types.float64, address, types.int64, address, address), emit


@intrinsic
def sum_slopes(
    typing_context: Any, base: Any, h: Any, weights: Any, count: Any, slopes: Any, stride: Any, target: Any
) -> Any:
    """target[m] = base[m] + h * sum_j weights[j] * slope_j[m] for j < count, m < BLOCK, in registers of 256 bits.

    All are addresses but h, count, and stride: the bytes from one slope to the next.
    """

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        *first, stride, target = arguments
        _sum(builder, [*first, target], stride, _NARROW)
        return context.get_dummy_value()

    address = types.int64
    return types.void(address, types.float64, address, address, address, address, address), emit


@intrinsic
def add_latest(typing_context: Any, row: Any, factor: Any, slope: Any, count: Any) -> Any:
    """row[m] += factor * slope[m] for m < count, item by item, the slope having just been written that way."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        row, factor, slope, length = arguments
        with cgutils.for_range(builder, length, intp=_INTEGER) as loop:
            offset = builder.mul(loop.index, _INTEGER(8))
            place = at_address(builder, builder.add(row, offset), 0, _SCALAR)
            # An atomic load stays what it is: LLVM does not join it with its neighbours.
            fresh = builder.load_atomic(at_address(builder, builder.add(slope, offset), 0, _SCALAR), "unordered", 8)
            builder.store(multiply_add(builder, factor, fresh, builder.load(place)), place)
        return context.get_dummy_value()

    address = types.int64
    return types.void(address, types.float64, address, types.int64), emit


@intrinsic
def copy_items(typing_context: Any, source: Any, target: Any, count: Any) -> Any:
    """target[m] = source[m] for m < count, item by item, as the source has just been written."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source, target, length = arguments
        with cgutils.for_range(builder, length, intp=_INTEGER) as loop:
            offset = builder.mul(loop.index, _INTEGER(8))
            value = builder.load_atomic(at_address(builder, builder.add(source, offset), 0, _SCALAR), "unordered", 8)
            builder.store(value, at_address(builder, builder.add(target, offset), 0, _SCALAR))
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), emit


@intrinsic
def any_beyond(typing_context: Any, row: Any, limit: Any) -> Any:
    """Whether one of the BLOCK floats at an address is larger than the limit, or not a number."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        row, limit = arguments
        vector, integers = (ir.VectorType(kind, _NARROW) for kind in (_SCALAR, _INTEGER))
        bound = splat(builder, limit, _NARROW)
        without_sign = ir.Constant(integers, [2**63 - 1] * _NARROW)
        beyond = ir.Constant(ir.VectorType(ir.IntType(1), _NARROW), [0] * _NARROW)
        for values in _vectors(builder, row, _NARROW):
            size = builder.bitcast(builder.and_(builder.bitcast(values, integers), without_sign), vector)
            beyond = builder.or_(beyond, builder.fcmp_unordered(">", size, bound))
        none = ir.Constant(ir.IntType(_NARROW), 0)
        return builder.icmp_unsigned("!=", builder.bitcast(beyond, none.type), none)

    return types.boolean(types.int64, types.float64), emit
