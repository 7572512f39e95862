"""What follows every accepted step, in compiled code: events sought on its dense output, and points saved.

Each of these is compiled once, for all methods, which call it by its address in their space, see `functions`.
"""

from numba import from_dtype, types

from qddot.runner.frame.log import LOG, next_wanted, save, save_event, take_wanted
from qddot.runner.frame.search import (
    NONE,
    WATCH,
    event_values,
    find_crossings,
    go_on,
    sample_part,
    watch_start,
    well_sampled,
)
from qddot.runner.frame.space import SPACE, common, look_up, prepare, state_within
from qddot.runner.frame.turns import point
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, floats, integers
from qddot.runner.machine.pointers import calling

_RECORDS = (SPACE, from_dtype(LOG), from_dtype(WATCH))
AT_START = types.boolean(*_RECORDS, types.float64, types.boolean)
WALK = types.float64(*_RECORDS, types.float64, types.float64)
FINISH = types.float64(*_RECORDS, types.float64, types.float64, types.float64, types.int64)
_call_at_start, call_walk, _call_finish = map(calling, (AT_START, WALK, FINISH))


@compiled(**LEAN)
def events_at_start(space, log, watch, t, first):
    """Values where inputs may have jumped, these being set; record what the jump caused; whether one was terminal."""
    return watch.count > 0 and _call_at_start(space.at_start, (common(space), log, watch, t, first))


@compiled(**LEAN)
def follow_step(space, log, watch, t, h, where):
    """Record the events of a step; returns theta of a terminal one, or NONE.

    The step goes from t over h to the state at the address `where`.
    """
    look_up(space, t, h, 1.0)
    event_values(space, watch, t + h, where, watch.after)
    return call_walk(space.walk, (space, log, watch, t, h))


@compiled(**LEAN)
def finish_step(space, log, watch, t, h, end, where):
    """Record the events of a step and save its points; returns theta of a terminal event, or NONE.

    The step goes from t over h to `end`, which is t + h to rounding; its new state is at the address `where`. A
    terminal event ends it; the state there is not saved here, as the last of a run is saved anyway.
    """
    if watch.count == 0 and log.refine == 0 and next_wanted(log) > end:
        return NONE
    return _call_finish(space.finish, (common(space), log, watch, t, h, end, where))


@compiled(**BY_ADDRESS)
def at_start(space, log, watch, t, first):
    """`events_at_start` where there are events to watch for."""
    watch_start(space, watch, t, state_within(space, 0.0), first)
    return watch.found > 0 and record_events(space, log, watch, t, 0.0) != NONE


@compiled(**BY_ADDRESS)
def walk(space, log, watch, t, h):
    """Record the events of a step, `after` being known; returns theta of a terminal one, or NONE.

    It is followed in one part, or, where the polynomials through the functions do not stand for them, in halves, and
    halves of these. Of switching functions nothing is recorded, and the first crossing ends it: all of the part in
    which that lies are known then.
    """
    prepare(space)
    start, width, ended = 0.0, 1.0, NONE
    while start < 1.0 and ended == NONE:
        sample_part(space, watch, t, h, start, width)
        if width > watch.shortest and not well_sampled(watch):
            width *= 0.5
        else:
            find_crossings(space, watch, t, h, start, width)
            if watch.turning == 0:
                ended = record_events(space, log, watch, t, h)
            elif watch.found > 0:
                ended = floats(watch.theta, watch.most)[0]
            go_on(watch)
            start += width
            while width < 1.0 and start % (2.0 * width) == 0.0:
                width *= 2.0
    return ended


@compiled(**BY_ADDRESS)
def finish(space, log, watch, t, h, end, where):
    """`finish_step`."""
    ended = follow_step(space, log, watch, t, h, where) if watch.count > 0 else NONE
    last = end if ended == NONE else t + ended * h
    if log.refine > 1 or next_wanted(log) < last:
        prepare(space)
        save_within(space, log, t, h, last)
    if ended == NONE and (take_wanted(log, end) or log.refine > 0):
        save(log, end, where)
    return ended


@compiled(**LEAN)
def record_events(space, log, watch, t, h):
    """Record the crossings that were found; returns theta of a terminal one, which is the last, or NONE."""
    thetas, events = floats(watch.theta, watch.most), integers(watch.event, watch.most)
    left = integers(watch.left, watch.count)
    for k in range(watch.found):
        theta, i = thetas[k], events[k]
        save_event(log, t + theta * h, i, state_within(space, theta))
        left[i] -= 1
        if left[i] == 0:
            return theta
    return NONE


@compiled(**LEAN)
def save_within(space, log, t, h, end):
    """Save what is wanted strictly before `end` of the step of length h from t."""
    if log.starts:
        save(log, t, state_within(space, 0.0))
    for j in range(1, log.refine):
        part = point(j, log.refine) if log.starts else j / log.refine
        if log.starts or t + part * h < end:
            save(log, t + part * h, state_within(space, part))
    while next_wanted(log) < end:
        save(log, next_wanted(log), state_within(space, (next_wanted(log) - t) / h))
        log.next_wanted += 1
