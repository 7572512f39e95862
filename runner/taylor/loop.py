"""The compiled loop of Taylor's method: a series, a step as long as its last terms allow, the states at its end.

A step ends where an input's piece ends, since the series beyond is another one, and where a condition changes its side.
"""

from qddot.runner.frame.log import has_room, next_stop
from qddot.runner.frame.search import NONE
from qddot.runner.frame.space import project, row_address, set_inputs, states
from qddot.runner.frame.step_end import events_at_start, finish_step
from qddot.runner.inputs.instants import after, rounding
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN
from qddot.runner.machine.series_calls import call_series
from qddot.runner.problem import Status
from qddot.runner.taylor.inputs import pieces_end, write_inputs
from qddot.runner.taylor.reach import reach
from qddot.runner.taylor.sides import NOTHING, choose_sides, first_to_leave, turn
from qddot.runner.taylor.space import NEW, WITHIN, advance, coefficient
from qddot.runner.taylor.space import time_and_sense as memory_head
from qddot.runner.taylor.step import largest, rank, step_size, worst_state

RUNNING, FINISHED, TERMINATED = int(Status.RUNNING), int(Status.FINISHED), int(Status.TERMINATED)
NON_FINITE, STEP_UNDERFLOW = int(Status.NON_FINITE), int(Status.STEP_UNDERFLOW)
TOO_MANY_STEPS = int(Status.TOO_MANY_STEPS)


@compiled(**LEAN)
def look_around(space, course, stop):
    """The series of the inputs about the time of the state."""
    t = course.now
    head = memory_head(space)
    head[1] = head[0] * t
    if space.n_inputs > 0:
        set_inputs(space, t, after(t, stop - t))
        write_inputs(space, t)


@compiled(**LEAN)
def take_step(space, course, log):
    """The series, and the step that it allows; leaves its end in row NEW; returns a status."""
    t, stop = course.now, next_stop(log)
    look_around(space, course, stop)
    if course.restart and space.n_sides > 0:
        choose_sides(space)
    turned = 0
    while True:
        call_series(space.series, space.memory, space.highest)
        course.evaluations += 1
        h, least = step_size(space, course.rtol, course.decay), rounding(t)
        if not (h >= least and h > 0.0):
            course.failed_state = worst_state(space, space.highest)
            return STEP_UNDERFLOW if h > 0.0 else NON_FINITE
        h = min(h, course.max_step)
        if course.steps == 0:
            h = min(h, course.longest_first)
            h = min(h, course.first_step) if course.first_step > 0.0 else h
        end = min(stop, max(pieces_end(space), t + least))
        landing = h >= end - t
        h = end - t if landing else h
        leaving, when = first_to_leave(space, h) if space.n_sides > 0 else (-1, h)
        if leaving < 0 or when > max(least, NOTHING * h):
            break
        turn(space, leaving)
        turned += 1
        if turned > 2 * space.n_sides + 2:
            course.failed_state = worst_state(space, 1)
            return STEP_UNDERFLOW
    if leaving >= 0:
        landing, h = landing and when >= h, when
    reached = reach(space, t, h, least)
    if reached == 0.0:
        course.failed_state = worst_state(space, space.highest)
        return STEP_UNDERFLOW
    if reached < h:
        landing, h = False, reached
    elif leaving >= 0:
        turn_after(space, course, leaving)
    course.start, course.length = t, h
    course.now = end if landing else t + h
    course.restart = landing and end == stop
    return check_end(space, course)


@compiled(**LEAN)
def turn_after(space, course, i):
    """Remember that condition i changes its side at the end of this step."""
    course.turned = i + 1


@compiled(**LEAN)
def check_end(space, course):
    """NON_FINITE where a state at the end of the step is no number, or beyond the limit."""
    new, limit = states(space, NEW), rank(course.limit)
    if largest(new, space.n) <= limit:
        return RUNNING
    i = 0
    while rank(new[i]) <= limit:
        i += 1
    course.failed_state = i
    return NON_FINITE


@compiled(**INLINE)
def complete_step(space, course, log, ended):
    """Make the end of the step, or of the part of it that a terminal event ended, the state; returns a status."""
    course.steps += 1
    row, status = NEW, RUNNING
    if ended != NONE:
        advance(space, course.start, ended * course.length, WITHIN)
        course.now = course.start + ended * course.length
        row, status = WITHIN, TERMINATED
    elif course.restart:
        log.stop += 1
        if log.stop == log.n_stops:
            status = FINISHED
    if status == RUNNING and course.max_steps > 0 and course.steps >= course.max_steps:
        status = TOO_MANY_STEPS
    if course.turned > 0:
        turn(space, course.turned - 1)
        course.turned = 0
    source, target = states(space, row), coefficient(space, 0)
    for i in range(space.n):
        target[i] = source[i]
    return status


def run_slice(space, course, log, watch, most_steps):
    """At most `most_steps` steps; returns a status. RUNNING also where there is no room for what another step saves."""
    for _ in range(most_steps):
        if not has_room(log, watch.most):
            return RUNNING
        if course.restart:
            t = course.now
            set_inputs(space, t, after(t, next_stop(log) - t))
            if space.project != 0:
                project(space, t, space.states_at)
            if events_at_start(space, log, watch, t, course.steps == 0):
                return TERMINATED
        status = take_step(space, course, log)
        if status != RUNNING:
            return status
        ended = finish_step(space, log, watch, course.start, course.length, course.now, row_address(space, NEW))
        status = complete_step(space, course, log, ended)
        if status != RUNNING:
            return status
    return RUNNING
