"""Inputs from long tables in lanes: every lane computes which piece it is on, and all lanes read theirs at once.

Of a table whose pieces are of one length the piece is computed; of any other, a guide of even buckets tells where to
begin, and a few comparisons do the rest. A piece's four coefficients are read as one vector a lane and transposed: half
as long as four gathers (measured: 11 ns for eight lanes, 18 with gathers).
"""

from typing import Any

from llvmlite import ir
from numba import types

from qddot.runner import abi
from qddot.runner.lanes.lane import channel_of, input_of, lane_of
from qddot.runner.lanes.pack import CHANNEL_ROWS, INPUT_ROWS, LANES
from qddot.runner.lanes.values import ROW, Value, load, store
from qddot.runner.machine.bits import bits_of, float_of
from qddot.runner.machine.calls import INTEGERS, doubles, numbers
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.lane_loop import lane_loop
from qddot.runner.machine.memory import LEAN, floats, integers, intrinsic

#: Bytes of a piece.
PIECE = 64
EVEN, GUIDED = 1, 2


@lane_loop(types.void(abi.POINTER, abi.POINTER, INTEGERS, types.int64))
def find_even(rows, inputs, channels, count):
    """PLACE, the piece at the time SIDE, and SINCE, how far the argument at the time AT is behind its start."""
    for j in range(count):
        first = INPUT_ROWS * LANES * channels[j]
        for lane in range(LANES):
            its, channel = lane_of(rows, lane), channel_of(inputs, first + lane)
            rate, offset = channel.rate, channel.offset
            begin, last = channel.begin, channel.buckets
            x = (rate * its.side + offset - begin) * channel.per_length + 1.0
            x = x if x > 0.0 else 0.0
            x = x if x < last else last
            x = float(int(x))
            start = begin + (x - 1.0) * channel.length
            channel.place = float_of(PIECE * int(x + channel.first))
            channel.since = rate * its.at + offset - start


@lane_loop(types.void(abi.POINTER, abi.POINTER, INTEGERS, types.int64, INTEGERS))
def find_guided(rows, inputs, channels, count, guide):
    """PLACE as the guide tells it: the piece at the time SIDE, or one a little before."""
    for j in range(count):
        first = INPUT_ROWS * LANES * channels[j]
        for lane in range(LANES):
            its, channel = lane_of(rows, lane), channel_of(inputs, first + lane)
            tau = channel.rate * its.side + channel.offset
            begin, last = channel.begin, channel.buckets
            x = (tau - begin) * channel.per_length + 1.0
            x = x if x > 0.0 else 0.0
            x = x if x < last else last
            channel.place = float_of(guide[int(x) + int(channel.first)])


@lane_loop(types.void(abi.POINTER, abi.POINTER, INTEGERS, types.int64, abi.POINTER))
def go_on(rows, inputs, channels, count, pieces):
    """PLACE one piece further where the next one has begun."""
    for j in range(count):
        first = INPUT_ROWS * LANES * channels[j]
        for lane in range(LANES):
            its, channel = lane_of(rows, lane), channel_of(inputs, first + lane)
            tau = channel.rate * its.side + channel.offset
            place = bits_of(channel.place)
            further = (pieces[(place >> 3) + 8] <= tau) & (float(place) < channel.last)
            channel.place = float_of(place + (PIECE if further else 0))


@lane_loop(types.void(abi.POINTER, abi.POINTER, INTEGERS, types.int64, abi.POINTER))
def measure(rows, inputs, channels, count, pieces):
    """SINCE, where the start of a piece must be read."""
    for j in range(count):
        first = INPUT_ROWS * LANES * channels[j]
        for lane in range(LANES):
            its, channel = lane_of(rows, lane), channel_of(inputs, first + lane)
            tau = channel.rate * its.at + channel.offset
            place = bits_of(channel.place)
            channel.since = tau - pieces[place >> 3]


