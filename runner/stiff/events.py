"""Events of stiff methods: those of `events`, located on the polynomial of the step."""

from qddot.runner.events.search import NONE, bisect, earliest, event_value, mark_crossed, watch_start
from qddot.runner.inputs.instants import side_of
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN, floats, integers
from qddot.runner.stiff.space import WITHIN, X_NEW, X, vectors
from qddot.runner.stiff.system import evaluate_polynomial, set_inputs


@compiled(**INLINE)
def watch_segment(space, s, v, points, watch):
    """Values at the start of a segment, with the inputs last set; record what a jump caused; True if it is terminal."""
    if watch_start(space, watch, s.t, X, s.steps == 0) == 0:
        return False
    return record_all(space, s, v, points, watch) != NONE


@compiled(**INLINE)
def watch_step(space, s, watch):
    """Write the values at the end of a step and mark its events; returns how many."""
    set_inputs(space, s.t_new, side_of(s.t, s.length, 1.0))
    return mark_crossed(space, watch, s.t_new, X_NEW)


@compiled(**INLINE)
def finish_events(space, s, v, points, watch, happened):
    """Locate the marked events on the polynomial of the step, record them; a terminal one becomes the step's end."""
    if happened > 0:
        bisect(space, watch, s.t, s.length, value_within, s)
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


@compiled(**LEAN)
def value_within(i, space, watch, s, theta):
    """The function of event i at part theta of the step."""
    t = s.t + theta * s.length
    evaluate_polynomial(vectors(space), theta)
    set_inputs(space, t, t)
    return event_value(i, space, watch, t, WITHIN)


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
