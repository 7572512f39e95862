"""The Taylor series of all lanes: their record, and what stands in their memory before they are taken."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.inputs.instants import INSET
from qddot.runner.lanes.inputs import look_up, outside, turn
from qddot.runner.lanes.lane import lane_of
from qddot.runner.lanes.pack import AT, INPUT_ROWS, LANES
from qddot.runner.lanes.pieces import SINE
from qddot.runner.lanes.terms import add_cubics, write_waves
from qddot.runner.lanes.values import ROW
from qddot.runner.machine.calls import doubles
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.lane_loop import lane_loop
from qddot.runner.machine.memory import LEAN, address, floats, integers, layout, record
from qddot.runner.machine.series_memory import HIGHEST, NOW
from qddot.runner.taylor.step import decay_for, order_for

if TYPE_CHECKING:
    from qddot.runner.machine.series_code import SeriesCode

#: Fields of a series, which all packs share; the memory of each pack stands in its rows `slopes`. series, step,
#: polynomial: functions; states, inputs: where they begin in the memory, and the strides from order to order, in bytes;
#: order: the highest. Factor j of n_factors is number[j] times the constants[first[j]:first[j+1]] of a run, at place[j]
#: (doubles). bends: -1/(k (k-1)) for each order k. rtol: the least of all; decay: see `taylor.step.decay_for`.
SERIES = layout(
    "series step polynomial states state_stride inputs input_stride order n_factors place first constants number bends",
    "rtol decay",
)
SERIES_TYPE = typeof(record(SERIES))


def series_for(code: "SeriesCode", rtol: float) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """The record of a series for a least relative tolerance, and the arrays it points into."""
    memory, order = code.memory, order_for(rtol, code.sums)
    counts = [len(names) for _, _, names in memory.factors]
    k = np.arange(HIGHEST + 1)
    arrays: dict[str, NDArray[Any]] = {
        "place": np.array([place for place, _, _ in memory.factors], dtype=np.int64),
        "number": np.array([number for _, number, _ in memory.factors], dtype=np.float64),
        "first": np.cumsum([0, *counts], dtype=np.int64),
        "constants": np.array([i for _, _, names in memory.factors for i in names], dtype=np.int64),
        "bends": -1.0 / np.maximum(k * (k - 1.0), 1.0),
    }
    made = record(
        SERIES,
        **{name: address(array) for name, array in arrays.items()},
        series=code.series,
        step=code.step,
        polynomial=code.polynomial,
        states=8 * memory.states,
        state_stride=8 * memory.state_stride,
        inputs=8 * memory.inputs,
        input_stride=8 * memory.input_stride,
        order=order,
        n_factors=len(counts),
        rtol=rtol,
        decay=decay_for(rtol, order),
    )
    return made, arrays


@compiled(**LEAN)
def take_factors(pack, series, lane):
    """The factors of a lane's series, from the constants of its run."""
    memory, c = floats(pack.slopes, 1), floats(pack.c, 1)
    place, first = integers(series.place, 1), integers(series.first, 1)
    number, constants = floats(series.number, 1), integers(series.constants, 1)
    for j in range(series.n_factors):
        product = 1.0
        for i in range(first[j], first[j + 1]):
            product *= c[LANES * constants[i] + lane]
        memory[place[j] + lane] = number[j] * product


@lane_loop(types.void(abi.POINTER, abi.POINTER))
def set_present(rows, times):
    """AT, SIDE and the times of the series: the present, and right after it; see `inputs.instants.after`."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        t = its.t
        inset, half = INSET * abs(t), 0.5 * (its.stop - t)
        its.at = t
        its.side = t + (inset if inset < half else half)
        times[lane] = t


@compiled(**LEAN)
def write_inputs(batch, pack, series):
    """The series of all inputs of all lanes at their times AT, from the pieces that hold at SIDE.

    A sine's is written to all orders; without one those above the cubic's are 0, and stay so.
    """
    found = outside(doubles(pack.control))
    if found > 0:
        look_up(batch.look_up, batch, pack, 0, found)  # exchanges the pieces
    kind, leader = integers(pack.kind, batch.n_inputs), integers(pack.leader, batch.n_inputs)
    waved = integers(pack.waved, batch.n_inputs)
    for i in range(batch.n_inputs):
        channel_rows, target = pack.inputs + ROW * INPUT_ROWS * i, pack.slopes + series.inputs + ROW * i
        if kind[i] & SINE:
            waves = pack.turns + 2 * ROW * leader[i]
            if leader[i] == i:
                turn(doubles(pack.control), doubles(channel_rows), doubles(waves), doubles(waves + ROW))
            write_waves(channel_rows, waves, target, series.input_stride, series.order, series.bends)
        else:
            clear(target, series.input_stride, series.order if waved[i] else np.int64(3))
        waved[i] = kind[i] & SINE
        add_cubics(channel_rows, pack.control + ROW * AT, target, series.input_stride)


@compiled(**LEAN)
def clear(target, stride, order):
    """Rows of zeros, of order 0 to this one."""
    for k in range(order + 1):
        row = floats(target + stride * k, LANES)
        for lane in range(LANES):
            row[lane] = 0.0


@compiled(**LEAN)
def look_around(batch, pack, series):
    """Times and inputs of the series that is to be taken."""
    set_present(doubles(pack.control), doubles(pack.slopes + ROW * NOW))
    if batch.n_inputs > 0:
        write_inputs(batch, pack, series)
