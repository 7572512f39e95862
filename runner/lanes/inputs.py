"""Inputs in lanes: the present piece of every lane and channel stands in rows, and is exchanged when time leaves it."""

import numpy as np
from numba import types

from generated._elementary import lane_sin
from runner import abi
from runner.compiled import compiled
from runner.lanes.kernel import lane_loop
from runner.lanes.pack import (
    AMPLITUDE,
    AT,
    BEGIN,
    C0,
    C1,
    C2,
    C3,
    FREQUENCY,
    HIGH,
    INPUT_ROWS,
    LANES,
    LOW,
    OFFSET,
    PHASE,
    RATE,
    SIDE,
    H,
    T,
    control_rows,
)
from runner.lanes.vectors import ROW, doubles
from runner.memory import LEAN, floats, integers

#: Kinds of a channel: what the lanes together need.
STEADY, CUBIC, SINE = range(3)
HALF_TURN = np.pi / 2


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER))
def cubic_values(times, channel, u):
    """Values of a channel's cubics at the lanes' times."""
    for lane in range(LANES):
        s = channel[RATE * LANES + lane] * times[lane] + channel[OFFSET * LANES + lane] - channel[BEGIN * LANES + lane]
        u[lane] = channel[C0 * LANES + lane] + s * (
            channel[C1 * LANES + lane] + s * (channel[C2 * LANES + lane] + s * channel[C3 * LANES + lane])
        )


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER))
def sine_values(times, channel, u):
    """Values of a channel's cubics and sines at the lanes' times."""
    for lane in range(LANES):
        s = channel[RATE * LANES + lane] * times[lane] + channel[OFFSET * LANES + lane] - channel[BEGIN * LANES + lane]
        u[lane] = (
            channel[C0 * LANES + lane]
            + s * (channel[C1 * LANES + lane] + s * (channel[C2 * LANES + lane] + s * channel[C3 * LANES + lane]))
            + channel[AMPLITUDE * LANES + lane]
            * lane_sin(channel[FREQUENCY * LANES + lane] * s + channel[PHASE * LANES + lane])
        )


@lane_loop(types.void(abi.POINTER, types.float64, types.float64))
def set_times(control, c, side):
    """Times of a stage: AT the stage's own, SIDE strictly inside the step."""
    for lane in range(LANES):
        control[AT * LANES + lane] = control[T * LANES + lane] + c * control[H * LANES + lane]
        control[SIDE * LANES + lane] = control[T * LANES + lane] + side * control[H * LANES + lane]


@lane_loop(types.int64(abi.POINTER))
def outside(control):
    """How many lanes look their inputs up outside the pieces at hand."""
    found = 0
    for lane in range(LANES):
        side = control[SIDE * LANES + lane]
        found += (side < control[LOW * LANES + lane]) | (side >= control[HIGH * LANES + lane])
    return found


@compiled(**LEAN)
def piece_at(batch, table, start, tau):
    """The piece of a table that holds tau, found by walking from piece `start`."""
    pieces = floats(batch.pieces, 8 * batch.n_pieces)
    first, last = integers(batch.first, 1)[table], integers(batch.last, 1)[table]
    k = min(max(start, first), last)
    while k < last and pieces[8 * (k + 1)] <= tau:
        k += 1
    while k > first and pieces[8 * k] > tau:
        k -= 1
    return k


