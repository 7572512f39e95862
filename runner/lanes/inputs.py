"""Inputs in lanes: the present piece of every lane and channel stands in rows, and is exchanged when time leaves it."""

import numpy as np
from numba import types

from generated._elementary import lane_cos, lane_sin
from runner import abi
from runner.compiled import compiled
from runner.lanes.kernel import lane_loop
from runner.lanes.pack import (
    AT,
    BEGIN,
    C0,
    C1,
    C2,
    C3,
    COSINE_PART,
    FREQUENCY,
    HIGH,
    INPUT_ROWS,
    LANES,
    LOW,
    OFFSET,
    RATE,
    SIDE,
    SINE_PART,
    H,
    T,
    control_rows,
)
from runner.lanes.vectors import ROW, doubles
from runner.memory import LEAN, floats, integers

#: Kinds of a channel: what its lanes together need.
STEADY, CUBIC, SINE, CUBIC_AND_SINE, GRID = range(5)


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER))
def cubic_values(times, channel, u):
    """Values of a channel's cubics at the lanes' times."""
    for lane in range(LANES):
        s = channel[RATE * LANES + lane] * times[lane] + channel[OFFSET * LANES + lane] - channel[BEGIN * LANES + lane]
        u[lane] = channel[C0 * LANES + lane] + s * (
            channel[C1 * LANES + lane] + s * (channel[C2 * LANES + lane] + s * channel[C3 * LANES + lane])
        )


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER, abi.POINTER))
def turn(times, channel, sine, cosine):
    """Sine and cosine of a channel's frequency times the time: all channels of one frequency make do with them."""
    for lane in range(LANES):
        angle = channel[FREQUENCY * LANES + lane] * times[lane]
        sine[lane] = lane_sin(angle)
        cosine[lane] = lane_cos(angle)


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER, abi.POINTER))
def sine_values(channel, sine, cosine, u):
    """Values of a channel's sines, its cubics being constant."""
    for lane in range(LANES):
        wave = channel[SINE_PART * LANES + lane] * sine[lane] + channel[COSINE_PART * LANES + lane] * cosine[lane]
        u[lane] = channel[C0 * LANES + lane] + wave


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER, abi.POINTER))
def add_sines(channel, sine, cosine, u):
    """Add the values of a channel's sines."""
    for lane in range(LANES):
        wave = channel[SINE_PART * LANES + lane] * sine[lane] + channel[COSINE_PART * LANES + lane] * cosine[lane]
        u[lane] = u[lane] + wave


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER, abi.POINTER, types.int64))
def grid_values(control, channel, pieces, u, order):
    """Values (order 0) or time derivatives (1) of a channel whose pieces are of one length: its piece is computed."""
    for lane in range(LANES):
        rate, offset = channel[RATE * LANES + lane], channel[OFFSET * LANES + lane]
        x = (rate * control[SIDE * LANES + lane] + offset - channel[C0 * LANES + lane]) * channel[
            C1 * LANES + lane
        ] + 1.0
        last = channel[C3 * LANES + lane]
        x = x if x > 0.0 else 0.0
        x = x if x < last else last
        k = 8 * (int(x) + int(channel[C2 * LANES + lane]))
        s = rate * control[AT * LANES + lane] + offset - pieces[k]
        value = pieces[k + 1] + s * (pieces[k + 2] + s * (pieces[k + 3] + s * pieces[k + 4]))
        slope = rate * (pieces[k + 2] + s * (2.0 * pieces[k + 3] + s * 3.0 * pieces[k + 4]))
        u[lane] = value if order == 0 else slope


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
def take_grid(batch, pack, lane, i, table):
    """Where the pieces of a table of equal pieces stand: channel i computes which of them it needs."""
    row, first = floats(pack.inputs + ROW * INPUT_ROWS * i, INPUT_ROWS * LANES), integers(batch.first, 1)[table]
    row[C0 * LANES + lane] = floats(batch.pieces, 1)[8 * (first + 1)]
    row[C1 * LANES + lane] = floats(batch.per_length, 1)[table]
    row[C2 * LANES + lane] = first
    row[C3 * LANES + lane] = integers(batch.last, 1)[table] - first


