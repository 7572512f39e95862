"""What drives the states within a segment, in which no input changes its piece: powers of time and sines."""

import math

import numpy as np

from qddot.runner.exact.ladder import ROW, THETA_16, M, driving_block, place
from qddot.runner.exact.space import POWERS
from qddot.runner.inputs.instants import rounding
from qddot.runner.inputs.piece import AMPLITUDE, COLUMNS, FREQUENCY, START, differentiated, holds_to, piece_at
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BLOCK, LEAN, floats, integers, matrix
from qddot.runner.machine.sums import weighted_sum

#: Powers of time count it in so many delta, the fastest sine turns by no more than FAST rad in delta, and no row of
#: drivers sums up to more than DRIVE: all rows of M then have norms below THETA_16.
SLOW, FAST, DRIVE = 16.0, 0.5, 0.25


@compiled(**LEAN)
def look_up(s):
    """Set each channel's piece for times just after s.t and s.segment_end to where the first of them ends."""
    cursor, first, last = integers(s.cursor, s.channels), integers(s.first, s.channels), integers(s.last, s.channels)
    end, after = s.t1, s.t + rounding(s.t)
    for i in range(s.channels):
        rate, offset = floats(s.rate, s.channels)[i], floats(s.offset, s.channels)[i]
        cursor[i] = piece_at(s.pieces, first[i], last[i], cursor[i], rate, offset, after)
        end = min(end, holds_to(s.pieces, first[i], last[i], cursor[i], rate, offset))
    s.segment_end = end if end < s.t1 - rounding(s.t1) else s.t1


@compiled(**LEAN)
def force(s):
    """Write the forcing as a function of time since s.t: sum of g[d] time^d, and sines by frequency."""
    pieces, cursor = matrix(s.pieces, s.n_pieces, COLUMNS), integers(s.cursor, s.channels)
    order = integers(s.order, s.channels)
    m, width = s.channels + 1, BLOCK * s.panels
    values = matrix(s.values, POWERS, m)
    s.degree, s.frequencies = 0, 0
    for i in range(s.channels):
        p, rate = pieces[cursor[i]], floats(s.rate, s.channels)[i]
        since = rate * s.t + floats(s.offset, s.channels)[i] - p[START]
        a, b, c, d, amplitude, phase = differentiated(p, order[i], rate)
        values[0, i] = a + since * (b + since * (c + since * d))
        values[1, i] = rate * (b + since * (2.0 * c + since * 3.0 * d))
        values[2, i] = rate * rate * (c + since * 3.0 * d)
        values[3, i] = rate * rate * rate * d
        for power in range(s.degree + 1, POWERS):
            if values[power, i] != 0.0:
                s.degree = power
        if p[AMPLITUDE] != 0.0:
            add_sine(s, i, rate * p[FREQUENCY], p[FREQUENCY] * since + phase, amplitude)
    values[0, m - 1] = 1.0
    for power in range(s.degree + 1):
        for b in range(s.panels):
            target = s.g + 8 * (width * power + BLOCK * b)
            weighted_sum(s.zeros, 1.0, s.values + 8 * m * power, m, s.B + ROW * m * b, target)


@compiled(**LEAN)
def add_sine(s, i, omega, phase, amplitude):
    """Add amplitude*sin(omega time + phase) of channel i to the sines of the states."""
    sine, cosine = amplitude * math.cos(phase), amplitude * math.sin(phase)
    if omega < 0.0:
        omega, sine = -omega, -sine
    width, known = BLOCK * s.panels, floats(s.omega, s.channels)
    f = 0
    while f < s.frequencies and known[f] != omega:
        f += 1
    if f == s.frequencies:
        known[f] = omega
        clear(s.sine + 8 * width * f, width)
        clear(s.cosine + 8 * width * f, width)
        s.frequencies += 1
    S, C = floats(s.sine + 8 * width * f, width), floats(s.cosine + 8 * width * f, width)
    for b in range(s.panels):
        B = floats(s.B + ROW * ((s.channels + 1) * b + i), BLOCK)
        for k in range(BLOCK):
            S[BLOCK * b + k] += sine * B[k]
            C[BLOCK * b + k] += cosine * B[k]


@compiled(**LEAN)
def highest_frequency(s):
    """The highest frequency that drives the states, in rad/s."""
    highest = 0.0
    known = floats(s.omega, s.frequencies)
    for f in range(s.frequencies):
        highest = max(highest, known[f])
    return highest