@compiled(**LEAN)
def take_piece(batch, pack, lane, i, side):
    """Put the piece that holds time `side` into the rows of channel i; returns from when to when it holds."""
    run = integers(pack.run, LANES)[lane]
    where = run * batch.channels + i
    table = integers(batch.table, 1)[where]
    rate, offset = floats(batch.rate, 1)[where], floats(batch.offset, 1)[where]
    cursor = integers(pack.piece, 1)
    k = piece_at(batch, table, cursor[lane * batch.channels + i], rate * side + offset)
    cursor[lane * batch.channels + i] = k
    p = floats(batch.pieces + 64 * k, 16)
    row = floats(pack.inputs + ROW * INPUT_ROWS * i, INPUT_ROWS * LANES)
    row[RATE * LANES + lane], row[OFFSET * LANES + lane], row[BEGIN * LANES + lane] = rate, offset, p[0]
    if integers(batch.order, 1)[i] == 0:
        row[C0 * LANES + lane], row[C1 * LANES + lane] = p[1], p[2]
        row[C2 * LANES + lane], row[C3 * LANES + lane] = p[3], p[4]
        row[AMPLITUDE * LANES + lane], row[PHASE * LANES + lane] = p[5], p[7]
    else:
        row[C0 * LANES + lane], row[C1 * LANES + lane] = rate * p[2], rate * 2.0 * p[3]
        row[C2 * LANES + lane], row[C3 * LANES + lane] = rate * 3.0 * p[4], 0.0
        row[AMPLITUDE * LANES + lane], row[PHASE * LANES + lane] = rate * p[5] * p[6], p[7] + HALF_TURN
    row[FREQUENCY * LANES + lane] = p[6]
    first, last = integers(batch.first, 1)[table], integers(batch.last, 1)[table]
    before = (p[0] - offset) / rate if rate != 0.0 and k > first else -np.inf
    after = (p[8] - offset) / rate if rate != 0.0 and k < last else np.inf
    if rate < 0.0:
        before, after = (after if k < last else -np.inf), (before if k > first else np.inf)
    return before, after


@compiled(**LEAN)
def take_pieces(batch, pack, lane):
    """Exchange the pieces of one lane, and note from when to when they hold."""
    control = control_rows(pack)
    low, high = -np.inf, np.inf
    for i in range(batch.n_inputs):
        before, after = take_piece(batch, pack, lane, i, control[SIDE * LANES + lane])
        low, high = max(low, before), min(high, after)
    control[LOW * LANES + lane], control[HIGH * LANES + lane] = low, high


@compiled(**LEAN)
def classify(batch, pack):
    """Find out what each channel needs evaluated in any lane, and write those that stand still."""
    u = floats(pack.u, batch.n_inputs * LANES)
    for i in range(batch.n_inputs):
        row = floats(pack.inputs + ROW * INPUT_ROWS * i, INPUT_ROWS * LANES)
        moving, waving = 0, 0
        for lane in range(LANES):
            slopes = (row[C1 * LANES + lane] != 0.0) | (row[C2 * LANES + lane] != 0.0) | (row[C3 * LANES + lane] != 0.0)
            moving += slopes
            waving += row[AMPLITUDE * LANES + lane] != 0.0
            u[i * LANES + lane] = row[C0 * LANES + lane]
        integers(pack.kind, batch.n_inputs)[i] = SINE if waving > 0 else (CUBIC if moving > 0 else STEADY)


@compiled(**LEAN)
def look_up(batch, pack):
    """Write all inputs of all lanes at their times AT; which piece holds is looked up at SIDE."""
    if outside(doubles(pack.control)) > 0:
        control, run = control_rows(pack), integers(pack.run, LANES)
        for lane in range(LANES):
            side = control[SIDE * LANES + lane]
            inside = side >= control[LOW * LANES + lane] and side < control[HIGH * LANES + lane]
            if run[lane] >= 0 and not inside:
                take_pieces(batch, pack, lane)
        classify(batch, pack)
    kind = integers(pack.kind, batch.n_inputs)
    for i in range(batch.n_inputs):
        channel, u = pack.inputs + ROW * INPUT_ROWS * i, pack.u + ROW * i
        if kind[i] == SINE:
            sine_values(doubles(pack.control + ROW * AT), doubles(channel), doubles(u))
        elif kind[i] == CUBIC:
            cubic_values(doubles(pack.control + ROW * AT), doubles(channel), doubles(u))
