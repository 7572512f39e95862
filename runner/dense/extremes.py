"""What the pieces of a run say: states at any times, and the extremes of states, outputs and inputs.

A source is a kernel of outputs by its address (0: none), `evaluate` by its address, the inputs, their reader and the
constants; pieces are their times t (k, degree + 1), states x (k, degree + 1, n_states) and the points of a step (degree
+ 1,); room is for inputs, outputs and states of a moment. A row holds all quantities: states, outputs, inputs.
"""

from typing import Any

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from qddot.runner.abi import VECTOR
from qddot.runner.frame.pieces import part_of, piece_of, state_within
from qddot.runner.inputs.instants import side_of
from qddot.runner.inputs.signal import stack
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN
from qddot.runner.machine.pointers import call_kernel, calling

#: Columns of extremes: least value and its time, greatest value and its time.
LEAST, GREATEST = 0, 2
#: An interval in which an extreme is sought becomes so much shorter at a time, and so often: the time is good to 1e-6
#: of the interval, the value to the square of that.
GOLDEN, SEARCHES = 0.6180339887498949, 30
#: It is sought where points come as near to what is known of it as this part of what they range over.
NEAR = 0.1


#: The inputs as compiled code has them, and what reads them.
INPUTS = typeof(stack([], []))
EVALUATE = types.void(INPUTS, VECTOR, types.float64, types.float64, types.int64, VECTOR)
_call_evaluate = calling(EVALUATE)


def states_at(pieces, times, states):
    """Write the states (m, n) at times (m,)."""
    t, x, points = pieces
    for i in range(len(times)):
        p = piece_of(t, times[i])
        state_within(x[p], points, part_of(t, p, times[i]), states[i])


def work_for(states: int, quantities: int, channels: int) -> tuple[NDArray[Any], ...]:
    """What `extremes` works on: see there."""
    return (
        *(np.zeros(max(1, channels)), np.zeros(quantities), np.zeros(states)),
        *(np.zeros((4, quantities)), np.zeros(3), np.zeros((3, 2), dtype=np.int64)),
        *(np.full((2, 2, quantities), -np.inf), np.full((2, 2, quantities, 2), -1, dtype=np.int64)),
    )


def extremes(source, pieces, work, stride, start, end, best):
    """Better the extremes, best (n_quantities, 4), by those of pieces between two times; every stride-th point is seen.

    A quantity is sought on the pieces beside the point where its value was greatest, and beside the one where a
    parabola through three points says that it is greatest; the same for the least. work: rows, times and places of the
    last points; seen (2, 2, n_quantities): by value or by parabola, of the least and of the greatest, as heights;
    where.
    """
    t, x, points = pieces
    degree, quantities = x.shape[1] - 1, len(best)
    u, y, moment, rows, times, places, seen, where = work
    room, count = (u, y, moment), 0
    for p in range(len(t)):
        if not overlaps(t, p, start, end):
            continue
        length, before = t[p, degree] - t[p, 0], -1.0
        for j in range(0, degree + 1, stride):
            theta = within(t, p, points[j], start, end)
            time = time_of(t, p, theta)
            side, state = side_of(t[p, 0], length, theta), room[2]
            if theta == before or (j == 0 and count > 0 and goes_on(source, time, side, x[p, 0], rows[2], room)):
                continue
            before = theta
            state_within(x[p], points, theta, state)
            observe(source, time, side, state, rows[3], room)
            for k in range(3):
                for q in range(quantities):
                    rows[k, q] = rows[k + 1, q]
            times[0], times[1], times[2] = times[1], times[2], time
            for k in range(2):
                places[0, k], places[1, k] = places[1, k], places[2, k]
            places[2, 0], places[2, 1] = p, j
            count = 1 if j == 0 else count + 1
            for s in range(2):
                take_all(seen, where, s, rows, times, places, count)
    for q in range(quantities):
        reach = NEAR * (seen[0, 0, q] + seen[0, 1, q])  # of what the quantity ranges over
        for s in range(2):
            for way in range(2):
                place, sign, known = where[way, s, q], 2.0 * s - 1.0, (2.0 * s - 1.0) * best[q, 2 * s]
                hopeless = seen[way, s, q] + reach < known or (reach == 0.0 and seen[way, s, q] == known)
                if place[0] >= 0 and not hopeless:
                    climb_beside(source, pieces, place, stride, start, end, q, sign, best, rows[0], room)


@compiled(**LEAN)
def overlaps(t, p, start, end):
    """Whether there is a piece p, and it has times between two."""
    return 0 <= p < len(t) and t[p, t.shape[1] - 1] >= start and t[p, 0] <= end


@compiled(**LEAN)
def within(t, p, theta, start, end):
    """A part of piece p, or the part nearest to it that lies between two times."""
    if t[p, 0] < start:
        theta = max(theta, part_of(t, p, start))
    return min(theta, part_of(t, p, end)) if t[p, t.shape[1] - 1] > end else theta


