"""The compiled half of `events`: where in a step does a function cross zero, once or several times.

A function is evaluated at Chebyshev's points of the step's dense output and where the polynomial through these values
turns (see `turns`); between two of these points that differ in sign it crosses. For a state the polynomial is the dense
output itself; where it does not stand for another function, the step is followed in halves. States are addresses.
"""

import numpy as np

from qddot.runner.frame.space import constants, input_values, look_up, state_within
from qddot.runner.frame.turns import keeps_sign, stands_for, turning_points
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, integers, layout
from qddot.runner.machine.pointers import call_event, call_kernel

FUNCTION, OUTPUT, STATE, ACTING = range(4)
#: theta of an event that did not happen in the step.
NONE = 2.0


#: Fields of what is known of `count` events: addresses; outputs: the kernel, y (n_outputs,) room for what it writes;
#: acting: that of the model's own events, with room acting_values (n_acting,).
#: kind, place, direction, level as in `events`, the place of a function being its address; terminal: crossings that
#: end the run, 0 where none does, left: those to come. degree: of the polynomial that follows a function; whole: not 0
#: where those of states are the dense output; points, basis, tail: what `turns` has of this degree; most: events of a
#: step, at most; shortest: part of the step that it is followed in, at least. before (count,): values where the step,
#: or what is left of it, starts; after: where it ends; values (degree + 1, count); coefficients, turns, stack: room.
#: theta, event (found,): crossings, rising, theta from 0 to 1.
#: Of switching functions, see `hold`: turning (count,): not 0 where a condition changes its side when the next step
#: begins, address 0 of all else; turned: whether one does; looks: room; changes: of sides without progress; free:
#: whether all are for a step. flags, part, pull, slopes, bound, rest as in `slide`; sliding: how many do; rhs, by_item,
#: jacobian_kernel, functions: what the space, or this, has where none does; slide, watch_slide: where some do.
#: counted: changes of sides since that time, of the run from its start, which has started; released: when all
#: conditions were free last because a branch had no values.
WATCH = layout(
    "count outputs n_outputs kind place direction terminal left level degree whole points basis tail most before after "
    "values coefficients turns stack theta event found y acting n_acting acting_values "
    "turning looks turned changes free flags part pull slopes bound rest sliding "
    "rhs by_item jacobian_kernel functions slide watch_slide counted started",
    "shortest since start released",
)


@compiled(**LEAN)
def write_outputs(space, watch, t, where):
    """Let y be the outputs, and the model's events be known, at time t, the state at an address, inputs as in u."""
    x, u, c = floats(where, space.n), input_values(space), constants(space)
    if watch.outputs != 0:
        call_kernel(watch.outputs, t, x, u, c, floats(watch.y, watch.n_outputs))
    if watch.acting != 0:
        call_kernel(watch.acting, t, x, u, c, floats(watch.acting_values, watch.n_acting))


@compiled(**LEAN)
def value_of(i, space, watch, t, where):
    """The function of event i at time t, its state at an address, inputs as they stand in u, outputs in y."""
    kind, place = integers(watch.kind, watch.count)[i], integers(watch.place, watch.count)[i]
    if kind == FUNCTION:
        return call_event(place, t, floats(where, space.n), input_values(space), constants(space))
    if kind == ACTING:
        return floats(watch.acting_values, watch.n_acting)[place]
    value = floats(watch.y, watch.n_outputs)[place] if kind == OUTPUT else floats(where, space.n)[place]
    return value - floats(watch.level, watch.count)[i]


@compiled(**LEAN)
def event_value(i, space, watch, t, where):
    """`value_of` where the outputs are still to be computed."""
    kind = integers(watch.kind, watch.count)[i]
    if kind in (OUTPUT, ACTING):
        write_outputs(space, watch, t, where)
    return value_of(i, space, watch, t, where)


@compiled(**LEAN)
def event_values(space, watch, t, where, target):
    """Write the functions of all events at time t, its state and the target (count,) at addresses."""
    if watch.outputs != 0 or watch.acting != 0:
        write_outputs(space, watch, t, where)
    values = floats(target, watch.count)
    for i in range(watch.count):
        values[i] = value_of(i, space, watch, t, where)


@compiled(**LEAN)
def crossed(before, after, direction):
    """Whether a value went through zero in this direction (0: in either)."""
    return (direction >= 0 and before < 0.0 <= after) or (direction <= 0 and before > 0.0 >= after)


@compiled(**LEAN)
def note(watch, theta, i):
    """Put down a crossing of event i, in order of time, and of the events where they are at one time."""
    place, thetas, events = watch.found, floats(watch.theta, watch.most), integers(watch.event, watch.most)
    while place > 0 and thetas[place - 1] > theta:
        thetas[place], events[place] = thetas[place - 1], events[place - 1]
        place -= 1
    thetas[place], events[place] = theta, i
    watch.found += 1


@compiled(**LEAN)
def watch_start(space, watch, t, where, first):
    """Write the values at a (re)start, the inputs being set; notes events that a jump caused, unless at the first."""
    event_values(space, watch, t, where, watch.after)
    before, after = floats(watch.before, watch.count), floats(watch.after, watch.count)
    left, terminal = integers(watch.left, watch.count), integers(watch.terminal, watch.count)
    watch.found = 0
    for i in range(watch.count):
        if first:
            left[i] = terminal[i]
        if not first and crossed(before[i], after[i], integers(watch.direction, watch.count)[i]):
            note(watch, 0.0, i)
        before[i] = after[i]


