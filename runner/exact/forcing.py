"""What drives the states within a segment, in which no input changes its piece: powers of time and sines."""

import math

import numpy as np

from runner.compiled import compiled
from runner.exact.exponential import ROW, clear, driving_block, matrix_size
from runner.exact.space import POWERS
from runner.memory import BLOCK, LEAN, floats, integers, matrix, weighted_sum

#: Of a table of pieces.
COLUMNS = 8


@compiled(**LEAN)
def look_up(s):
    """Set each channel's piece for times just after s.t and s.segment_end to where the first of them ends."""
    pieces, cursor = matrix(s.pieces, s.n_pieces, COLUMNS), integers(s.cursor, s.channels)
    first, last = integers(s.first, s.channels), integers(s.last, s.channels)
    end = s.t1
    for i in range(s.channels):
        rate, offset = floats(s.rate, s.channels)[i], floats(s.offset, s.channels)[i]
        tau = rate * (s.t + s.near) + offset
        k = cursor[i]
        while k < last[i] and pieces[k + 1, 0] <= tau:
            k += 1
        while k > first[i] and pieces[k, 0] > tau:
            k -= 1
        cursor[i] = k
        if rate > 0.0 and k < last[i]:
            end = min(end, (pieces[k + 1, 0] - offset) / rate)
        elif rate < 0.0 and k > first[i]:
            end = min(end, (pieces[k, 0] - offset) / rate)
    end = max(end, s.t + s.near)
    s.segment_end = end if end < s.t1 - s.near else s.t1


@compiled(**LEAN)
def force(s):
    """Write the forcing as a function of time since s.t: sum of g[d] time^d, and sines by frequency."""
    pieces, cursor = matrix(s.pieces, s.n_pieces, COLUMNS), integers(s.cursor, s.channels)
    order = integers(s.order, s.channels)
    m, width = s.channels + 1, BLOCK * s.panels
    values = matrix(s.values, POWERS, m)
    s.degree, s.frequencies = 0, 0
    for i in range(s.channels):
        k, rate = cursor[i], floats(s.rate, s.channels)[i]
        since = rate * s.t + floats(s.offset, s.channels)[i] - pieces[k, 0]
        a, b, c, d = pieces[k, 1], pieces[k, 2], pieces[k, 3], pieces[k, 4]
        if order[i] == 1:
            a, b, c, d = rate * b, rate * 2.0 * c, rate * 3.0 * d, 0.0
        values[0, i] = a + since * (b + since * (c + since * d))
        values[1, i] = rate * (b + since * (2.0 * c + since * 3.0 * d))
        values[2, i] = rate * rate * (c + since * 3.0 * d)
        values[3, i] = rate * rate * rate * d
        for power in range(s.degree + 1, POWERS):
            if values[power, i] != 0.0:
                s.degree = power
        if pieces[k, 5] != 0.0:
            add_sine(s, i, rate * pieces[k, 6], pieces[k, 6] * since + pieces[k, 7], pieces[k, 5], order[i])
    values[0, m - 1] = 1.0
    for power in range(s.degree + 1):
        for b in range(s.panels):
            target = s.g + 8 * (width * power + BLOCK * b)
            weighted_sum(s.zeros, 1.0, s.values + 8 * m * power, m, s.B + ROW * m * b, target)


@compiled(**LEAN)
def add_sine(s, i, omega, phase, amplitude, order):
    """Add amplitude*sin(omega time + phase), or its derivative, of channel i to the sines of the states."""
    sine, cosine = amplitude * math.cos(phase), amplitude * math.sin(phase)
    if order == 1:
        sine, cosine = -omega * cosine, omega * sine
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
def augment(s, h):
    """Write M of one step h from s.t, time counted in steps, and the drivers p at its start.

    The rows below A are the powers 1, s, s^2, ... and the pairs sin, cos. Each group is scaled so that its drive is no
    larger than A: what it drives then does not decide how finely A is scaled (Al-Mohy, Higham, 2011, section 4).
    """
    n, powers = s.n, s.degree + 1
    s.q = powers + 2 * s.frequencies
    rows, width = n + s.q, BLOCK * s.panels
    clear(s.M, matrix_size(n, s.q))
    for b in range(s.panels):
        A, M = floats(s.A + ROW * n * b, BLOCK * n), floats(s.M + ROW * rows * b, BLOCK * n)
        for i in range(BLOCK * n):
            M[i] = h * A[i]
    factor = h
    for power in range(powers):
        place_row(s, n + power, s.g + 8 * width * power, factor)
        factor *= h
    for f in range(s.frequencies):
        place_row(s, n + powers + 2 * f, s.sine + 8 * width * f, h)
        place_row(s, n + powers + 2 * f + 1, s.cosine + 8 * width * f, h)
    p, J, bound = floats(s.p, s.q), driving_block(s.M, n, s.q), max(1.0, h * s.nu)
    beta = scale_rows(s, n, n + powers, bound)
    for power in range(powers):
        p[power] = 1.0 / beta if power == 0 else 0.0
        if power > 0:
            put(J, s.q, power - 1, power, float(power))
    for f in range(s.frequencies):
        first, angle = powers + 2 * f, h * floats(s.omega, s.frequencies)[f]
        beta = scale_rows(s, n + first, n + first + 2, bound)
        p[first], p[first + 1] = 0.0, 1.0 / beta
        put(J, s.q, first, first + 1, -angle)
        put(J, s.q, first + 1, first, angle)


@compiled(**LEAN)
def put(base, q, row, column, value):
    """Set an element of J."""
    floats(base, BLOCK * -(-q // BLOCK) * q)[BLOCK * (q * (column // BLOCK) + row) + column % BLOCK] = value


@compiled(**LEAN)
def place_row(s, row, source, factor):
    """Write factor * vector into a row of M."""
    for b in range(s.panels):
        vector = floats(source + ROW * b, BLOCK)
        target = floats(s.M + ROW * ((s.n + s.q) * b + row), BLOCK)
        for i in range(BLOCK):
            target[i] = factor * vector[i]


@compiled(**LEAN)
def scale_rows(s, first, end, bound):
    """Multiply rows of M by the power of two that makes the largest of them about `bound`; returns it."""
    largest = 0.0
    for row in range(first, end):
        total = 0.0
        for b in range(s.panels):
            source = floats(s.M + ROW * ((s.n + s.q) * b + row), BLOCK)
            for i in range(BLOCK):
                total += abs(source[i])
        largest = max(largest, total)
    if not 0.0 < largest < np.inf:
        return 1.0
    beta = math.ldexp(1.0, -math.frexp(largest / bound)[1])
    for row in range(first, end):
        for b in range(s.panels):
            target = floats(s.M + ROW * ((s.n + s.q) * b + row), BLOCK)
            for i in range(BLOCK):
                target[i] *= beta
    return beta