@compiled(**LEAN)
def take_wave(pack, lane, i, p, rate, offset, order):
    """The sine of a piece as parts of sine and cosine of frequency times time; returns whether the frequency is new."""
    row = floats(pack.inputs + ROW * INPUT_ROWS * i, INPUT_ROWS * LANES)
    amplitude, phase, before = p[5], p[6] * (offset - p[0]) + p[7], row[FREQUENCY * LANES + lane]
    if order != 0:
        amplitude, phase = amplitude * rate * p[6], phase + 0.5 * np.pi
    row[SINE_PART * LANES + lane] = amplitude * np.cos(phase) if amplitude != 0.0 else 0.0
    row[COSINE_PART * LANES + lane] = amplitude * np.sin(phase) if amplitude != 0.0 else 0.0
    row[FREQUENCY * LANES + lane] = rate * p[6]
    return before != rate * p[6]


@compiled(**LEAN)
def take_cubic(pack, lane, i, p, rate, order):
    """The cubic of a piece, or its time derivative."""
    row = floats(pack.inputs + ROW * INPUT_ROWS * i, INPUT_ROWS * LANES)
    row[BEGIN * LANES + lane] = p[0]
    if order == 0:
        row[C0 * LANES + lane], row[C1 * LANES + lane] = p[1], p[2]
        row[C2 * LANES + lane], row[C3 * LANES + lane] = p[3], p[4]
    else:
        row[C0 * LANES + lane], row[C1 * LANES + lane] = rate * p[2], rate * 2.0 * p[3]
        row[C2 * LANES + lane], row[C3 * LANES + lane] = rate * 3.0 * p[4], 0.0
    floats(pack.u, 1)[i * LANES + lane] = row[C0 * LANES + lane]


@compiled(**LEAN)
def take_piece(batch, pack, lane, i, side):
    """Put the piece that holds time `side` into the rows of channel i.

    Returns from when to when it holds, and whether the channel needs anything else now.
    """
    run = integers(pack.run, LANES)[lane]
    where, cursor = run * batch.channels + i, lane * batch.channels + i
    table, order = integers(batch.table, 1)[where], integers(batch.order, 1)[i]
    rate, offset = floats(batch.rate, 1)[where], floats(batch.offset, 1)[where]
    row = floats(pack.inputs + ROW * INPUT_ROWS * i, INPUT_ROWS * LANES)
    row[RATE * LANES + lane], row[OFFSET * LANES + lane] = rate, offset
    if integers(batch.grid, 1)[i]:
        take_grid(batch, pack, lane, i, table)
        return -np.inf, np.inf, integers(pack.kind, 1)[i] != GRID
    k = piece_at(batch, table, integers(pack.piece, 1)[cursor], rate * side + offset)
    integers(pack.piece, 1)[cursor] = k
    p = floats(batch.pieces + 64 * k, 16)
    take_cubic(pack, lane, i, p, rate, order)
    new = take_wave(pack, lane, i, p, rate, offset, order)
    first, last = integers(batch.first, 1)[table], integers(batch.last, 1)[table]
    before = (p[0] - offset) / rate if rate != 0.0 and k > first else -np.inf
    after = (p[8] - offset) / rate if rate != 0.0 and k < last else np.inf
    if rate < 0.0:
        before, after = (after if k < last else -np.inf), (before if k > first else np.inf)
    return before, after, new or kind_of(pack, lane, i) != integers(pack.lane_kind, 1)[cursor]


