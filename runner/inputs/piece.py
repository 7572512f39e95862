"""A piece of a signal: a cubic plus a sine in the argument tau = rate*t + offset; which holds when, and its rates.

Every reader of inputs (alone, in lanes, exact) finds its piece and differentiates it here.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats

#: Columns of a piece: value(s) = c0 + c1 s + c2 s^2 + c3 s^3 + amplitude*sin(frequency*s + phase), s = tau - start.
START, C0, C1, C2, C3, AMPLITUDE, FREQUENCY, PHASE = range(8)
COLUMNS = 8


class InputTable(NamedTuple):
    """All input channels of a run as flat arrays, in the kernel's order: what compiled drivers read.

    pieces (n_pieces, 8); per channel first and last piece, rate, offset, and order (0 value, 1 and 2 time derivatives);
    breakpoints (m,): times, rising, without repeats.
    """

    pieces: NDArray[np.float64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    rate: NDArray[np.float64]
    offset: NDArray[np.float64]
    order: NDArray[np.int64]
    breakpoints: NDArray[np.float64]


@compiled(**LEAN)
def begins(pieces, k, rate, offset):
    """The time at which the argument rate*t + offset passes the start of piece k of those at an address.

    It is computed as a signal's breakpoints are: where a piece ends and where an integrator lands is one number.
    """
    return (floats(pieces, COLUMNS * k + 1)[COLUMNS * k] - offset) / rate


@compiled(**LEAN)
def piece_at(pieces, first, last, k, rate, offset, t):
    """Which of the pieces first to last of those at an address holds at time t, found by walking from piece k."""
    k = min(max(k, first), last)
    if rate == 0.0:
        start = floats(pieces, COLUMNS * last + 1)
        while k < last and start[COLUMNS * (k + 1)] <= offset:
            k += 1
        while k > first and start[COLUMNS * k] > offset:
            k -= 1
    elif rate > 0.0:
        while k < last and begins(pieces, k + 1, rate, offset) <= t:
            k += 1
        while k > first and begins(pieces, k, rate, offset) > t:
            k -= 1
    else:
        while k > first and begins(pieces, k, rate, offset) <= t:
            k -= 1
        while k < last and begins(pieces, k + 1, rate, offset) > t:
            k += 1
    return k


@compiled(**LEAN)
def holds_from(pieces, first, last, k, rate, offset):
    """Since when piece k has held; negative infinity where it always has."""
    if rate > 0.0 and k > first:
        return begins(pieces, k, rate, offset)
    return begins(pieces, k + 1, rate, offset) if rate < 0.0 and k < last else -np.inf


@compiled(**LEAN)
def holds_to(pieces, first, last, k, rate, offset):
    """Until when piece k holds; infinity where it always will."""
    if rate > 0.0 and k < last:
        return begins(pieces, k + 1, rate, offset)
    return begins(pieces, k, rate, offset) if rate < 0.0 and k > first else np.inf


@compiled(**LEAN)
def differentiated(piece, order, rate):
    """C0 to C3, AMPLITUDE and PHASE of a piece (8,) differentiated `order` times by time; its START and FREQUENCY stay.

    rate: of its argument.
    """
    c0, c1, c2, c3 = piece[C0], piece[C1], piece[C2], piece[C3]
    amplitude, phase = piece[AMPLITUDE], piece[PHASE]
    for _ in range(order):
        c0, c1, c2, c3 = rate * c1, rate * 2.0 * c2, rate * 3.0 * c3, 0.0
        amplitude, phase = amplitude * rate * piece[FREQUENCY], phase + 0.5 * np.pi
    return c0, c1, c2, c3, amplitude, phase


@compiled(**LEAN)
def piece_value(piece, s, order, rate):
    """The value of a piece (8,) differentiated `order` times by time, at s behind its start; rate: of its argument."""
    c0, c1, c2, c3, amplitude, phase = differentiated(piece, order, rate)
    wave = amplitude * np.sin(piece[FREQUENCY] * s + phase) if amplitude != 0.0 else 0.0
    return c0 + s * (c1 + s * (c2 + s * c3)) + wave
