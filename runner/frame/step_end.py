"""What follows every accepted step, in compiled code: events sought on its dense output, and points saved.

A method is a `step`, whatever that is (see `finish_step`), and functions of it: follow(space, step, log, watch, t, h)
is `walk` with the other two, compiled once for a method. These are compiled with the caller: prepare(space, step)
writes what dense output needs beyond the step itself; it may be called twice. state_within(space, step, theta) returns
the address of the state at part theta of the step, 0 to 1; at 0 without any preparation.
"""

from qddot.runner.frame.log import next_wanted, save, save_event, take_wanted
from qddot.runner.frame.search import (
    NONE,
    event_values,
    find_crossings,
    go_on,
    sample_part,
    watch_start,
    well_sampled,
)
from qddot.runner.frame.space import look_up
from qddot.runner.frame.turns import point
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, floats, integers


@compiled(**INLINE)
def events_at_start(space, step, log, watch, t, first, state_within):
    """Values where inputs may have jumped, these being set; record what the jump caused; whether one was terminal."""
    if watch.count == 0:
        return False
    watch_start(space, watch, t, state_within(space, step, 0.0), first)
    return watch.found > 0 and record_events(space, step, log, watch, t, 0.0, state_within) != NONE


@compiled(**INLINE)
def record_events(space, step, log, watch, t, h, state_within):
    """Record the crossings that were found; returns theta of a terminal one, which is the last, or NONE."""
    thetas, events = floats(watch.theta, watch.most), integers(watch.event, watch.most)
    left = integers(watch.left, watch.count)
    for k in range(watch.found):
        theta, i = thetas[k], events[k]
        save_event(log, t + theta * h, i, state_within(space, step, theta))
        left[i] -= 1
        if left[i] == 0:
            return theta
    return NONE


@compiled(**INLINE)
def follow_step(space, step, log, watch, t, h, where, follow):
    """Record the events of a step; returns theta of a terminal one, or NONE.

    The step goes from t over h to the state at the address `where`.
    """
    look_up(space, t, h, 1.0)
    event_values(space, watch, t + h, where, watch.after)
    return follow(space, step, log, watch, t, h)


@compiled(**INLINE)
def walk(space, step, log, watch, t, h, prepare, state_within):
    """Record the events of a step, `after` being known; returns theta of a terminal one, or NONE.

    It is followed in one part, or, where the polynomials through the functions do not stand for them, in halves, and
    halves of these. Of switching functions nothing is recorded, and the first crossing ends it: all of the part in
    which that lies are known then.
    """
    prepare(space, step)
    start, width, ended = 0.0, 1.0, NONE
    while start < 1.0 and ended == NONE:
        sample_part(space, step, watch, t, h, start, width, state_within)
        if width > watch.shortest and not well_sampled(watch):
            width *= 0.5
        else:
            find_crossings(space, step, watch, t, h, start, width, state_within)
            if watch.turning == 0:
                ended = record_events(space, step, log, watch, t, h, state_within)
            elif watch.found > 0:
                ended = floats(watch.theta, watch.most)[0]
            go_on(watch)
            start += width
            while width < 1.0 and start % (2.0 * width) == 0.0:
                width *= 2.0
    return ended


@compiled(**INLINE)
def save_within(space, step, log, t, h, end, state_within):
    """Save what is wanted strictly before `end` of the step of length h from t."""
    if log.starts:
        save(log, t, state_within(space, step, 0.0))
    for j in range(1, log.refine):
        part = point(j, log.refine) if log.starts else j / log.refine
        if log.starts or t + part * h < end:
            save(log, t + part * h, state_within(space, step, part))
    while next_wanted(log) < end:
        save(log, next_wanted(log), state_within(space, step, (next_wanted(log) - t) / h))
        log.next_wanted += 1


@compiled(**INLINE)
def finish_step(space, step, log, watch, t, h, end, where, follow, prepare, state_within):
    """Record the events of a step and save its points; returns theta of a terminal event, or NONE.

    The step goes from t over h to `end`, which is t + h to rounding; its new state is at the address `where`. A
    terminal event ends it; the state there is not saved here, as the last of a run is saved anyway.
    """
    ended = NONE
    if watch.count > 0:
        ended = follow_step(space, step, log, watch, t, h, where, follow)
    last = end if ended == NONE else t + ended * h
    if log.refine > 1 or next_wanted(log) < last:
        prepare(space, step)
        save_within(space, step, log, t, h, last, state_within)
    if ended == NONE and (take_wanted(log, end) or log.refine > 0):
        save(log, end, where)
    return ended