@compiled(**LEAN)
def kind_of(pack, lane, i):
    """What the piece of a lane needs."""
    row = floats(pack.inputs + ROW * INPUT_ROWS * i, INPUT_ROWS * LANES)
    moves = row[C1 * LANES + lane] != 0.0 or row[C2 * LANES + lane] != 0.0 or row[C3 * LANES + lane] != 0.0
    waves = row[SINE_PART * LANES + lane] != 0.0 or row[COSINE_PART * LANES + lane] != 0.0
    return (CUBIC if moves else STEADY) + (SINE if waves else 0)


@compiled(**LEAN)
def take_pieces(batch, pack, lane):
    """Exchange the pieces of one lane, note from when to when they hold; returns whether `classify` is due."""
    control = control_rows(pack)
    low, high, changed = -np.inf, np.inf, False
    for i in range(batch.n_inputs):
        before, after, new = take_piece(batch, pack, lane, i, control[SIDE * LANES + lane])
        low, high, changed = max(low, before), min(high, after), changed or new
    control[LOW * LANES + lane], control[HIGH * LANES + lane] = low, high
    return changed


@compiled(**LEAN)
def classify(batch, pack):
    """Find out what each channel needs in any lane, and which earlier channel turns at the same frequencies."""
    kind, leader = integers(pack.kind, batch.n_inputs), integers(pack.leader, batch.n_inputs)
    for i in range(batch.n_inputs):
        kind[i] = GRID if integers(batch.grid, 1)[i] else STEADY
        leader[i] = i
        if kind[i] == STEADY:
            for lane in range(LANES):
                found = kind_of(pack, lane, i)
                integers(pack.lane_kind, 1)[lane * batch.channels + i] = found
                kind[i] |= found
        if kind[i] == SINE or kind[i] == CUBIC_AND_SINE:
            for j in range(i - 1, -1, -1):
                if (kind[j] == SINE or kind[j] == CUBIC_AND_SINE) and same_frequency(pack, i, j):
                    leader[i] = leader[j]


@compiled(**LEAN)
def same_frequency(pack, i, j):
    """Whether two channels turn at the same frequency in every lane that turns."""
    a = floats(pack.inputs + ROW * (INPUT_ROWS * i + FREQUENCY), LANES)
    b = floats(pack.inputs + ROW * (INPUT_ROWS * j + FREQUENCY), LANES)
    different = 0
    for lane in range(LANES):
        different += a[lane] != b[lane]
    return different == 0


@compiled(**LEAN)
def look_up(batch, pack):
    """Write all inputs of all lanes at their times AT; which piece holds is looked up at SIDE."""
    if outside(doubles(pack.control)) > 0:
        control, run, changed = control_rows(pack), integers(pack.run, LANES), False
        for lane in range(LANES):
            side = control[SIDE * LANES + lane]
            inside = side >= control[LOW * LANES + lane] and side < control[HIGH * LANES + lane]
            if run[lane] >= 0 and not inside:
                changed = take_pieces(batch, pack, lane) or changed
        if changed:
            classify(batch, pack)
    kind, leader = integers(pack.kind, batch.n_inputs), integers(pack.leader, batch.n_inputs)
    times = doubles(pack.control + ROW * AT)
    for i in range(batch.n_inputs):
        channel, u = doubles(pack.inputs + ROW * INPUT_ROWS * i), doubles(pack.u + ROW * i)
        if kind[i] == GRID:
            order = integers(batch.order, 1)[i]
            grid_values(doubles(pack.control), channel, doubles(batch.pieces), u, order)
            continue
        if kind[i] & CUBIC:
            cubic_values(times, channel, u)
        if kind[i] & SINE:
            waves = pack.turns + 2 * ROW * leader[i]
            if leader[i] == i:
                turn(times, channel, doubles(waves), doubles(waves + ROW))
            if kind[i] & CUBIC:
                add_sines(channel, doubles(waves), doubles(waves + ROW), u)
            else:
                sine_values(channel, doubles(waves), doubles(waves + ROW), u)
