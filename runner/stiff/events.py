"""Events of stiff methods: those of `events`, located on the polynomial of the step."""

import numpy as np

from runner.compiled import compiled
from runner.events.search import NONE, crossed, earliest, event_value, watch_start
from runner.memory import LEAN, floats, integers
from runner.stiff.space import INLINE, WITHIN, X_NEW, X
from runner.stiff.system import SIDE, evaluate_polynomial, set_inputs


@compiled(**INLINE)
def watch_segment(space, s, v, points, watch):
    """Values at the start of a segment, with the inputs last set; record what a jump caused; True if it is terminal."""
    if watch_start(space, watch, s.t, space.n * X, s.steps == 0) == 0:
        return False
    return record_all(space, s, v, points, watch) != NONE


@compiled(**INLINE)
def watch_step(space, s, v, watch):
    """Write the values at the end of a step and mark the events that happened in it; returns how many."""
    happened = 0
    before, after = floats(watch.before, watch.count), floats(watch.after, watch.count)
    theta, direction = floats(watch.theta, watch.count), integers(watch.direction, watch.count)
    set_inputs(space, s.t_new, s.t_new - SIDE * s.length)
    for i in range(watch.count):
        after[i] = event_value(i, space, watch, s.t_new, space.n * X_NEW)
        theta[i] = 1.0 if crossed(before[i], after[i], direction[i]) else NONE
        happened += theta[i] != NONE
    return happened


@compiled(**INLINE)
def finish_events(space, s, v, points, watch, happened):
    """Locate the marked events on the polynomial of the step, record them; a terminal one becomes the step's end."""
    if happened > 0:
        locate(space, s, v, watch)
        theta = record_all(space, s, v, points, watch)
        if theta != NONE:
            s.terminated = True
            s.t_new = s.t + theta * s.length
            evaluate_polynomial(v, theta)
            for i in range(space.n):
                v[X_NEW, i] = v[WITHIN, i]
    before, after = floats(watch.before, watch.count), floats(watch.after, watch.count)
    for i in range(watch.count):
        before[i] = after[i]


@compiled(**INLINE)
def locate(space, s, v, watch):
    """Find theta of the marked events by bisection, to the resolution of time; the crossed side of it."""
    before, theta = floats(watch.before, watch.count), floats(watch.theta, watch.count)
    resolution = max(2.0 * np.spacing(abs(s.t) + s.length) / s.length, 1e-16)
    for i in range(watch.count):
        if theta[i] == NONE:
            continue
        low, high = 0.0, 1.0
        while high - low > resolution:
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
            t = s.t + middle * s.length
            evaluate_polynomial(v, middle)
            set_inputs(space, t, t)
            value = event_value(i, space, watch, t, space.n * WITHIN)
            if (value >= 0.0) if before[i] < 0.0 else (value <= 0.0):
                high = middle
            else:
                low = middle
        theta[i] = high


@compiled(**LEAN)
def record_all(space, s, v, points, watch):
    """Record the marked events in order of time; returns theta of a terminal one, which is the last, or NONE."""
    theta, terminal = floats(watch.theta, watch.count), integers(watch.terminal, watch.count)
    i = earliest(watch)
    while i >= 0:
        row = X
        if theta[i] > 0.0:
            evaluate_polynomial(v, theta[i])
            row = WITHIN
        floats(points.found_t, points.event_room)[s.found] = s.t + theta[i] * s.length
        integers(points.found_event, points.event_room)[s.found] = i
        x = floats(points.found_x + 8 * space.n * s.found, space.n)
        for j in range(space.n):
            x[j] = v[row, j]
        s.found += 1
        if terminal[i]:
            return theta[i]
        theta[i] = NONE
        i = earliest(watch)
    return NONE
