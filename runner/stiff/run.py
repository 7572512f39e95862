"""What all stiff methods do around their steps in compiled code: begin a segment, look for events, save points.

A run is cut into segments at the breakpoints of the inputs. A method starts afresh in each one, because a jump in f, or
in a low derivative of it, makes what it knew of the past worthless.
"""

import numpy as np

from qddot.runner.inputs.instants import after
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN, floats, layout
from qddot.runner.problem import Status
from qddot.runner.stiff.events import watch_segment
from qddot.runner.stiff.space import WITHIN, X_NEW, F, X
from qddot.runner.stiff.system import evaluate_f, evaluate_jacobian, evaluate_polynomial, set_inputs

RUNNING, FINISHED, TERMINATED = int(Status.RUNNING), int(Status.FINISHED), int(Status.TERMINATED)
NON_FINITE, TOO_MANY_STEPS = int(Status.NON_FINITE), int(Status.TOO_MANY_STEPS)
#: What the loop does next: have the algebraic states corrected, begin a segment, take a step, save points of the step.
CORRECT, START, STEP, SAVE = range(4)


#: Addresses and lengths of what a run goes through and writes. stops (n_stops,): breakpoints, then the end; requested
#: (n_requested,): output times, none where each step is saved; saved_t, saved_x: `room` points of n states; found_t,
#: found_event, found_x: `event_room` events.
POINTS = layout("n stops n_stops requested n_requested saved_t saved_x room found_t found_event found_x event_room")


@compiled(**INLINE)
def begin_segment(space, s, v, points, watch):
    """Evaluate f, its Jacobian and the events at the start of a segment; returns a status."""
    s.segment_end = floats(points.stops, points.n_stops)[s.segment]
    s.reaches_end = False
    s.length, s.t_new = 0.0, s.t
    set_inputs(space, s.t, after(s.t, s.segment_end - s.t))
    if watch_segment(space, s, v, points, watch):
        return TERMINATED
    evaluate_f(space, s, s.t, X, F)
    for i in range(v.shape[1]):
        if not np.isfinite(v[F, i]):
            s.failed_state = i
            return NON_FINITE
    evaluate_jacobian(space, s, v, s.t, 0.0)
    s.fresh_jacobian = True
    s.phase = STEP
    return RUNNING


@compiled(**INLINE)
def check_step(s, v):
    """Take note of a new step; returns NON_FINITE where a state is NaN or larger than the limit."""
    s.length = s.t_new - s.t
    s.phase = SAVE
    for i in range(v.shape[1]):
        if not abs(v[X_NEW, i]) <= s.limit:
            s.failed_state = i
            return NON_FINITE
    return RUNNING


@compiled(**INLINE)
def wants_inner_points(s, points):
    """Whether a point strictly within the step is to be saved."""
    if points.n_requested > 0:
        return (
            s.next_output < points.n_requested and floats(points.requested, points.n_requested)[s.next_output] < s.t_new
        )
    return s.refine > 1


@compiled(**LEAN)
def save_step(s, v, points):
    """Save what is wanted of the step; False where the room is full: call again with more."""
    requested = floats(points.requested, points.n_requested)
    while True:
        if points.n_requested > 0:
            if s.next_output == points.n_requested or requested[s.next_output] > s.t_new:
                return True
            time = requested[s.next_output]
        else:
            if s.next_part == s.refine:
                return True
            time = min(s.t + s.length * (s.next_part + 1) / s.refine, s.t_new)
            if s.next_part + 1 == s.refine or time == s.t_new:
                time, s.next_part = s.t_new, s.refine - 1
        if s.saved == points.room:
            return False
        save(s, v, points, time)
        s.next_output += 1
        s.next_part += 1


@compiled(**LEAN)
def save(s, v, points, time):
    """Save the state at a time within the step or at its end."""
    row = X_NEW
    if time < s.t_new:
        evaluate_polynomial(v, (time - s.t) / s.length)
        row = WITHIN
    floats(points.saved_t, points.room)[s.saved] = time
    x = floats(points.saved_x + 8 * points.n * s.saved, points.n)
    for i in range(points.n):
        x[i] = v[row, i]
    s.saved += 1


@compiled(**INLINE)
def finish_step(s, v, points):
    """Make the new point the present one; returns a status."""
    s.t = s.t_new
    for i in range(v.shape[1]):
        v[X, i] = v[X_NEW, i]
    s.next_part = 0
    s.steps += 1
    s.fresh_jacobian = False
    s.phase = STEP
    if s.terminated:
        return TERMINATED
    if s.reaches_end:
        s.segment += 1
        s.phase = CORRECT if s.algebraic else START
        if s.segment == points.n_stops:
            return FINISHED
    return TOO_MANY_STEPS if s.steps >= s.max_steps else RUNNING


@compiled(**INLINE)
def must_return(s, points, watch):
    """Whether the loop cannot go on by itself: algebraic states to be corrected, no room for events."""
    return s.phase == CORRECT or s.found + 2 * watch.count > points.event_room
