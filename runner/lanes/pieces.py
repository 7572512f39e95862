"""The present piece of each lane and channel: exchanged, lane by lane, when time leaves it."""

import numpy as np

from qddot.runner.inputs import piece
from qddot.runner.inputs.piece import COLUMNS, differentiated, holds_from, holds_to, piece_at
from qddot.runner.inputs.sine import FAR
from qddot.runner.lanes.lane import control_of, input_of
from qddot.runner.lanes.pack import CHANNEL_ROWS, INPUT_ROWS, LANES
from qddot.runner.lanes.tables import take_table
from qddot.runner.lanes.values import ROW
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, integers

FREQUENCY = CHANNEL_ROWS["frequency"]
#: Kinds of a channel: what its lanes together need. As np.int64, because numba compiles a function again for every
#: literal int that it is called with.
STEADY, CUBIC, SINE, CUBIC_AND_SINE, TABLE = np.arange(5)


@compiled(**LEAN)
def take_coefficients(pack, lane, i, p, rate, offset, order, zero):
    """A piece differentiated `order` times by time: its cubic, its sine in parts of frequency*(time - zero).

    Returns whether the frequency is new.
    """
    channel = input_of(pack, i, lane)
    c0, c1, c2, c3, amplitude, phase = differentiated(p, order, rate)
    channel.begin = p[piece.START]
    channel.c0, channel.c1 = c0, c1
    channel.c2, channel.c3 = c2, c3
    floats(pack.u, 1)[i * LANES + lane] = c0
    phase += p[piece.FREQUENCY] * (rate * zero + offset - p[piece.START])
    before, frequency = channel.frequency, rate * p[piece.FREQUENCY]
    channel.sine_part = amplitude * np.cos(phase) if amplitude != 0.0 else 0.0
    channel.cosine_part = amplitude * np.sin(phase) if amplitude != 0.0 else 0.0
    channel.frequency = frequency
    return before != frequency


@compiled(**LEAN)
def take_piece(batch, pack, lane, i, side):
    """Put the piece that holds time `side`, from which on its sine counts the time, into the rows of channel i.

    Returns from when to when it holds, and whether the channel needs anything else now.
    """
    run = integers(pack.run, LANES)[lane]
    where, cursor = run * batch.channels + i, lane * batch.channels + i
    table, order = integers(batch.table, 1)[where], integers(batch.order, 1)[i]
    rate, offset = floats(batch.rate, 1)[where], floats(batch.offset, 1)[where]
    channel = input_of(pack, i, lane)
    channel.rate, channel.offset = rate, offset
    if integers(batch.way, 1)[i]:
        take_table(batch, pack, lane, i, table)
        return -np.inf, np.inf, integers(pack.kind, 1)[i] != TABLE
    first, last = integers(batch.first, 1)[table], integers(batch.last, 1)[table]
    k = piece_at(batch.pieces, first, last, integers(pack.piece, 1)[cursor], rate, offset, side)
    integers(pack.piece, 1)[cursor] = k
    p = floats(batch.pieces + 8 * COLUMNS * k, COLUMNS)
    new = take_coefficients(pack, lane, i, p, rate, offset, order, side)
    turning = rate * p[piece.FREQUENCY] if p[piece.AMPLITUDE] != 0.0 else 0.0
    reach = 0.5 * FAR / abs(turning) if turning != 0.0 else np.inf
    before = max(holds_from(batch.pieces, first, last, k, rate, offset), side - reach)
    after = min(holds_to(batch.pieces, first, last, k, rate, offset), side + reach)
    return before, after, new or kind_of(pack, lane, i) != integers(pack.lane_kind, 1)[cursor]


@compiled(**LEAN)
def kind_of(pack, lane, i):
    """What the piece of a lane needs."""
    channel = input_of(pack, i, lane)
    moves = channel.c1 != 0.0 or channel.c2 != 0.0 or channel.c3 != 0.0
    waves = channel.sine_part != 0.0 or channel.cosine_part != 0.0
    return (CUBIC if moves else STEADY) + (SINE if waves else 0)


@compiled(**LEAN)
def take_pieces(batch, pack, lane):
    """Exchange the pieces of one lane, note from when to when they hold; returns whether `classify` is due."""
    its = control_of(pack, lane)
    low, high, changed = -np.inf, np.inf, False
    its.zero = its.side
    for i in range(batch.n_watched):
        before, after, new = take_piece(batch, pack, lane, i, its.side)
        low, high, changed = max(low, before), min(high, after), changed or new
    its.low, its.high = low, high
    return changed


@compiled(**LEAN)
def classify(batch, pack):
    """Find out what each channel needs in any lane, and which earlier channel turns at the same frequencies.

    And how many from it on are nothing but sines of the same frequencies.
    """
    kind, leader = integers(pack.kind, batch.n_watched), integers(pack.leader, batch.n_watched)
    alike = integers(pack.alike, batch.n_watched)
    for i in range(batch.n_watched):
        kind[i] = TABLE if integers(batch.way, 1)[i] else STEADY
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
    for i in range(batch.n_watched - 1, -1, -1):
        more = i + 1 < batch.n_watched and kind[i] == kind[i + 1] == SINE and leader[i] == leader[i + 1]
        alike[i] = 1 + (alike[i + 1] if more else 0)


@compiled(**LEAN)
def same_frequency(pack, i, j):
    """Whether two channels turn at the same frequency in every lane that turns."""
    a = floats(pack.inputs + ROW * (INPUT_ROWS * i + FREQUENCY), LANES)
    b = floats(pack.inputs + ROW * (INPUT_ROWS * j + FREQUENCY), LANES)
    different = 0
    for lane in range(LANES):
        different += a[lane] != b[lane]
    return different == 0