def transposed(builder: Any, rows: list[Any]) -> list[Value]:
    """The columns of eight rows of four numbers."""

    def shuffle(a: Any, b: Any, places: list[int]) -> Any:
        return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), len(places)), places))

    halves = [shuffle(rows[lane], rows[lane + 4], list(range(8))) for lane in range(4)]
    even, odd = [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15]
    low, high = [0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15]
    pairs = [(shuffle(halves[0], halves[1], each), shuffle(halves[2], halves[3], each)) for each in (even, odd)]
    return [Value(builder, shuffle(a, b, half)) for half in (low, high) for a, b in pairs]


@intrinsic
def value_of_pieces(typing_context: Any, channel: Any, pieces: Any, order: Any, target: Any) -> Any:
    """The row at `target` = value (order 0) or time derivative of the cubics at PLACE of a channel's rows, at SINCE."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows, first, derivative, result = arguments
        four, integer = ir.VectorType(ir.DoubleType(), 4), ir.IntType(64)

        def coefficients(lane: int) -> Any:
            where = builder.add(rows, integer(ROW * CHANNEL_ROWS["place"] + 8 * lane))
            place = builder.load(builder.inttoptr(where, integer.as_pointer()))
            start = builder.add(builder.add(first, place), integer(8))
            return builder.load(builder.inttoptr(start, four.as_pointer()), align=8)

        c0, c1, c2, c3 = transposed(builder, [coefficients(lane) for lane in range(LANES)])
        s, rate = (load(builder, builder.add(rows, integer(ROW * CHANNEL_ROWS[row]))) for row in ("since", "rate"))
        value = ((c3 * s + c2) * s + c1) * s + c0
        slope = ((c3 * 3.0 * s + c2 * 2.0) * s + c1) * rate
        is_value = builder.icmp_signed("==", derivative, integer(0))
        store(Value(builder, builder.select(is_value, value.value, slope.value)), result)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 4), emit


@lane_loop(types.void(INTEGERS, types.int64, INTEGERS, types.int64, types.int64, types.int64))
def read_pieces(channels, count, order, inputs, pieces, u):
    """Values or time derivatives of channels whose PLACE and SINCE are known; the last three are addresses."""
    for j in range(count):
        i = channels[j]
        value_of_pieces(inputs + ROW * INPUT_ROWS * i, pieces, order[i], u + ROW * i)


@compiled(**LEAN)
def read_tables(batch, pack, n_even, n_guided):
    """Write the first so many of the channels that read tables of even pieces, and of those with a guide."""
    rows, inputs, order = doubles(pack.control), doubles(pack.inputs), numbers(batch.order)
    if n_even > 0:
        find_even(rows, inputs, numbers(batch.even), n_even)
        read_pieces(numbers(batch.even), n_even, order, pack.inputs, batch.pieces, pack.u)
    if n_guided > 0:
        channels, pieces = numbers(batch.guided), doubles(batch.pieces)
        find_guided(rows, inputs, channels, n_guided, numbers(batch.guide))
        for _ in range(batch.hops):
            go_on(rows, inputs, channels, n_guided, pieces)
        measure(rows, inputs, channels, n_guided, pieces)
        read_pieces(channels, n_guided, order, pack.inputs, batch.pieces, pack.u)


@compiled(**LEAN)
def take_table(batch, pack, lane, i, table):
    """Tell the rows of channel i about the table that a lane's run reads."""
    channel = input_of(pack, i, lane)
    first, last = integers(batch.first, 1)[table], integers(batch.last, 1)[table]
    pieces = floats(batch.pieces, 1)
    begin, end = pieces[8 * (first + 1)], pieces[8 * last]
    guided = integers(batch.way, 1)[i] == GUIDED
    buckets = integers(batch.buckets, 1)[table] if guided else last - first - 1
    channel.begin = begin
    channel.per_length = buckets / (end - begin)
    channel.length = (end - begin) / buckets
    channel.first = integers(batch.guide_first, 1)[table] if guided else first
    channel.buckets = buckets + 1
    channel.last = PIECE * last
