"""The compiled loop of the adaptive explicit methods: steps, breakpoints, saved points and events, in slices.

Between two breakpoints everything is smooth. At each, the loop restarts: the slope is taken anew with the inputs'
limits from the right, and the step size is the smaller of what was proposed before and what a first step would be.
"""

import numpy as np

from qddot.runner.events.search import NONE, locate, watch_start, watch_step
from qddot.runner.explicit.adaptive_course import ensure_dense, record_all, save, save_within
from qddot.runner.explicit.controller import (
    LEAST_LAST_ERROR,
    MATLAB,
    after_failure,
    after_success,
    combined,
    first_step,
    norm,
    scale,
)
from qddot.runner.explicit.slopes import settle, slope
from qddot.runner.explicit.step import evaluate_next_slope, interpolate, take_step
from qddot.runner.explicit.workspace import ERROR, ERROR_2, K0, NEW, SCALED, WITHIN, Y, copy, states
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats
from qddot.runner.problem import Status

RUNNING, FINISHED, TERMINATED = int(Status.RUNNING), int(Status.FINISHED), int(Status.TERMINATED)
NON_FINITE, STEP_UNDERFLOW = int(Status.NON_FINITE), int(Status.STEP_UNDERFLOW)
TOO_MANY_STEPS = int(Status.TOO_MANY_STEPS)


@compiled(**LEAN)
def largest(space):
    """Index of the largest scaled error."""
    found, size, scaled = 0, -1.0, states(space, SCALED)
    for i in range(space.n):
        if scaled[i] > size:
            found, size = i, scaled[i]
    return found


@compiled(**LEAN)
def restart(space, pair, control, course, watch):
    """Slope, inputs, event values and step size where the inputs may jump; returns a status."""
    t, first = course.now, course.steps == 0
    ahead = floats(course.stops, course.n_stops)[course.stop] - t
    course.restart = 0
    settle(space, t, ahead)
    slope(space, t, Y, K0)
    course.evaluations += 1
    copy(space, Y, NEW)
    if not norm(space, control, K0) < np.inf:
        course.failed_state = largest(space)
        return NON_FINITE
    if watch_start(space, watch, t, Y, first) > 0 and (record_all(space, pair, course, watch, t, 0.0) != NONE):
        return TERMINATED
    course.last_error = LEAST_LAST_ERROR
    if first and course.first_step > 0.0:
        course.size = course.first_step
    else:
        longest = min(course.max_step, ahead, course.longest_first)
        course.size = min(course.size, first_step(space, control, t, longest))
        course.evaluations += control.kind != MATLAB
    return RUNNING


@compiled(**LEAN)
def error_of_step(space, pair, control):
    """The scaled error of the step just tried."""
    error = norm(space, control, ERROR)
    return combined(error, norm(space, control, ERROR_2)) if pair.estimates > 1 else error


@compiled(**LEAN)
def advance_state(space, pair, control, course):
    """Try steps until one is good; leaves it in the rows and in `course`; returns a status."""
    t, stop = course.now, floats(course.stops, course.n_stops)[course.stop]
    least = 16.0 * np.spacing(abs(t))
    proposed = min(max(course.size, least), course.max_step)
    size, failures = proposed, 0
    while True:
        landing = control.stretch * size >= stop - t
        h = (stop if landing else t + size) - t
        take_step(space, pair, t, h)
        course.evaluations += pair.stages - 1
        error = error_of_step(space, pair, control)
        if error <= 1.0:
            break
        failures += 1
        course.failed_attempts += 1
        if min(size, h) <= least:
            scale(space, control, ERROR)
            course.failed_state = largest(space)
            return STEP_UNDERFLOW if error < np.inf else NON_FINITE
        size = max(least, h * after_failure(control, error, failures))
    course.size = h * after_success(control, error, course.last_error, failures > 0)
    if landing and failures == 0:
        course.size = max(course.size, proposed)
    course.last_error = error
    course.start, course.length, course.now = t, h, stop if landing else t + h
    course.steps += 1
    course.stop += landing
    course.restart, course.dense = landing, 0
    course.evaluations += evaluate_next_slope(space, pair, t, h)
    return RUNNING


@compiled(**LEAN)
def finish_at_event(space, pair, course, watch):
    """Find and record the step's events; where one is terminal the step ends there. Returns a status."""
    t, h = course.start, course.length
    if watch.count > 0 and watch_step(space, watch, t, h) > 0:
        ensure_dense(space, pair, course, t, h)
        locate(space, pair, watch, t, h)
        theta = record_all(space, pair, course, watch, t, h)
        if theta != NONE:
            course.now, course.end = t + theta * h, theta
            return TERMINATED
    before, after = floats(watch.before, watch.count), floats(watch.after, watch.count)
    for i in range(watch.count):
        before[i] = after[i]
    return RUNNING


@compiled(**LEAN)
def complete_step(space, pair, course, status):
    """Make the end of the step the present state, and save it where it is to be saved; returns a status."""
    wanted = (
        course.next_wanted < course.n_wanted
        and floats(course.wanted, course.n_wanted)[course.next_wanted] == course.now
    )
    if status == TERMINATED:
        interpolate(space, pair, course.end, course.length)
        copy(space, WITHIN, NEW)
    elif course.stop == course.n_stops:
        status = FINISHED
    elif course.max_steps > 0 and course.steps >= course.max_steps:
        status = TOO_MANY_STEPS
    copy(space, NEW, Y)
    copy(space, K0 + pair.next_slope, K0)
    course.next_wanted += wanted
    if wanted or course.refine > 0 or status != RUNNING:
        save(space, course, Y, course.now)
    return status


def advance(space, pair, control, course, watch, most_steps):
    """At most `most_steps` steps; returns a status. RUNNING also where there is no room for another step's points."""
    for _ in range(most_steps):
        if course.saved + max(1, course.refine) + 1 > course.room - (course.n_wanted - course.next_wanted):
            return RUNNING
        if course.found + 2 * watch.count > course.event_room:
            return RUNNING
        if course.restart:
            status = restart(space, pair, control, course, watch)
            if status != RUNNING:
                return status
        status = advance_state(space, pair, control, course)
        if status != RUNNING:
            return status
        status = finish_at_event(space, pair, course, watch)
        save_within(space, pair, course)
        status = complete_step(space, pair, course, status)
        if status != RUNNING:
            return status
    return RUNNING
