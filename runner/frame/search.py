"""The compiled half of `events`: has a value crossed zero in a step, and where on the dense output did it.

States are addresses, and a method's dense output is a function of it, see `step_end`.
"""

import numpy as np

from qddot.runner.frame.space import constants, input_values, look_up
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
def event_value(i, space, watch, t, where):
    """The function of event i at time t, its state at an address, inputs as they stand in u."""
    kind, place = integers(watch.kind, watch.count)[i], integers(watch.place, watch.count)[i]
    x, u, c = floats(where, space.n), input_values(space), constants(space)
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
def watch_end(space, watch, t, h, where):
    """Write the values at the end of a step from t to t + h, its state at an address; mark what crossed.

    Events that happened in the step have theta 1 from then on; returns how many.
    """
    look_up(space, t, h, 1.0)
    happened = 0
    before, after = floats(watch.before, watch.count), floats(watch.after, watch.count)
    theta, direction = floats(watch.theta, watch.count), integers(watch.direction, watch.count)
    for i in range(watch.count):
        after[i] = event_value(i, space, watch, t + h, where)
        theta[i] = 1.0 if crossed(before[i], after[i], direction[i]) else NONE
        happened += theta[i] != NONE
    return happened


@compiled(**LEAN)
def watch_start(space, watch, t, where, first):
    """Write the values at a (re)start, the inputs being set; marks events that a jump caused with theta 0: how many."""
    happened = 0
    before, theta = floats(watch.before, watch.count), floats(watch.theta, watch.count)
    direction = integers(watch.direction, watch.count)
    for i in range(watch.count):
        value = event_value(i, space, watch, t, where)
        jumped = not first and crossed(before[i], value, direction[i])
        theta[i] = 0.0 if jumped else NONE
        happened += jumped
        before[i] = value
    return happened


@compiled(**INLINE)
def bisect(space, step, watch, t, h, state_within):
    """Find theta of the marked events in the step from t to t + h, to the resolution of time, on the crossed side."""
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
            where = state_within(space, step, middle)
            look_up(space, t, h, middle)
            value = event_value(i, space, watch, t + middle * h, where)
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
def take_over_values(watch):
    """The end of this step is the start of the next."""
    before, after = floats(watch.before, watch.count), floats(watch.after, watch.count)
    for i in range(watch.count):
        before[i] = after[i]
