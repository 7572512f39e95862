"""The passes over states and orders of a Taylor step in lanes: sums and sizes that stay in registers."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from qddot.runner.lanes.pack import CHANNEL_ROWS
from qddot.runner.lanes.values import ROW, Value, load, over_states, splat, store, zeros
from qddot.runner.machine.memory import intrinsic

_INTEGER, _DOUBLE = ir.IntType(64), ir.DoubleType()


def _number(builder: Any, where: Any, item: Any) -> Value:
    """The double at an address and so many bytes further, in every lane."""
    place = builder.inttoptr(builder.add(where, item), _DOUBLE.as_pointer())
    return splat(builder, builder.load(place))


@intrinsic
def size_states(typing_context: Any, n: Any, rows: Any, target: Any) -> Any:
    """The row at `target` = the largest of n states in each lane; infinite where one is no number."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        states, start, result = arguments
        infinite = splat(builder, _DOUBLE(float("inf")))
        total = cgutils.alloca_once_value(builder, zeros(builder).value)

        def body(place: Any) -> None:
            size = abs(load(builder, builder.add(start, place)))
            size = size.where_ordered(size, infinite)
            builder.store(Value(builder, builder.load(total)).larger(size).value, total)

        over_states(builder, states, body)
        store(Value(builder, builder.load(total)), result)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 3), emit


@intrinsic
def write_waves(typing_context: Any, channel: Any, waves: Any, target: Any, stride: Any, order: Any, bends: Any) -> Any:
    """Rows at `target` and strides further = the series of a channel's sines, to an order of 1 at least.

    x_k = -w^2 x_{k-2} / (k (k-1)). waves: rows of the sine and cosine of its angle; bends: -1/(k (k-1)), by order.
    """

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows, turned, first, bytes_on, highest, factors = arguments
        w, sine_part, cosine_part = (
            load(builder, builder.add(rows, _INTEGER(ROW * CHANNEL_ROWS[name])))
            for name in ("frequency", "sine_part", "cosine_part")
        )
        sine, cosine = load(builder, turned), load(builder, builder.add(turned, _INTEGER(ROW)))
        starts = sine_part * sine + cosine_part * cosine, (sine_part * cosine + cosine_part * sine * -1.0) * w
        squared = w * w
        held = [cgutils.alloca_once_value(builder, start.value) for start in starts]
        for index, start in enumerate(starts):
            store(start, builder.add(first, builder.mul(bytes_on, _INTEGER(index))))
        with cgutils.for_range(builder, builder.sub(highest, _INTEGER(1))) as loop:
            k = builder.add(loop.index, _INTEGER(2))
            older, newer = (Value(builder, builder.load(each)) for each in held)
            value = squared * _number(builder, factors, builder.mul(k, _INTEGER(8))) * older
            store(value, builder.add(first, builder.mul(bytes_on, k)))
            builder.store(newer.value, held[0])
            builder.store(value.value, held[1])
        return context.get_dummy_value()

    return types.void(*[types.int64] * 6), emit


@intrinsic
def add_cubics(typing_context: Any, channel: Any, times: Any, target: Any, stride: Any) -> Any:
    """Add the series of a channel's cubics about a row of times to the four rows at `target` and strides further."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows, present, first, bytes_on = arguments
        names = ("rate", "offset", "begin", "c0", "c1", "c2", "c3")
        rate, offset, begin, c0, c1, c2, c3 = (
            load(builder, builder.add(rows, _INTEGER(ROW * CHANNEL_ROWS[name]))) for name in names
        )
        s = load(builder, present) * rate + offset + begin * -1.0
        squared = rate * rate
        series = (
            ((c3 * s + c2) * s + c1) * s + c0,
            ((c3 * s * 3.0 + c2 * 2.0) * s + c1) * rate,
            (c3 * s * 3.0 + c2) * squared,
            c3 * rate * squared,
        )
        for k, value in enumerate(series):
            place = builder.add(first, builder.mul(bytes_on, _INTEGER(k)))
            store(value + load(builder, place), place)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 4), emit
