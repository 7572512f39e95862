"""The compiled half of `events`: has a value crossed zero in a step, and where on the dense output did it."""

import numpy as np

from qddot.runner.explicit.slopes import constants, input_values, look_up
from qddot.runner.explicit.step import interpolate
from qddot.runner.explicit.workspace import NEW, WITHIN, states
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN, floats, integers, layout
from qddot.runner.machine.pointers import call_event, call_kernel

FUNCTION, OUTPUT, STATE = range(3)
#: theta of an event that did not happen in the step.
NONE = 2.0


#: Fields of what is known of `count` events: addresses; outputs: the kernel, y (n_outputs,) room for what it writes.
#: kind, place, direction, terminal, level as in `events`, the place of a function being its address; before, after:
#: values at the ends of the step; theta: where in the step the event lies, 0 to 1, or NONE.
WATCH = layout("count outputs n_outputs kind place direction terminal level before after theta y")


@compiled(**LEAN)
def event_value(i, space, watch, t, row):
    """The function of event i at time t, state in a row, inputs as they stand in u."""
    kind, place = integers(watch.kind, watch.count)[i], integers(watch.place, watch.count)[i]
    x, u, c = states(space, row), input_values(space), constants(space)
    if kind == FUNCTION:
        return call_event(place, t, x, u, c)
    level = floats(watch.level, watch.count)[i]
    if kind == OUTPUT:
        y = floats(watch.y, watch.n_outputs)
        call_kernel(watch.outputs, t, x, u, c, y)
        return y[place] - level
    return x[place] - level


@compiled(**LEAN)
def crossed(before, after, direction):
    """Whether a value went through zero in this direction (0: in either)."""
    return (direction >= 0 and before < 0.0 <= after) or (direction <= 0 and before > 0.0 >= after)


@compiled(**LEAN)
def mark_crossed(space, watch, t, row):
    """Write the values at the end of a step, whose state stands in a row and whose inputs in u; mark what crossed.

    Events that happened in the step have theta 1 from then on; returns how many.
    """
    happened = 0
    before, after = floats(watch.before, watch.count), floats(watch.after, watch.count)
    theta, direction = floats(watch.theta, watch.count), integers(watch.direction, watch.count)
    for i in range(watch.count):
        after[i] = event_value(i, space, watch, t, row)
        theta[i] = 1.0 if crossed(before[i], after[i], direction[i]) else NONE
        happened += theta[i] != NONE
    return happened


@compiled(**LEAN)
def watch_start(space, watch, t, row, first):
    """Write the values at a (re)start; marks events that an input's jump caused with theta 0; returns how many."""
    happened = 0
    before, theta = floats(watch.before, watch.count), floats(watch.theta, watch.count)
    direction = integers(watch.direction, watch.count)
    for i in range(watch.count):
        value = event_value(i, space, watch, t, row)
        jumped = not first and crossed(before[i], value, direction[i])
        theta[i] = 0.0 if jumped else NONE
        happened += jumped
        before[i] = value
    return happened


@compiled(**INLINE)
def bisect(space, watch, t, h, value_within, step):
    """Find theta of the marked events in the step from t to t + h, to the resolution of time; the crossed side of it.

    value_within(i, space, watch, step, theta): the function of event i at part theta of the step, whatever a step is.
    """
    before, theta = floats(watch.before, watch.count), floats(watch.theta, watch.count)
    resolution = max(2.0 * np.spacing(abs(t) + abs(h)) / abs(h), 1e-16)
    for i in range(watch.count):
        if theta[i] == NONE:
            continue
        low, high = 0.0, 1.0
        while high - low > resolution:
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
            value = value_within(i, space, watch, step, middle)
            if (value >= 0.0) if before[i] < 0.0 else (value <= 0.0):
                high = middle
            else:
                low = middle
        theta[i] = high


@compiled(**LEAN)
def earliest(watch):
    """The marked event with the least theta, -1 where none is left."""
    theta = floats(watch.theta, watch.count)
    found = -1
    for i in range(watch.count):
        if theta[i] != NONE and (found < 0 or theta[i] < theta[found]):
            found = i
    return found


@compiled(**LEAN)
def watch_step(space, watch, t, h):
    """For explicit methods: write the values at the end of a step and mark its events; returns how many."""
    look_up(space, t, h, 1.0)
    return mark_crossed(space, watch, t + h, NEW)


@compiled(**LEAN)
def locate(space, pair, watch, t, h):
    """For explicit methods: find theta of the marked events on the dense output."""
    bisect(space, watch, t, h, _value_within, (pair, t, h))


@compiled(**LEAN)
def _value_within(i, space, watch, step, theta):
    pair, t, h = step
    interpolate(space, pair, theta, h)
    look_up(space, t, h, theta)
    return event_value(i, space, watch, t + theta * h, WITHIN)
