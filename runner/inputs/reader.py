"""Reading all input channels at a time: the pieces of the moment as one cubic plus one sine a channel, in SIMD.

A reader holds what its channels are between two breakpoints: a window of time, and in groups of eight the coefficients
in local time. While the time stays within the window, reading takes no search and no division, and the loop over the
channels is one the compiler turns into vector instructions.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs import piece
from qddot.runner.inputs.piece import InputTable, differentiated, holds_from, holds_to, piece_at, piece_value
from qddot.runner.inputs.sine import FAR, sine
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, VIEW, first_item, floats

#: The head of a reader: the window; whether a channel has a sine in it, whether all the channels read are constant
#: there; GROUP.
FROM, TO, HAS_SINE, CONSTANT, WIDTH = range(5)
HEAD = 5
#: Channels lie in groups of eight; the rows of a group: the channels' pieces; the times their cubics and sines count
#: from; the coefficients; the values read.
GROUP = 8
PIECE, ORIGIN, C0, C1, C2, C3, AMPLITUDE, FREQUENCY, PHASE, SINE_ORIGIN, VALUE = range(0, 11 * GROUP, GROUP)
GROUP_SIZE = 11 * GROUP


def reader_for(table: InputTable) -> NDArray[np.float64]:
    """A reader of these channels, its window empty: (HEAD + groups*GROUP_SIZE,)."""
    places, empty = _empty(len(table.first))
    reader = empty.copy()
    reader[places] = table.first
    return reader


@lru_cache(maxsize=64)
def _empty(count: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """A reader of so many channels without their pieces, and the places of these."""
    channels = np.arange(count)
    reader = np.zeros(HEAD + -(-count // GROUP) * GROUP_SIZE)
    reader[FROM], reader[TO], reader[WIDTH] = np.inf, -np.inf, GROUP
    return HEAD + channels // GROUP * GROUP_SIZE + channels % GROUP + PIECE, reader


def sample(table: InputTable, times: NDArray[np.float64], values: NDArray[np.float64]) -> None:
    """Write all channels at times (n,) into values (n, n_channels); at a jump, the limit from the right."""
    write_samples(table, reader_for(table), times, values)


@compiled()
def evaluate(table, reader, t, t_side, count, u):
    """`read`, for Python, and by its address."""
    read(table, reader, t, t_side, count, u)


@compiled()
def write_samples(table, reader, times, values):
    """`sample`, by a reader."""
    for i in range(len(times)):
        evaluate(table, reader, times[i], times[i], len(table.first), values[i])


@compiled(**LEAN)
def read(table, reader, t, t_side, count, u):
    """Write the first `count` channels at time t into u.

    The pieces are those at t_side, a time inside the step that t belongs to, so that a value at a breakpoint is the
    limit from within the step. reader: see `reader_for`.
    """
    if not reader[FROM] <= t_side < reader[TO]:
        refresh(table, reader, t_side, count)
    read_window(reader, t, count, u)


@compiled(**LEAN)
def read_window(reader, t, count, u):
    """`read` where the side of t lies within the window."""
    where = first_item(reader) + 8 * HEAD
    for start in range(0, count, GROUP):
        read_group(where, t, reader[HAS_SINE], np.int64(reader[WIDTH]))
        values = floats(where + 8 * VALUE, GROUP)
        for i in range(min(GROUP, count - start)):
            u[start + i] = values[i]
        where += 8 * GROUP_SIZE


@compiled(**VIEW)
def read_group(where, t, has_sine, width):
    """The values of eight channels at an address, at time t.

    width: GROUP, but not told to the compiler, which would unroll the loops before it looks for vector instructions.
    """
    g = floats(where, GROUP_SIZE)
    for i in range(width):
        s = t - g[i + ORIGIN]
        g[i + VALUE] = g[i + C0] + s * (g[i + C1] + s * (g[i + C2] + s * g[i + C3]))
    if has_sine != 0.0:
        for i in range(width):
            angle = g[i + FREQUENCY] * (t - g[i + SINE_ORIGIN]) + g[i + PHASE]
            g[i + VALUE] += g[i + AMPLITUDE] * sine(angle)


@compiled(**LEAN)
def refresh(table, reader, t, count):
    """Take over the pieces at time t; the window is the time until the first of them ends."""
    reader[FROM], reader[TO], reader[HAS_SINE], reader[CONSTANT] = -np.inf, np.inf, 0.0, 1.0
    for i in range(len(table.first)):
        place = HEAD + i // GROUP * GROUP_SIZE + i % GROUP
        if table.rate[i] == 0.0:
            stand_still(table, reader, place, i)
        else:
            take_piece(table, reader, place, i, t)
        moves = reader[place + AMPLITUDE] != 0.0
        if moves:
            reader[HAS_SINE] = 1.0
        for row in (C1, C2, C3):
            moves = moves or reader[place + row] != 0.0
        if moves and i < count:
            reader[CONSTANT] = 0.0


@compiled(**LEAN)
def stand_still(table, reader, place, i):
    """A channel whose argument does not change with time."""
    first, last = table.first[i], table.last[i]
    k = piece_at(first_item(table.pieces), first, last, first, 0.0, table.offset[i], 0.0)
    for row in range(ORIGIN, VALUE, GROUP):
        reader[place + row] = 0.0
    reader[place + C0] = piece_value(
        table.pieces[k], table.offset[i] - table.pieces[k, piece.START], table.order[i], 0.0
    )


@compiled(**LEAN)
def take_piece(table, reader, place, i, t):
    """The piece of channel i at time t, in powers of t - origin, and its end in time into the window."""
    rate, offset, first, last = table.rate[i], table.offset[i], table.first[i], table.last[i]
    pieces = first_item(table.pieces)
    k = piece_at(pieces, first, last, np.int64(reader[place + PIECE]), rate, offset, t)
    reader[FROM] = max(reader[FROM], holds_from(pieces, first, last, k, rate, offset))
    reader[TO] = min(reader[TO], holds_to(pieces, first, last, k, rate, offset))
    reader[place + PIECE] = k
    write_coefficients(table.pieces[k], rate, offset, table.order[i], t, reader, place)


@compiled(**LEAN)
def write_coefficients(of, rate, offset, order, t, reader, place):
    """A piece in tau as coefficients in time, differentiated `order` times."""
    origin, frequency = (of[piece.START] - offset) / rate, rate * of[piece.FREQUENCY]
    c0, c1, c2, c3, amplitude, phase = differentiated(of, order, rate)
    reader[place + ORIGIN], reader[place + C0], reader[place + C1] = origin, c0, rate * c1
    reader[place + C2], reader[place + C3] = rate * rate * c2, rate * rate * rate * c3
    sine_origin = origin
    if amplitude != 0.0 and frequency != 0.0:
        angle, reach = frequency * (t - origin) + phase, 0.5 * FAR / abs(frequency)
        if abs(angle) > 0.5 * FAR:
            sine_origin, phase = t, np.fmod(angle, 2.0 * np.pi)
        reader[FROM], reader[TO] = max(reader[FROM], t - reach), min(reader[TO], t + reach)
    reader[place + AMPLITUDE] = amplitude
    reader[place + FREQUENCY] = frequency
    reader[place + PHASE] = phase
    reader[place + SINE_ORIGIN] = sine_origin