@compiled(**LEAN)
def sample_part(space, watch, t, h, start, width):
    """Write the values at the points of a part of the step from t to t + h, the first and the step's last known."""
    count, points = watch.count, floats(watch.points, watch.degree + 1)
    values, before = floats(watch.values, count * (watch.degree + 1)), floats(watch.before, count)
    after = floats(watch.after, count)
    for i in range(count):
        values[i] = before[i]
    for j in range(1, watch.degree + 1):
        theta = start + width * points[j]
        if theta < 1.0:
            where = state_within(space, theta)
            look_up(space, t, h, theta)
            event_values(space, watch, t + theta * h, where, watch.values + 8 * count * j)
        else:
            for i in range(count):
                values[count * j + i] = after[i]


@compiled(**LEAN)
def well_sampled(watch):
    """Whether the polynomials through the values stand for all functions; those of states may be the dense output."""
    values, degree = floats(watch.values, watch.count * (watch.degree + 1)), watch.degree
    for i in range(watch.count):
        known = watch.whole and integers(watch.kind, watch.count)[i] == STATE
        if not known and not stands_for(values, i, watch.count, watch.tail, degree):
            return False
    return True


@compiled(**LEAN)
def turns_of(watch, i):
    """Write where the polynomial of event i turns; returns how often, -1 where it keeps its sign."""
    degree = watch.degree
    values, c = floats(watch.values, watch.count * (degree + 1)), floats(watch.coefficients, degree + 1)
    basis = floats(watch.basis, (degree + 1) * (degree + 1))
    for k in range(degree + 1):
        c[k] = 0.0
        for j in range(degree + 1):
            c[k] += basis[k * (degree + 1) + j] * values[watch.count * j + i]
    if keeps_sign(c, degree + 1):
        return -1
    return turning_points(c, degree, watch.stack, floats(watch.turns, 2 * degree))


@compiled(**LEAN)
def value_within(space, watch, i, t, h, theta):
    """The function of event i at part theta of the step."""
    where = state_within(space, theta)
    look_up(space, t, h, theta)
    return event_value(i, space, watch, t + theta * h, where)


@compiled(**LEAN)
def close_in(space, watch, i, t, h, low, high, before, after):
    """Where event i crosses between parts low and high of the step, to the resolution of time, on the crossed side.

    before, after: its values there. By inverse quadratic interpolation where that is safe, else by halves (T. R.
    Chandrupatla, Advances in Engineering Software 28 (1997) 145-149).
    """
    resolution = max(2.0 * np.spacing(abs(t) + abs(h)) / abs(h), 1e-16)
    rising, a, f_a, b, f_b, part = before < 0.0, high, after, low, before, 0.5
    c, f_c = b, f_b
    while high - low > resolution:
        least = 0.5 * resolution / (high - low)
        theta = a + min(max(part, least), 1.0 - least) * (b - a)
        if not low < theta < high:
            break
        value = value_within(space, watch, i, t, h, theta)
        crossed_there = value >= 0.0 if rising else value <= 0.0
        if crossed_there:
            high = theta
        else:
            low = theta
        if (f_a >= 0.0 if rising else f_a <= 0.0) == crossed_there:
            c, f_c = a, f_a
        else:
            c, f_c, b, f_b = b, f_b, a, f_a
        a, f_a = theta, value
        part = 0.5
        xi, phi = (a - b) / (c - b), (f_a - f_b) / (f_c - f_b)
        if phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
            part = f_a / (f_b - f_a) * f_c / (f_b - f_c) + (c - a) / (b - a) * f_a / (f_c - f_a) * f_b / (f_c - f_b)
    return high


@compiled(**LEAN)
def find_crossings(space, watch, t, h, start, width):
    """Note the crossings of all events in a part of the step, whose values are there."""
    points, turns = floats(watch.points, watch.degree + 1), floats(watch.turns, 2 * watch.degree)
    values, direction = floats(watch.values, watch.count * (watch.degree + 1)), integers(watch.direction, watch.count)
    watch.found = 0
    for i in range(watch.count):
        n_turns, j, k = turns_of(watch, i), 1, 0
        low, before = start, values[i]
        while n_turns >= 0 and j <= watch.degree:
            if k < n_turns and turns[k] < points[j]:
                theta = start + width * turns[k]
                value = value_within(space, watch, i, t, h, theta)
                k += 1
            else:
                theta, value = start + width * points[j], values[watch.count * j + i]
                j += 1
            if crossed(before, value, direction[i]):
                note(watch, close_in(space, watch, i, t, h, low, theta, before, value), i)
            low, before = theta, value


@compiled(**LEAN)
def go_on(watch):
    """The end of this part of a step is the start of the next."""
    before = floats(watch.before, watch.count)
    last = floats(watch.values + 8 * watch.count * watch.degree, watch.count)
    for i in range(watch.count):
        before[i] = last[i]