@compiled(**LEAN)
def time_of(t, p, theta):
    """The time at a part of piece p."""
    last = t.shape[1] - 1
    return t[p, 0] + theta * (t[p, last] - t[p, 0]) if theta < 1.0 else t[p, last]


@compiled(**LEAN)
def observe(source, t, side, state, row, room):
    """Write the row of a moment, inputs as on the side of another."""
    kernel, read, table, reader, c = source
    u, y, _ = room
    n, channels = len(state), len(table.first)
    outputs = len(row) - n - channels
    _call_evaluate(read, (table, reader, t, side, channels, u))
    if kernel != 0:
        call_kernel(kernel, t, state, u, c, y)
    for i in range(n):
        row[i] = state[i]
    for i in range(outputs):
        row[n + i] = y[i]
    for i in range(channels):
        row[n + outputs + i] = u[i]


@compiled(**LEAN)
def goes_on(source, t, side, state, row, room):
    """Whether states and inputs where a piece begins are those of a row, where the one before ended."""
    _, read, table, reader, _ = source
    u, n, channels = room[0], len(state), len(table.first)
    _call_evaluate(read, (table, reader, t, side, channels, u))
    for i in range(n):
        if row[i] != state[i]:
            return False
    changed = False
    for i in range(channels):
        changed |= row[len(row) - channels + i] != u[i]
    return not changed


@compiled(**LEAN)
def take_all(seen, where, s, rows, times, places, count):
    """Take note where the last row is the least, s = 0, or the greatest, or the parabola through the last three."""
    sign = 2.0 * s - 1.0
    for q in range(rows.shape[1]):
        take(seen[0, s], where[0, s], q, sign * rows[2, q], places[2])
        if count >= 3:
            value = top(times, sign * rows[0, q], sign * rows[1, q], sign * rows[2, q])
            take(seen[1, s], where[1, s], q, value, places[1])


@compiled(**LEAN)
def take(seen, where, q, height, place):
    """Take a height for the greatest one of a quantity if it is."""
    if seen[q] < height < np.inf:
        seen[q] = height
        where[q, 0], where[q, 1] = place[0], place[1]


@compiled(**LEAN)
def top(times, before, at, after):
    """The greatest value of the parabola through three values, the middle one being the greatest; else -infinity."""
    if not before <= at >= after:
        return -np.inf
    left, right = times[0] - times[1], times[2] - times[1]
    slope_left, slope_right = (before - at) / left, (after - at) / right
    bend = (slope_right - slope_left) / (right - left)
    slope = slope_left - bend * left
    return at - slope * slope / (4.0 * bend) if bend < 0.0 else at


@compiled(**LEAN)
def climb_beside(source, pieces, place, stride, start, end, q, sign, best, row, room):
    """Search the greatest sign * quantity q on both sides of a point, up to the next ones."""
    t, _, points = pieces
    degree = len(points) - 1
    for way in (-1, 1):
        p, j = place[0], place[1]
        if j == (0 if way < 0 else degree) and overlaps(t, p + way, start, end):
            p, j = p + way, degree - j
        near = within(t, p, points[j], start, end)
        far = within(t, p, points[min(degree, max(0, j + way * stride))], start, end)
        climb(source, pieces, p, min(near, far), max(near, far), q, sign, best, row, room)


@compiled(**LEAN)
def climb(source, pieces, p, low, high, q, sign, best, row, room):
    """Search the greatest sign * quantity q between two parts of piece p, and there, by golden section."""
    height(source, pieces, p, low, q, sign, best, row, room)
    height(source, pieces, p, high, q, sign, best, row, room)
    a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_a = height(source, pieces, p, a, q, sign, best, row, room)
    at_b = height(source, pieces, p, b, q, sign, best, row, room)
    for _ in range(SEARCHES):
        if at_a >= at_b:
            high, b, at_b = b, a, at_a
            a = high - GOLDEN * (high - low)
            at_a = height(source, pieces, p, a, q, sign, best, row, room)
        else:
            low, a, at_a = a, b, at_b
            b = low + GOLDEN * (high - low)
            at_b = height(source, pieces, p, b, q, sign, best, row, room)


@compiled(**LEAN)
def height(source, pieces, p, theta, q, sign, best, row, room):
    """Sign * quantity q at part theta of piece p, which betters its extreme where it is greater."""
    t, x, points = pieces
    time, state = time_of(t, p, theta), room[2]
    state_within(x[p], points, theta, state)
    observe(source, time, side_of(t[p, 0], t[p, len(points) - 1] - t[p, 0], theta), state, row, room)
    column = GREATEST if sign > 0.0 else LEAST
    if np.isfinite(row[q]) and not sign * row[q] <= sign * best[q, column]:
        best[q, column], best[q, column + 1] = row[q], time
    return sign * row[q]