@compiled(**LEAN)
def set_steps(s, longest):
    """Choose delta, `longest` halved until a step is short for A and for the sines; the ladder starts anew."""
    s.delta, s.grid_level = longest, 0
    while s.delta * s.nu > THETA_16 or s.delta * highest_frequency(s) > FAST:
        s.delta *= 0.5
        s.grid_level += 1
    s.turns = 0
    for b in range(s.panels):
        A, M_rows = (
            floats(s.A + ROW * s.n * b, BLOCK * s.n),
            floats(place(s, M) + ROW * (s.n + s.q_max) * b, BLOCK * s.n),
        )
        for i in range(BLOCK * s.n):
            M_rows[i] = s.delta * A[i]


@compiled(**LEAN)
def set_driver_rows(s):
    """Write the rows of M below A for the forcing that `force` found at s.t, from which the drivers count their time.

    The drivers are the powers of time / (SLOW delta), and the pairs sin, cos. Each group is scaled so that its drive
    is no larger than A is allowed to be: what it drives then does not decide how long delta is (Al-Mohy, Higham, 2011,
    section 4).
    """
    if s.delta * highest_frequency(s) > FAST:
        set_steps(s, s.spacing if s.spacing > 0.0 else s.delta)
    n, powers, width = s.n, s.degree + 1, BLOCK * s.panels
    s.q, s.origin, s.driver_turns = powers + 2 * s.frequencies, s.t, 0
    J, beta = driving_block(s, place(s, M)), floats(s.beta, s.q)
    clear(J, BLOCK * -(-s.q // BLOCK) * s.q_max)
    factor = s.delta
    for power in range(powers):
        place_row(s, n + power, s.g + 8 * width * power, factor)
        factor *= SLOW * s.delta
        if power > 0:
            put(s, J, power - 1, power, power / SLOW)
    beta[0] = scale_rows(s, n, n + powers)
    for f in range(s.frequencies):
        row, angle = powers + 2 * f, s.delta * floats(s.omega, s.frequencies)[f]
        place_row(s, n + row, s.sine + 8 * width * f, s.delta)
        place_row(s, n + row + 1, s.cosine + 8 * width * f, s.delta)
        beta[row] = scale_rows(s, n + row, n + row + 2)
        put(s, J, row, row + 1, -angle)
        put(s, J, row + 1, row, angle)


@compiled(**LEAN)
def set_drivers(s):
    """Write the drivers p at s.t."""
    p, beta, since = floats(s.p, s.q), floats(s.beta, s.q), s.t - s.origin
    powers = s.q - 2 * s.frequencies
    value = 1.0 / beta[0]
    for power in range(powers):
        p[power] = value
        value *= since / (SLOW * s.delta)
    for f in range(s.frequencies):
        row, angle = powers + 2 * f, floats(s.omega, s.frequencies)[f] * since
        p[row], p[row + 1] = math.sin(angle) / beta[row], math.cos(angle) / beta[row]


@compiled(**LEAN)
def clear(base, count):
    """Write `count` zeros."""
    target = floats(base, count)
    for i in range(count):
        target[i] = 0.0


@compiled(**LEAN)
def put(s, base, row, column, value):
    """Set an element of J."""
    floats(base + ROW * (s.q_max * (column // BLOCK) + row), BLOCK)[column % BLOCK] = value


@compiled(**LEAN)
def place_row(s, row, source, factor):
    """Write factor * vector into a row of M."""
    for b in range(s.panels):
        vector = floats(source + ROW * b, BLOCK)
        target = floats(place(s, M) + ROW * ((s.n + s.q_max) * b + row), BLOCK)
        for i in range(BLOCK):
            target[i] = factor * vector[i]


@compiled(**LEAN)
def scale_rows(s, first, end):
    """Multiply rows of M by the power of two that makes the largest of them DRIVE or less; returns it."""
    largest = 0.0
    for row in range(first, end):
        total = 0.0
        for b in range(s.panels):
            source = floats(place(s, M) + ROW * ((s.n + s.q_max) * b + row), BLOCK)
            for i in range(BLOCK):
                total += abs(source[i])
        largest = max(largest, total)
    if not 0.0 < largest < np.inf:
        return 1.0
    beta = math.ldexp(DRIVE, -math.frexp(largest)[1])
    for row in range(first, end):
        for b in range(s.panels):
            target = floats(place(s, M) + ROW * ((s.n + s.q_max) * b + row), BLOCK)
            for i in range(BLOCK):
                target[i] *= beta
    return beta
