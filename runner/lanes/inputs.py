"""Inputs in lanes: all channels of all lanes at their times, from rows that hold the present pieces."""

from typing import Any

from numba import types
from numba.core import cgutils

from qddot.runner import abi
from qddot.runner.inputs.instants import INSET
from qddot.runner.inputs.instants import SIDE as INSIDE
from qddot.runner.lanes.lane import channel_of, control_of, lane_of
from qddot.runner.lanes.pack import AT, BATCH_TYPE, CHANNEL_ROWS, INPUT_ROWS, LANES, PACK_TYPE
from qddot.runner.lanes.pieces import CUBIC, SINE, classify, take_pieces
from qddot.runner.lanes.tables import read_tables
from qddot.runner.lanes.values import ROW, load, store
from qddot.runner.machine.angles import cos, sin
from qddot.runner.machine.bits import elementary
from qddot.runner.machine.calls import doubles
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.lane_loop import lane_loop
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, integers, intrinsic
from qddot.runner.machine.pointers import caller

#: Row of a channel with its value where nothing but sines moves it.
CONSTANT = CHANNEL_ROWS["c0"]


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER))
def cubic_values(times, channel_rows, u):
    """Values of a channel's cubics at the lanes' times."""
    for lane in range(LANES):
        channel = channel_of(channel_rows, lane)
        s = channel.rate * times[lane] + channel.offset - channel.begin
        u[lane] = channel.c0 + s * (channel.c1 + s * (channel.c2 + s * channel.c3))


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER, abi.POINTER))
def turn(rows, channel_rows, sine, cosine):
    """Sine and cosine of a channel's frequency times the time: all channels of one frequency make do with them."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        angle = channel_of(channel_rows, lane).frequency * (its.at - its.zero)
        sine[lane] = sin(angle)
        cosine[lane] = cos(angle)


@intrinsic
def add_sines(typing_context: Any, channel: Any, waves: Any, base: Any, stride: Any, target: Any, count: Any) -> Any:
    """Rows at `target` = rows at `base`, each a stride further, and the sines of so many channels of one frequency.

    waves: rows of the sine and cosine of its angle.
    """

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows, turned, start, bytes_on, result, channels = arguments
        row = start.type(ROW)
        sine, cosine = load(builder, turned), load(builder, builder.add(turned, row))
        with cgutils.for_range(builder, channels) as loop:
            first = builder.add(rows, builder.mul(loop.index, row.type(ROW * INPUT_ROWS)))
            sine_part, cosine_part = (
                load(builder, builder.add(first, row.type(ROW * CHANNEL_ROWS[name])))
                for name in ("sine_part", "cosine_part")
            )
            still = load(builder, builder.add(start, builder.mul(loop.index, bytes_on)))
            store(sine_part * sine + (cosine_part * cosine + still), builder.add(result, builder.mul(loop.index, row)))
        return context.get_dummy_value()

    return types.void(*[types.int64] * 6), emit


@lane_loop(types.void(abi.POINTER, types.float64))
def set_time(rows, c):
    """The time AT of a stage, where there is nothing to look up."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        its.at = its.t + c * its.h


@elementary
def _beyond(time, low, high):
    return (time < low) | (time >= high)


@lane_loop(types.int64(abi.POINTER, types.float64))
def set_times(rows, c):
    """Times of a stage: AT the stage's own, SIDE strictly inside the step, as `side_of` says; see `outside`."""
    found = 0
    for lane in range(LANES):
        its = lane_of(rows, lane)
        t, h = its.t, its.h
        its.at = t + c * h
        near, half = INSET * abs(t), 0.5 * h
        inset = INSIDE * h
        inset = inset if inset > near else near
        inset = inset if inset < half else half
        inside = c * h
        inside = inside if inside > inset else inset
        inside = inside if inside < h - inset else h - inset
        side = t + inside
        its.side = side
        found += _beyond(side, its.low, its.high)
    return found


@lane_loop(types.int64(abi.POINTER))
def outside(rows):
    """How many lanes look their inputs up outside the pieces at hand."""
    found = 0
    for lane in range(LANES):
        its = lane_of(rows, lane)
        found += _beyond(its.side, its.low, its.high)
    return found


@compiled(**LEAN)
def exchange(batch, pack):
    """Exchange the pieces of the lanes whose time SIDE is outside of them."""
    run, changed = integers(pack.run, LANES), False
    for lane in range(LANES):
        its = control_of(pack, lane)
        side = its.side
        inside = side >= its.low and side < its.high
        if run[lane] >= 0 and not inside:
            changed = take_pieces(batch, pack, lane) or changed
    if changed:
        classify(batch, pack)


@compiled(**BY_ADDRESS)
def read_inputs(batch, pack, whole, found):
    """Write the inputs of all lanes at their times AT; which piece holds is looked up at SIDE.

    whole: whether all channels that are watched are wanted, or those that stages read. found: how many lanes are
    `outside` of their pieces.
    """
    if found > 0:
        exchange(batch, pack)
    kind, leader = integers(pack.kind, batch.n_watched), integers(pack.leader, batch.n_watched)
    alike, times = integers(pack.alike, batch.n_watched), doubles(pack.control + ROW * AT)
    end, i = batch.n_watched if whole else batch.n_inputs, 0
    while i < end:
        channel, u, count = pack.inputs + ROW * INPUT_ROWS * i, pack.u + ROW * i, 1
        if kind[i] & CUBIC:
            cubic_values(times, doubles(channel), doubles(u))
        if kind[i] & SINE:
            waves, count = pack.turns + 2 * ROW * leader[i], min(alike[i], end - i)
            if leader[i] == i:
                turn(doubles(pack.control), doubles(channel), doubles(waves), doubles(waves + ROW))
            base = u if kind[i] & CUBIC else channel + ROW * CONSTANT
            stride = ROW if kind[i] & CUBIC else ROW * INPUT_ROWS
            add_sines(channel, waves, base, stride, u, count)
        i += count
    if whole:
        read_tables(batch, pack, batch.all_even, batch.all_guided)
    elif batch.n_even + batch.n_guided > 0:  # a call costs, and most models' stages read no tables
        read_tables(batch, pack, batch.n_even, batch.n_guided)


LOOK_UP = types.void(BATCH_TYPE, PACK_TYPE, types.int64, types.int64)


@intrinsic
def look_up(typing_context: Any, where: Any, batch: Any, pack: Any, whole: Any, found: Any) -> Any:
    """Call `read_inputs` at an address, so that LLVM compiles it once and not into every function that reads inputs."""
    return caller(LOOK_UP)


@compiled(**LEAN)
def look_up_stage(batch, pack, c):
    """Write the inputs of a stage that is at the part c of the step, looked up strictly inside the step."""
    if batch.n_watched == 0:
        set_time(doubles(pack.control), c)
        return
    found = set_times(doubles(pack.control), c)
    if batch.n_inputs > 0:
        look_up(batch.look_up, batch, pack, 0, found)
