"""The compiled loop of the adaptive explicit methods: steps, breakpoints, saved points and events, in slices.

Between two breakpoints everything is smooth, and so is a step on whose sides the conditions of the model are held. At
each breakpoint, and where a condition changes its side, the loop restarts: the slope is taken anew with the inputs'
limits from the right, and the step size is the smaller of what was proposed before and what a first step would be.
"""

import numpy as np

from qddot.runner.explicit.norm import first_step, norm, scale
from qddot.runner.explicit.slopes import settle, slope
from qddot.runner.explicit.step import evaluate_end_slope, evaluate_next_slope, take_step
from qddot.runner.explicit.workspace import ERROR, ERROR_2, K0, NEW, SCALED, WITHIN, Y, copy
from qddot.runner.frame.hold import CHATTER, KEPT, NOTHING, keep_sides, release, take_sides
from qddot.runner.frame.log import has_room, next_stop
from qddot.runner.frame.search import NONE
from qddot.runner.frame.space import project, project_at_end, project_at_switch, row_address, state_within, states
from qddot.runner.frame.step_control import (
    LEAST_LAST_ERROR,
    MATLAB,
    after_failure,
    after_success,
    of_two_estimates,
)
from qddot.runner.frame.step_end import events_at_start, finish_step
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN
from qddot.runner.problem import Status

RUNNING, FINISHED, TERMINATED = int(Status.RUNNING), int(Status.FINISHED), int(Status.TERMINATED)
NON_FINITE, STEP_UNDERFLOW = int(Status.NON_FINITE), int(Status.STEP_UNDERFLOW)
TOO_MANY_STEPS = int(Status.TOO_MANY_STEPS)
#: Attempts of a step that are not finite, before conditions are free in it: their branch may end at the other side.
MOST_NON_FINITE = 2


@compiled(**LEAN)
def largest(space):
    """Index of the largest scaled error."""
    found, size, scaled = 0, -1.0, states(space, SCALED)
    for i in range(space.n):
        if scaled[i] > size:
            found, size = i, scaled[i]
    return found


@compiled(**LEAN)
def restart(space, pair, control, course, log, watch, sides):
    """Slope, inputs, sides, event values and step size where the right-hand side may jump; returns a status."""
    t, first = course.now, course.steps == 0
    ahead = next_stop(log) - t
    course.restart = 0
    settle(space, t, ahead)
    if space.project != 0:
        project(space, t, row_address(space, Y))
    if sides.count > 0:
        take_sides(space, sides, t, row_address(space, Y))
    slope(space, t, Y, K0)
    course.evaluations += 1
    copy(space, Y, NEW)
    if sides.count > 0 and not norm(space, control, K0) < np.inf:  # a hair beyond where the branch has values
        release(space, sides)
        slope(space, t, Y, K0)
        course.evaluations += 1
    if not norm(space, control, K0) < np.inf:
        course.failed_state = largest(space)
        return NON_FINITE
    if events_at_start(space, log, watch, t, first):
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
    return of_two_estimates(error, norm(space, control, ERROR_2)) if pair.estimates > 1 else error


@compiled(**LEAN)
def take_good_step(space, pair, control, course, log, sides):
    """Try steps until one is good; leaves it in the rows and in `course`; returns a status."""
    t, stop = course.now, next_stop(log)
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
        if failures > MOST_NON_FINITE and not error < np.inf and sides.count > 0 and sides.free == 0:
            release(space, sides)
            continue
        smaller = h * after_failure(control, error, failures)
        if min(size, h) <= least or (
            not error < np.inf and smaller <= least
        ):  # beside a wall steps would creep for ever
            scale(space, control, ERROR)
            course.failed_state = largest(space)
            return STEP_UNDERFLOW if error < np.inf else NON_FINITE
        size = max(least, smaller)
    course.size = h * after_success(control, error, course.last_error, failures > 0)
    if landing and failures == 0:
        course.size = max(course.size, proposed)
    course.last_error = error
    course.start, course.length, course.now = t, h, stop if landing else t + h
    course.steps += 1
    log.stop += landing
    course.restart = landing
    finish_attempt(space, pair, course)
    return RUNNING


@compiled(**LEAN)
def finish_attempt(space, pair, course):
    """Put the end of a good step on the constraints, and take the slope there."""
    t, h = course.start, course.length
    course.dense = 0
    if space.project != 0:
        project_at_end(space, t, h, row_address(space, NEW))
        course.evaluations += evaluate_end_slope(space, pair, t, h)
    else:
        course.evaluations += evaluate_next_slope(space, pair, t, h)


@compiled(**LEAN)
def hold_sides(space, pair, course, log, sides):
    """End a good step where a condition leaves its side; returns what became of it, see `keep_sides`.

    The step is taken again as far as there, so that its end is as exact as that of any other, its dense output too.
    """
    t, new = course.start, row_address(space, NEW)
    fate, part = keep_sides(space, log, sides, t, course.length, new)
    if fate in (KEPT, CHATTER):
        return fate
    log.stop -= course.restart
    course.restart = 1
    if fate == NOTHING:
        course.now = t
        course.steps -= 1
        course.failed_attempts += 1
        return fate
    course.length *= part
    course.now = t + course.length
    take_step(space, pair, t, course.length)
    course.evaluations += pair.stages - 1
    finish_attempt(space, pair, course)
    if space.project != 0:
        project_at_switch(space, t, course.length, new)
    return fate


@compiled(**LEAN)
def complete_step(space, pair, course, log, ended):
    """Make the end of the step, or of a part of it that a terminal event ended, the present state; returns a status."""
    status = RUNNING
    if ended != NONE:
        state_within(space, ended)
        copy(space, WITHIN, NEW)
        course.now = course.start + ended * course.length
        status = TERMINATED
    elif log.stop == log.n_stops:
        status = FINISHED
    elif course.max_steps > 0 and course.steps >= course.max_steps:
        status = TOO_MANY_STEPS
    copy(space, NEW, Y)
    copy(space, K0 + pair.next_slope, K0)
    return status


def run_slice(space, pair, control, course, log, watch, sides, most_steps):
    """At most `most_steps` steps; returns a status. RUNNING also where there is no room for what another step saves."""
    for _ in range(most_steps):
        if not has_room(log, watch.most):
            return RUNNING
        if course.restart:
            status = restart(space, pair, control, course, log, watch, sides)
            if status != RUNNING:
                return status
        status = take_good_step(space, pair, control, course, log, sides)
        if status != RUNNING:
            return status
        fate = hold_sides(space, pair, course, log, sides) if sides.count > 0 else KEPT
        if fate == NOTHING:
            continue
        if fate == CHATTER:
            return STEP_UNDERFLOW
        ended = finish_step(space, log, watch, course.start, course.length, course.now, row_address(space, NEW))
        status = complete_step(space, pair, course, log, ended)
        if status != RUNNING:
            return status
    return RUNNING
