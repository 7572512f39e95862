"""The Taylor coefficients of inputs: those of a cubic and a sine are known in closed form."""

import numpy as np

from qddot.runner.inputs.reader import (
    AMPLITUDE,
    C0,
    C1,
    C2,
    C3,
    FREQUENCY,
    GROUP,
    GROUP_SIZE,
    HAS_SINE,
    HEAD,
    ORIGIN,
    PHASE,
    SINE_ORIGIN,
    TO,
    WIDTH,
)
from qddot.runner.inputs.sine import sine
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, VIEW, floats


@compiled(**LEAN)
def write_inputs(space, t):
    """Write the series of all inputs about t, from the pieces that the reader has at hand."""
    reader = floats(space.reader, space.reader_size)
    for start in range(0, space.series_inputs, GROUP):
        pieces = space.reader + 8 * (HEAD + start // GROUP * GROUP_SIZE)
        write_group(pieces, space.inputs_at + 8 * start, space, t, reader[HAS_SINE], np.int64(reader[WIDTH]))


@compiled(**VIEW)
def write_group(pieces, target, space, t, has_sine, width):
    """Eight channels: a sin(w s + p) has the coefficients x_k = -w^2 x_{k-2} / (k (k-1)); a cubic has four.

    width: GROUP, but not told to the compiler, which would unroll the loops before it looks for vector instructions.
    """
    g, stride = floats(pieces, GROUP_SIZE), space.input_stride
    before, row = floats(target, GROUP), floats(target + stride, GROUP)
    if has_sine != 0.0:
        for i in range(width):
            angle = g[i + FREQUENCY] * (t - g[i + SINE_ORIGIN]) + g[i + PHASE]
            before[i] = g[i + AMPLITUDE] * sine(angle)
            row[i] = g[i + AMPLITUDE] * g[i + FREQUENCY] * sine(angle + 0.5 * np.pi)
        for k in range(2, space.highest + 1):
            before, row = floats(target + stride * (k - 2), GROUP), floats(target + stride * k, GROUP)
            part = -1.0 / (k * (k - 1))
            for i in range(width):
                row[i] = part * g[i + FREQUENCY] * g[i + FREQUENCY] * before[i]
    else:
        for k in range(space.highest + 1):
            row = floats(target + stride * k, GROUP)
            for i in range(width):
                row[i] = 0.0
    first, second = floats(target, GROUP), floats(target + stride, GROUP)
    third, fourth = floats(target + 2 * stride, GROUP), floats(target + 3 * stride, GROUP)
    for i in range(width):
        s = t - g[i + ORIGIN]
        c1, c2, c3 = g[i + C1], g[i + C2], g[i + C3]
        first[i] += g[i + C0] + s * (c1 + s * (c2 + s * c3))
        second[i] += c1 + s * (2.0 * c2 + 3.0 * s * c3)
        third[i] += c2 + 3.0 * s * c3
        fourth[i] += c3


@compiled(**LEAN)
def pieces_end(space):
    """Until when the pieces that the reader has at hand hold."""
    return floats(space.reader, space.reader_size)[TO] if space.n_inputs > 0 else np.inf
